//! A run of a scene that shows its cost, and whether it keeps its energy balance.

use std::time::{Duration, Instant};

use super::short_load::Way;
use crate::mechanics::{LinkObservation, Observation};
use crate::runtime::STATUS_PERIOD;
use crate::scene::Scene;
use crate::simulation::{Account, Diverged, EnergyVerdict, Simulation};
use crate::study::{is_at_rest, usual_until_s};

/// After these steps, their cost is known well enough.
const ENOUGH_STEPS: u32 = 20_000;
/// Looks at the links in a run.
const LOOKS: f64 = 5000.0;

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
    /// Places of an oscillator's masses, and those of the exact solution, m.
    pub(super) masses_m: Vec<[f64; 2]>,
}

impl Look {
    /// `None` of a scene without links and masses.
    pub(super) fn at(step: u32, seen: &Observation) -> Option<Self> {
        let first = seen.links.first()?;
        let angle_rad = first.chord_rad;
        let masses_m = first.nodes.iter().zip(&first.exact_x_m).map(|(node, exact_m)| [node.position_m[0], *exact_m]).collect();
        let middle_m = |link: &LinkObservation| link.nodes.get(link.nodes.len() / 2).and_then(|node| node.deflection_m);
        let deflections_m = seen.links.iter().map(|link| middle_m(link).unwrap_or_default()).collect();
        Some(Look { step, angle_rad, deflections_m, masses_m })
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
    /// Largest slope from a chord that was out of the model's range, rad; `None` if none was.
    pub(super) out_of_range: Option<f64>,
    /// Simulated time at which a run that took too long was ended, s.
    pub(super) cut_off_s: Option<f64>,
    /// Whether nothing was seen to move in the whole run, to its end: no coordinate, and no prescribed angle.
    pub(super) stands_still: bool,
    pub(super) verdict: Result<EnergyVerdict, Diverged>,
    /// The last status of a run in real time that would tell it is not to be trusted, where the whole is.
    pub(super) distrust: Option<Distrust>,
}

/// A run whose energy balance is not kept until some time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Distrust {
    /// Simulated time, s.
    pub(super) time_s: f64,
    /// Largest error of the balance until then, J.
    pub(super) worst_j: f64,
    /// Energy in play by then, J.
    pub(super) in_play_j: f64,
}

impl Distrust {
    /// `None` where the balance is kept so far.
    fn of(simulation: &Simulation) -> Option<Self> {
        match simulation.account().verdict {
            EnergyVerdict::Unbalanced { worst_j, in_play_j } => {
                Some(Distrust { time_s: simulation.time_s(), worst_j, in_play_j })
            }
            EnergyVerdict::Balanced | EnergyVerdict::NotJudged => None,
        }
    }
}

impl Trial {
    /// The first link's ways from look to look, of a run with this step.
    pub(super) fn ways(&self, step_s: f64) -> Vec<Way> {
        let way = |pair: &[Look]| {
            let [from_rad, to_rad] = [pair[0].angle_rad, pair[1].angle_rad];
            Way { from_rad, to_rad, rad_per_s: (to_rad - from_rad) / (f64::from(pair[1].step - pair[0].step) * step_s) }
        };
        self.looks.windows(2).map(way).collect()
    }

    /// Runs to the end, and on until `shortest` is over; within the limit of time.
    pub(super) fn of(simulation: &mut Simulation, length: RunLength, shortest: Duration) -> Self {
        let RunLength { until_s, longest } = length;
        let begun = Instant::now();
        let (mut judged, mut steps, mut taken) = (None, 0_u32, Ok(()));
        let (mut cost, mut out_of_range, mut looks) = (Duration::ZERO, None, Vec::new());
        let seldom = (until_s / simulation.step_s() / LOOKS).max(1.0) as u32;
        let began = position(simulation);
        let mut stands_still = began.is_some();
        let (mut distrust, mut next_status_s) = (None, STATUS_PERIOD.as_secs_f64());
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
                looks.extend(Look::at(steps, seen));
                out_of_range = [out_of_range, seen.out_of_range].into_iter().flatten().reduce(f64::max);
                stands_still = stands_still && began.as_ref().is_some_and(|began| is_still_at(began, simulation));
                if simulation.time_s() >= next_status_s {
                    next_status_s += STATUS_PERIOD.as_secs_f64();
                    distrust = Distrust::of(simulation).or(distrust);
                }
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
            stands_still: stands_still && steps > 1 && cut_off_s.is_none() && taken.is_ok(),
            balance_error: is_judged.then(|| ledger.worst_balance_j / ledger.in_play_j),
            verdict: taken.map(|()| verdict),
            distrust: distrust.filter(|_| verdict == EnergyVerdict::Balanced),
        }
    }
}

/// Simulated time until which nothing is seen to move after the first step, s, at most `until_s`; 0 if something does, or cannot be told.
pub(super) fn stands_still_s(simulation: &mut Simulation, until_s: f64) -> f64 {
    let Some(began) = position(simulation) else { return 0.0 };
    let mut still_s = 0.0;
    while simulation.time_s() < until_s && simulation.step().is_ok() && is_still_at(&began, simulation) {
        still_s = simulation.time_s();
    }
    still_s
}

/// The coordinates, and the prescribed angle, if there is one; `None` of a model that does not tell.
fn position(simulation: &mut Simulation) -> Option<Vec<f64>> {
    let motion = simulation.motion()?;
    Some(motion.q.into_iter().chain(motion.input.motion.map(|[angle_rad, ..]| angle_rad)).collect())
}

fn is_still_at(began: &[f64], simulation: &mut Simulation) -> bool {
    position(simulation).is_some_and(|now| is_at_rest(began, &now))
}
