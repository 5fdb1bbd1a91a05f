//! A run of a scene that shows its cost, and whether it keeps its energy balance.

use std::time::{Duration, Instant};

use crate::mechanics::{LinkObservation, Observation};
use crate::scene::Scene;
use crate::simulation::{Account, Diverged, EnergyVerdict, Simulation};
use crate::study::usual_until_s;

/// After these steps, their cost is known well enough.
const ENOUGH_STEPS: u32 = 20_000;
/// Looks at the links in a run.
const LOOKS: f64 = 5000.0;

/// Angles and deflections that differ by less are the same, rad and m.
const STILL: f64 = 1e-12;

/// The length of a run, and the limit within which it reaches that.
#[derive(Debug, Clone, Copy)]
pub(super) struct RunLength {
    /// Simulated time, s.
    pub(super) until_s: f64,
    /// Longest computing time.
    pub(super) longest: Duration,
}

impl RunLength {
    /// The usual one of a scene.
    pub(super) fn usual(scene: &Scene) -> Self {
        RunLength { until_s: usual_until_s(scene), longest: Duration::from_secs(2) }
    }

    /// One that was asked for.
    pub(super) fn asked(until_s: f64) -> Self {
        RunLength { until_s, longest: Duration::from_secs(30) }
    }
}

/// The links at one instant of a run.
pub(super) struct Look {
    /// Steps until then.
    pub(super) step: u32,
    /// Angle of the first link's chord, rad.
    pub(super) angle_rad: f64,
    /// Deflections of the links' middle nodes, m; 0 of a link without such a node.
    pub(super) deflections_m: Vec<f64>,
}

impl Look {
    /// Whether the links stand as at another instant, but for rounding.
    fn is_like(&self, other: &Self) -> bool {
        let near = |one: f64, other: f64| (one - other).abs() <= STILL;
        let deflections = self.deflections_m.iter().zip(&other.deflections_m);
        near(self.angle_rad, other.angle_rad) && deflections.fold(true, |all, (one, other)| all && near(*one, *other))
    }

    /// `None` of a scene without links.
    pub(super) fn at(step: u32, seen: &Observation) -> Option<Self> {
        let angle_rad = seen.links.first()?.chord_rad;
        let middle_m = |link: &LinkObservation| link.nodes.get(link.nodes.len() / 2).and_then(|node| node.deflection_m);
        let deflections_m = seen.links.iter().map(|link| middle_m(link).unwrap_or_default()).collect();
        Some(Look { step, angle_rad, deflections_m })
    }
}

/// A run of the scene.
pub(super) struct Trial {
    /// Mean wall time of a step, s; `None` if it diverged.
    pub(super) step_cost_s: Option<f64>,
    /// Largest error of the energy balance, over the energy in play; `None` if it is not judged.
    pub(super) balance_error: Option<f64>,
    /// Looks at the links; none of a scene without any.
    pub(super) looks: Vec<Look>,
    /// Largest deflection over length that was out of the model's range; `None` if none was.
    pub(super) out_of_range: Option<f64>,
    /// Simulated time at which a run that took too long was ended, s.
    pub(super) cut_off_s: Option<f64>,
    pub(super) verdict: Result<EnergyVerdict, Diverged>,
}

impl Trial {
    /// Whether the links were seen not to move.
    pub(super) fn stands_still(&self) -> bool {
        matches!(self.looks.as_slice(), [first, .., last] if first.step < last.step)
            && self.looks.iter().all(|look| look.is_like(&self.looks[0]))
    }

    /// Runs to the end, and on until `shortest` is over; within the limit of time.
    pub(super) fn of(simulation: &mut Simulation, length: RunLength, shortest: Duration) -> Self {
        let RunLength { until_s, longest } = length;
        let begun = Instant::now();
        let (mut judged, mut steps, mut taken) = (None, 0_u32, Ok(()));
        let (mut cost, mut out_of_range, mut looks) = (Duration::ZERO, None, Vec::new());
        let seldom = (until_s / simulation.step_s() / LOOKS).max(1.0) as u32;
        while taken.is_ok() {
            let (elapsed, is_whole) = (begun.elapsed(), simulation.time_s() >= until_s);
            if is_whole && judged.is_none() {
                judged = Some(simulation.account());
            }
            let is_measured = elapsed >= shortest || steps >= ENOUGH_STEPS;
            if steps > 0 && (is_whole && is_measured || elapsed >= longest) {
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
                looks.extend(Look::at(steps, seen));
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
