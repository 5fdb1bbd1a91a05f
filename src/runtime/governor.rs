//! Chooses the level of detail that keeps the deadlines. A pure type: time is passed in, so tests use a simulated clock.

use std::time::Duration;

/// A step that takes more than this part of its wall time is a reason to go to a cheaper level: the next deadline is at stake.
const COSTLY: f64 = 0.8;
/// The part of its wall time that a step is expected to take at the level gone to, at most.
const AIM: f64 = 0.6;
/// A step may take this much longer than usual by interrupts and cold caches: it says nothing of the machine's speed.
const NOISE_S: f64 = 20e-6;
/// Steps with room for the better level that make up for one without: a single stall of the machine is no load.
const MAKE_UP: f64 = 20.0;
/// Time for which the better level must have room, at first and at most: it doubles when a return was too early.
const PATIENCE: [Duration; 2] = [Duration::from_millis(500), Duration::from_millis(1400)];
/// The same for the next better level after a return.
const FURTHER: Duration = Duration::from_millis(150);
/// A descent so soon after a return shows that the return was too early.
const TOO_EARLY: Duration = Duration::from_secs(1);
/// A second stall of the machine so soon after one is taken for a load.
const LATELY: Duration = Duration::from_millis(100);
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
}

/// Goes to a cheaper level before a deadline is lost, from the cost of the last step, and back when there was room for a while.
///
/// The machine slows every level down alike: with the cost c of a step and the usual cost u of its level the slowdown is `s = c/u`,
/// and a step of level k will take `s u_k`. A step of a few microseconds tells s badly, so the way back is by one level at a time.
#[derive(Debug, Clone)]
pub struct Governor {
    levels: Vec<Level>,
    present: usize,
    /// The best level that it may return to.
    best: usize,
    /// Mean cost of the last few steps, s.
    mean_s: f64,
    /// Time for which there has been room for the better level, s, less what steps without room took away.
    room_s: f64,
    patience: Duration,
    returned: Option<Duration>,
    /// When a step that was given up was last found to be cheap.
    stalled: Option<Duration>,
    /// The level that was left last for a cheaper one, and its `room_s` then.
    left: Option<LeftLevel>,
    /// The level to return to after a stall, and the `room_s` that it has left.
    returning: Option<LeftLevel>,
}

/// A level, and for how long it had room for the better one.
#[derive(Debug, Clone, Copy)]
struct LeftLevel {
    level: usize,
    room_s: f64,
}

impl Governor {
    /// For levels from the best to the cheapest, at the level `present`.
    pub fn new(levels: &[LevelCost], present: usize) -> Self {
        let level =
            |level: &LevelCost| Level { period_s: level.period.as_secs_f64(), usual_s: level.usual.as_secs_f64().max(1e-9) };
        let levels: Vec<Level> = levels.iter().map(level).collect();
        let mean_s = levels.get(present).map_or(0.0, |level| level.usual_s);
        let patience = PATIENCE[0];
        Governor {
            levels,
            present,
            best: 0,
            mean_s,
            room_s: 0.0,
            patience,
            returned: None,
            stalled: None,
            left: None,
            returning: None,
        }
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
        if level > self.present {
            self.left = Some(LeftLevel { level: self.present, room_s: self.room_s });
        }
        self.present = level;
        self.mean_s = self.levels.get(level).map_or(0.0, |level| level.usual_s);
        let returning = self.returning.take().filter(|returning| returning.level == level);
        self.room_s = returning.map_or(0.0, |returning| returning.room_s);
    }

    /// Takes the cost of a step that ended `now`. Returns the level to go to, if it is another.
    pub fn after_step(&mut self, now: Duration, cost: Duration) -> Option<usize> {
        let cost_s = cost.as_secs_f64();
        let level = self.levels.get_mut(self.present)?;
        self.mean_s += WEIGHT * (cost_s - self.mean_s);
        level.usual_s = level.usual_s.min(self.mean_s);
        let (usual_s, costly_s) = (level.usual_s, COSTLY * level.period_s);
        self.note_room(cost_s);
        if cost_s > costly_s { self.cheaper(now, cost_s / usual_s) } else { self.better(now) }
    }

    /// Whether a level is expected to keep up with steps that take `slowdown` times as long as usual.
    fn keeps_up(&self, level: usize, slowdown: f64) -> bool {
        self.levels.get(level).is_some_and(|level| slowdown * level.usual_s <= AIM * level.period_s)
    }

    /// Notes whether a step of this cost leaves room for the better level.
    fn note_room(&mut self, cost_s: f64) {
        let Level { period_s, usual_s } = self.levels[self.present];
        let slowdown = ((cost_s - NOISE_S) / usual_s).max(1.0);
        let has_room = self.present.checked_sub(1).is_some_and(|better| self.keeps_up(better, slowdown));
        self.room_s = (self.room_s + if has_room { period_s } else { -MAKE_UP * period_s }).max(0.0);
    }

    /// Time after which a step at the present level is costly.
    pub fn costly(&self) -> Duration {
        let period_s = self.levels.get(self.present).map_or(0.0, |level| level.period_s);
        Duration::from_secs_f64(COSTLY * period_s)
    }

    /// Takes the cost of the step that was given up at a level, which is known when it is done. A cheap step was kept from its
    /// processor, by no load: its level is returned to at once, if that was not so a moment ago, and the wait for the better one goes on
    /// as after a stall without a spare. Returns the level to go to.
    pub fn after_given_up(&mut self, now: Duration, level: usize, cost: Duration) -> Option<usize> {
        let period_s = self.levels.get(level)?.period_s;
        if cost.as_secs_f64() > AIM * period_s {
            self.descends(now);
            return None;
        }
        let lately = self.stalled.replace(now).is_some_and(|stalled| now.saturating_sub(stalled) < LATELY);
        if lately || !(self.best..self.present).contains(&level) {
            return None;
        }
        let left = self.left.filter(|left| left.level == level);
        self.returning =
            left.map(|LeftLevel { level, room_s }| LeftLevel { level, room_s: (room_s - MAKE_UP * period_s).max(0.0) });
        Some(level)
    }

    /// The best of the cheaper levels that is expected to keep up, or the cheapest.
    fn cheaper(&mut self, now: Duration, slowdown: f64) -> Option<usize> {
        let last = self.levels.len() - 1;
        if self.present == last {
            return None;
        }
        self.descends(now);
        Some((self.present + 1..=last).find(|level| self.keeps_up(*level, slowdown)).unwrap_or(last))
    }

    /// Notes whether the last return was too early.
    fn descends(&mut self, now: Duration) {
        if self.returned.take().is_some_and(|returned| now.saturating_sub(returned) < TOO_EARLY) {
            self.patience = (2 * self.patience).min(PATIENCE[1]);
        }
    }

    /// The next better level, if there was room for it long enough.
    fn better(&mut self, now: Duration) -> Option<usize> {
        let since_return = self.returned.map(|returned| now.saturating_sub(returned));
        if since_return.is_some_and(|since| since > 10 * TOO_EARLY) {
            self.patience = PATIENCE[0];
        }
        let enough = if self.returned.is_some() { FURTHER } else { self.patience };
        if self.present <= self.best || self.room_s < enough.as_secs_f64() {
            return None;
        }
        self.returned = Some(now);
        Some(self.present - 1)
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

    /// On the way back, the spare takes a step ten times because the machine stalls; each costs the wait 20 ms, and not all of it.
    #[test]
    fn regress_stalls_on_the_way_back_do_not_begin_the_wait_anew() {
        let mut governor = four();
        assert_eq!(governor.after_step(Duration::ZERO, 2 * MS), Some(2));
        governor.went_to(2);
        assert_eq!(run(&mut governor, 1, 3000, 5.0), []);
        let (mut step, mut back) = (3001, Vec::new());
        while governor.present > 0 && step < 6000 {
            // Ten stalls, 110 ms apart.
            if step % 110 == 0 && step < 4200 {
                let level = governor.present;
                governor.went_to(level + 1);
                assert_eq!(governor.after_given_up(step * MS, level, 20 * US), Some(level));
                governor.went_to(level);
            }
            back.extend(run(&mut governor, step, 1, 1.0));
            step += 1;
        }
        // 500 ms, and 20 ms for each of the five stalls in them; then 150 ms for the next level, and two more.
        assert!(matches!(back[..], [(first, 1), (second, 0)] if first < 3630 && second < first + 200), "{back:?}");
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
        // Half a second after the load, and the last level soon after that.
        assert_eq!(run(&mut governor, 2500, 3000, 1.0), [(2999, 1), (3149, 0)]);
    }

    /// Interrupts prolong steps by up to 15 µs, and four times a second a stall of the machine takes half a step's time: no load.
    #[test]
    fn regress_a_noisy_machine_does_not_keep_it_at_a_cheap_level() {
        let usual = [400, 150, 40, 10].map(|us| us * US);
        for seed in 0..50_u32 {
            let (mut governor, mut random) = (four(), seed);
            governor.after_step(Duration::ZERO, 5 * MS);
            governor.went_to(3);
            governor.patience = PATIENCE[1];
            let mut step = 0;
            while governor.present > 0 && step < 2000 {
                step += 1;
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = random >> 16 & 15;
                let stall = if (step + seed) % 250 == 0 { MS / 2 } else { Duration::ZERO };
                if let Some(to) = governor.after_step(step * MS, usual[governor.present] + noise * US + stall) {
                    governor.went_to(to);
                }
            }
            assert!(step < 2000, "seed {seed}: {step} ms");
        }
    }

    /// From the cheapest level a load of twice the usual cost cannot be told from noise; from the next ones it can.
    #[test]
    fn prop_it_returns_level_by_level() {
        let mut governor = four();
        governor.went_to(3);
        assert_eq!(run(&mut governor, 0, 3000, 2.0), [(499, 2), (649, 1)]);
        assert_eq!(run(&mut governor, 3000, 1000, 1.0), [(3149, 0)]);
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
    fn prop_a_step_that_was_given_up_is_a_descent() {
        let mut governor = four();
        assert_eq!(governor.costly(), 800 * US);
        run(&mut governor, 0, 1000, 1.0);
        governor.went_to(1);
        assert_eq!(governor.after_given_up(1001 * MS, 0, 2 * MS), None, "a load");
        assert_eq!(run(&mut governor, 1001, 500, 5.0), [], "750 µs is not too much");
        assert_eq!(run(&mut governor, 1501, 1, 6.0), [(1501, 2)]);
        assert_eq!(run(&mut governor, 1502, 3000, 1.0).last().map(|(_, level)| *level), Some(0));
    }

    #[test]
    fn prop_a_step_that_was_kept_from_its_processor_is_no_load() {
        let mut governor = four();
        governor.went_to(1);
        assert_eq!(governor.after_given_up(1001 * MS, 0, 420 * US), Some(0));
        governor.went_to(0);
        assert_eq!(run(&mut governor, 1001, 10, 1.0), []);
        governor.went_to(1);
        assert_eq!(governor.after_given_up(1012 * MS, 0, 420 * US), None, "a moment later again");
        assert_eq!(run(&mut governor, 1012, 3000, 1.0).len(), 1, "it returns when there was room for a while");
    }

    #[test]
    fn prop_the_cheapest_level_is_the_last_resort() {
        let mut governor = four();
        assert_eq!(run(&mut governor, 0, 100, 1000.0).last().map(|(_, level)| *level), Some(3));
        assert_eq!(governor.after_step(MS, 10 * MS), None);
        assert_eq!(Governor::new(&[LevelCost { period: MS, usual: US }], 0).after_step(MS, 10 * MS), None);
    }
}
