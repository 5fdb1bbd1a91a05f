//! Chooses the level of detail that keeps the deadlines. A pure type: time is passed in, so tests use a simulated clock.

use std::time::Duration;

/// A step that takes more than this part of its wall time is a reason to go to a cheaper level: the next deadline is at stake.
const COSTLY: f64 = 0.8;
/// The part of its wall time that a step is expected to take at the cheaper level, at most.
const AIM: f64 = 0.6;
/// The same at a better level that is returned to.
const ROOM: f64 = 0.5;
/// Time over which the slowdown is averaged, before a better level is returned to.
const MEMORY: Duration = Duration::from_millis(100);
/// Time for which a better level must have room, at first and at most: it doubles when a return was too early.
const PATIENCE: [Duration; 2] = [Duration::from_millis(500), Duration::from_millis(1500)];
/// A descent so soon after a return shows that the return was too early.
const TOO_EARLY: Duration = Duration::from_secs(1);
/// Weight of a step in the usual cost of its level.
const WEIGHT: f64 = 0.1;

/// A level as the governor sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelCost {
    /// Wall time of a step.
    pub period: Duration,
    /// Usual time to compute a step.
    pub usual: Duration,
}

/// State of a level.
#[derive(Debug, Clone, Copy)]
struct Level {
    period_s: f64,
    /// The least that a few steps took in the mean, s.
    usual_s: f64,
    /// Since when there is room for it.
    room_since: Option<Duration>,
}

/// Goes to a cheaper level before a deadline is lost, from the cost of the last step, and back when there was room for a while.
///
/// The machine slows every level down alike: with the cost c of a step and the usual cost u of its level the slowdown is `s = c/u`,
/// and a step of level k will take `s u_k`.
#[derive(Debug, Clone)]
pub struct Governor {
    levels: Vec<Level>,
    present: usize,
    /// The best level that it may return to.
    best: usize,
    /// Mean cost of the last few steps, s.
    mean_s: f64,
    /// Mean slowdown over [`MEMORY`].
    slowdown: f64,
    patience: Duration,
    returned: Option<Duration>,
}

impl Governor {
    /// For levels from the best to the cheapest, at the level `present`.
    pub fn new(levels: &[LevelCost], present: usize) -> Self {
        let level = |level: &LevelCost| Level {
            period_s: level.period.as_secs_f64(),
            usual_s: level.usual.as_secs_f64().max(1e-9),
            room_since: None,
        };
        let levels: Vec<Level> = levels.iter().map(level).collect();
        let mean_s = levels.get(present).map_or(0.0, |level| level.usual_s);
        let patience = PATIENCE[0];
        Governor { levels, present, best: 0, mean_s, slowdown: 1.0, patience, returned: None }
    }

    /// Takes new costs of the levels, after a change of the scene.
    pub fn with_costs(&self, levels: &[LevelCost]) -> Self {
        Governor { best: self.best, patience: self.patience, ..Governor::new(levels, self.present) }
    }

    /// Notes that the run went to a level by command, which is the best to return to from now on.
    pub fn commanded(&mut self, level: usize) {
        self.best = level;
        self.went_to(level);
    }

    /// Notes that the run went to a level.
    pub fn went_to(&mut self, level: usize) {
        self.present = level;
        self.mean_s = self.slowdown * self.levels.get(level).map_or(0.0, |level| level.usual_s);
        self.levels.iter_mut().for_each(|level| level.room_since = None);
    }

    /// Takes the cost of a step that ended `now`. Returns the level to go to, if it is another.
    pub fn after_step(&mut self, now: Duration, cost: Duration) -> Option<usize> {
        let cost_s = cost.as_secs_f64();
        let level = self.levels.get_mut(self.present)?;
        self.mean_s += WEIGHT * (cost_s - self.mean_s);
        level.usual_s = level.usual_s.min(self.mean_s);
        let (usual_s, period_s) = (level.usual_s, level.period_s);
        let weight = (period_s / MEMORY.as_secs_f64()).min(1.0);
        self.slowdown += weight * (cost_s / usual_s - self.slowdown);
        if cost_s > COSTLY * period_s {
            return self.cheaper(now, cost_s / usual_s);
        }
        self.better(now)
    }

    /// The best of the cheaper levels that is expected to keep up, or the cheapest.
    fn cheaper(&mut self, now: Duration, slowdown: f64) -> Option<usize> {
        self.slowdown = self.slowdown.max(slowdown);
        let last = self.levels.len() - 1;
        let keeps_up = |index: &usize| slowdown * self.levels[*index].usual_s <= AIM * self.levels[*index].period_s;
        let to = (self.present + 1..=last).find(keeps_up).unwrap_or(last);
        if self.returned.take().is_some_and(|returned| now.saturating_sub(returned) < TOO_EARLY) {
            self.patience = (2 * self.patience).min(PATIENCE[1]);
        }
        (to != self.present).then_some(to)
    }

    /// The best level for which there was room long enough.
    fn better(&mut self, now: Duration) -> Option<usize> {
        if self.returned.is_some_and(|returned| now.saturating_sub(returned) > 10 * TOO_EARLY) {
            self.patience = PATIENCE[0];
        }
        let (slowdown, patience) = (self.slowdown, self.patience);
        for level in &mut self.levels[..self.present] {
            let has_room = slowdown * level.usual_s <= ROOM * level.period_s;
            level.room_since = if has_room { level.room_since.or(Some(now)) } else { None };
        }
        let long_enough = |level: &Level| level.room_since.is_some_and(|since| now.saturating_sub(since) >= patience);
        let to = (self.best..self.present).find(|index| long_enough(&self.levels[*index]))?;
        self.returned = Some(now);
        Some(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);
    const US: Duration = Duration::from_micros(1);

    /// Four levels at 1 kHz, of 400, 150, 40 and 10 µs a step.
    fn four() -> Governor {
        let level = |us: u32| LevelCost { period: MS, usual: us * US };
        Governor::new(&[400, 150, 40, 10].map(level), 0)
    }

    /// Runs steps of 1 ms at the present level's usual cost times `slowdown`; returns the levels gone to, with their times in ms.
    fn run(governor: &mut Governor, from_ms: u32, steps: u32, slowdown: f64) -> Vec<(u32, usize)> {
        let usual = [400, 150, 40, 10].map(|us| us * US);
        let mut gone = Vec::new();
        for step in from_ms..from_ms + steps {
            if let Some(to) = governor.after_step(step * MS, usual[governor.present].mul_f64(slowdown)) {
                governor.went_to(to);
                gone.push((step, to));
            }
        }
        gone
    }

    #[test]
    fn prop_an_undisturbed_run_stays_at_the_best_level() {
        assert_eq!(run(&mut four(), 0, 10_000, 1.0), []);
        assert_eq!(run(&mut four(), 0, 10_000, 1.9), []);
    }

    /// One step is enough to see it, and the level gone to keeps up: 5 × 150 µs would not, 5 × 40 µs does.
    #[test]
    fn prop_a_load_is_answered_after_one_step_and_left_when_it_ends() {
        let mut governor = four();
        assert_eq!(run(&mut governor, 0, 1000, 1.0), []);
        assert_eq!(run(&mut governor, 1000, 1500, 5.0), [(1000, 2)]);
        let back = run(&mut governor, 2500, 3000, 1.0);
        assert_eq!(back.last().map(|(_, level)| *level), Some(0));
        assert!(back.iter().all(|(ms, _)| (3000..4500).contains(ms)), "{back:?}");
    }

    #[test]
    fn prop_a_load_that_comes_and_goes_makes_it_patient() {
        let mut governor = four();
        let mut switches = 0;
        for round in 0..20 {
            switches += run(&mut governor, 1400 * round, 700, 5.0).len() + run(&mut governor, 1400 * round + 700, 700, 1.0).len();
        }
        assert!(switches < 30, "{switches}");
        assert!(governor.patience <= PATIENCE[1]);
    }

    #[test]
    fn prop_it_never_rises_above_the_level_that_was_commanded() {
        let mut governor = four();
        governor.commanded(1);
        assert_eq!(run(&mut governor, 0, 3000, 1.0), []);
        assert_eq!(run(&mut governor, 3000, 100, 10.0), [(3000, 2)]);
        assert_eq!(run(&mut governor, 3100, 3000, 1.0).last().map(|(_, level)| *level), Some(1));
    }

    #[test]
    fn prop_the_cheapest_level_is_the_last_resort() {
        let mut governor = four();
        assert_eq!(run(&mut governor, 0, 100, 1000.0).last().map(|(_, level)| *level), Some(3));
        assert_eq!(governor.after_step(MS, 10 * MS), None);
        assert_eq!(Governor::new(&[LevelCost { period: MS, usual: US }], 0).after_step(MS, 10 * MS), None);
    }
}
