//! A run of a scene that shows its cost, and whether it keeps its energy balance.

use std::time::{Duration, Instant};

use crate::simulation::{Account, Diverged, EnergyVerdict, Simulation};

/// Longest run of the scene, computing time.
pub(super) const LONGEST: Duration = Duration::from_secs(2);
/// Most steps of the run.
const MOST_STEPS: u32 = 20_000;
/// Looks at the links in a run.
const LOOKS: f64 = 5000.0;

/// The first link at one instant of a run.
pub(super) struct Look {
    /// Steps until then.
    pub(super) step: u32,
    /// Angle of its chord, rad.
    pub(super) angle_rad: f64,
}

/// A run of the scene.
pub(super) struct Trial {
    /// Mean wall time of a step, s; `None` if it diverged.
    pub(super) step_cost_s: Option<f64>,
    /// Largest error of the energy balance, over the energy in play; `None` if it is not judged.
    pub(super) balance_error: Option<f64>,
    /// Looks at the first link; none of a scene without links.
    pub(super) looks: Vec<Look>,
    /// Largest deflection over length that was out of the model's range; `None` if none was.
    pub(super) out_of_range: Option<f64>,
    /// Simulated time at which a run that took too long was ended, s.
    pub(super) cut_off_s: Option<f64>,
    pub(super) verdict: Result<EnergyVerdict, Diverged>,
}

impl Trial {
    /// Runs to `until_s`, and on until `shortest` is over; within the limits of steps and time.
    pub(super) fn of(simulation: &mut Simulation, until_s: f64, shortest: Duration) -> Self {
        let begun = Instant::now();
        let (mut judged, mut steps, mut taken) = (None, 0_u32, Ok(()));
        let (mut cost, mut out_of_range, mut looks) = (Duration::ZERO, None, Vec::new());
        let seldom = (until_s / simulation.step_s() / LOOKS).max(1.0) as u32;
        while taken.is_ok() && steps < MOST_STEPS {
            let (elapsed, is_whole) = (begun.elapsed(), simulation.time_s() >= until_s);
            if is_whole && judged.is_none() {
                judged = Some(simulation.account());
            }
            if steps > 0 && (is_whole && elapsed >= shortest || elapsed >= LONGEST) {
                break;
            }
            let stepping = Instant::now();
            taken = simulation.step();
            cost += stepping.elapsed();
            steps += 1;
            if is_whole && taken.is_err() {
                // After the run that is judged.
                taken = Ok(());
                break;
            }
            if steps.is_multiple_of(seldom)
                && !is_whole
                && let Ok(seen) = simulation.observe()
            {
                out_of_range = [out_of_range, seen.out_of_range].into_iter().flatten().reduce(f64::max);
                looks.extend(seen.links.first().map(|link| Look { step: steps, angle_rad: link.chord_rad }));
            }
        }
        let cut_off_s = (taken.is_ok() && simulation.time_s() < until_s).then(|| simulation.time_s());
        let Account { verdict, ledger, .. } = judged.unwrap_or_else(|| simulation.account());
        let is_judged = verdict != EnergyVerdict::NotJudged && ledger.in_play_j > 0.0;
        Trial {
            step_cost_s: taken.is_ok().then(|| cost.as_secs_f64() / f64::from(steps.max(1))),
            looks,
            out_of_range,
            cut_off_s,
            balance_error: is_judged.then(|| ledger.worst_balance_j / ledger.in_play_j),
            verdict: taken.map(|()| verdict),
        }
    }
}
