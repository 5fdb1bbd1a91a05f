//! One cell: a scene with overrides, run for a number of steps and compared throughout.

use super::base_scene::BaseScene;
use super::outcome::{Category, Outcome};
use super::plan::{Cell, Measure, Switch};
use super::trajectory::{Trajectory, distance_m, points};
use crate::scene::SceneSource;
use crate::simulation::{Diverged, EnergyLedger, Route, Simulation};

/// A cell is wrong when a pin or the middle of the rod is ever further from its reference than this part of its [`Measure`]; where
/// no reference reaches, when the energy balance is off by this part of the energy that was there and put in.
pub const BOUND: f64 = 0.01;
/// Approximate number of observations in a run.
const LOOKS: u64 = 400;
/// Approximate number of samples in a reference.
const SAMPLES: u64 = 4000;
/// Smallest distance that errors are relative to, over the length of crank and rod.
const LEAST_TRAVEL: f64 = 1e-3;

/// Runs a cell; every end is an outcome.
pub(super) fn run(base: &BaseScene, cell: &Cell, reference: Option<&Trajectory>) -> Outcome {
    let refused = |message| Outcome::without_run(Category::Refused, message);
    let (mut simulation, source) = match build(base, cell) {
        Ok(built) => built,
        Err(message) => return refused(message),
    };
    let mut switch = match cell.switch.as_ref().map(|switch| Pending::new(&source, switch)).transpose() {
        Ok(switch) => switch,
        Err(message) => return refused(message),
    };
    let length_m = source.scene.chain().map_or(1.0, |chain| chain.links.iter().map(|link| link.length_m).sum());
    let mut comparison =
        Comparison { reference, length_m, measure: cell.measure, distance_m: None, reference_travel_m: 0.0, out_of_range: false };
    let every = (cell.steps / LOOKS).max(1);
    for n in 1..=cell.steps {
        let look = n % every == 0 || n == cell.steps;
        let taken = simulation.step().and_then(|()| if look { simulation.observe().map(drop) } else { Ok(()) });
        if let Err(diverged) = taken {
            return ended(diverged, comparison.error(), &simulation);
        }
        if let Some(mut due) = switch.take_if(|switch| simulation.time_s() >= switch.at_s)
            && let Err(not_changed) = simulation.change_to(&mut due.next, &mut due.route)
        {
            return Outcome { category: Category::Refused, message: not_changed.to_string(), ..reached(&simulation, None) };
        }
        if look {
            if !all_finite(&simulation) {
                return Outcome { category: Category::NotFinite, ..reached(&simulation, None) };
            }
            comparison.look(&simulation);
        }
    }
    let error = comparison.error().or_else(|| unbalanced(&simulation.ledger(), simulation.energy_accounted_j()));
    let wrong = comparison.out_of_range || error.is_some_and(|error| error > BOUND);
    Outcome { category: if wrong { Category::Wrong } else { Category::Stable }, ..reached(&simulation, error) }
}

/// Runs a reference as far as it goes.
pub(super) fn follow(base: &BaseScene, reference: &Cell) -> Trajectory {
    let Ok((mut simulation, _)) = build(base, reference) else { return Trajectory::default() };
    let every = reference.steps.div_ceil(SAMPLES).max(1);
    let mut trajectory = Trajectory {
        interval_s: every as f64 * simulation.step_s(),
        points: points(simulation.observation()).into_iter().collect(),
    };
    for n in 1..=reference.steps {
        if simulation.step().is_err() {
            break;
        }
        if n % every == 0 {
            let Some(at) = simulation.observe().ok().and_then(points) else { break };
            trajectory.points.push(at);
        }
    }
    trajectory
}

/// A change that its time has not come for.
struct Pending {
    at_s: f64,
    next: Simulation,
    route: Route,
}

impl Pending {
    fn new(before: &SceneSource, switch: &Switch) -> Result<Self, String> {
        let after = before.changed(&switch.changes).map_err(|refused| refused.to_string())?;
        let next = Simulation::new(&after.scene).map_err(|refused| refused.to_string())?;
        let route = Route::new(&before.scene, &after.scene).map_err(|refused| refused.to_string())?;
        Ok(Pending { at_s: switch.at_s, next, route })
    }
}

/// The simulation and its scene.
fn build(base: &BaseScene, cell: &Cell) -> Result<(Simulation, SceneSource), String> {
    let source = SceneSource::parse(&base.origin, &base.text, &cell.overrides).map_err(|refused| refused.to_string())?;
    let simulation = Simulation::new(&source.scene).map_err(|refused| refused.to_string())?;
    Ok((simulation, source))
}

/// Compares a run with its reference.
struct Comparison<'a> {
    reference: Option<&'a Trajectory>,
    length_m: f64,
    measure: Measure,
    /// Largest distance from the reference, m.
    distance_m: Option<f64>,
    /// Largest distance of the reference from its start, m.
    reference_travel_m: f64,
    out_of_range: bool,
}

impl Comparison<'_> {
    fn look(&mut self, simulation: &Simulation) {
        let seen = simulation.observation();
        self.out_of_range |= seen.out_of_range.is_some();
        let Some(reference) = self.reference else { return };
        if let (Some(start), Some(there), Some(here)) =
            (reference.points.first(), reference.at(simulation.time_s()), points(seen))
        {
            self.reference_travel_m = self.reference_travel_m.max(distance_m(&there, start));
            let distance_m = distance_m(&here, &there);
            self.distance_m = Some(self.distance_m.map_or(distance_m, |before| before.max(distance_m)));
        }
    }

    /// The largest distance, relative to the cell's [`Measure`].
    fn error(&self) -> Option<f64> {
        let whole_m = match self.measure {
            Measure::Length => self.length_m,
            Measure::Travel => self.reference_travel_m.clamp(LEAST_TRAVEL * self.length_m, self.length_m),
        };
        self.distance_m.map(|distance_m| distance_m / whole_m)
    }
}

/// The energy balance's error over the energy accounted for; `None` where there never was any.
fn unbalanced(ledger: &EnergyLedger, accounted_j: f64) -> Option<f64> {
    (accounted_j > 0.0).then(|| ledger.balance_error_j.abs() / accounted_j)
}

fn all_finite(simulation: &Simulation) -> bool {
    let ledger = simulation.ledger();
    let works = [ledger.work_in_j, ledger.dissipated_j, ledger.balance_error_j];
    simulation.observation().is_finite() && works.iter().all(|work| work.is_finite())
}

/// A divergence is clean if its report and the last good state are finite.
fn ended(diverged: Diverged, error: Option<f64>, simulation: &Simulation) -> Outcome {
    let message = diverged.to_string();
    let said = !["NaN", "inf"].iter().any(|word| message.contains(word));
    let category = if said && all_finite(simulation) { Category::Diverged } else { Category::NotFinite };
    Outcome {
        category,
        error,
        step: diverged.step,
        sim_time_s: diverged.sim_time_s,
        energy_j: Some(diverged.energy_j),
        verdict: Some(simulation.energy_verdict()),
        cause: Some(diverged.cause),
        message,
        label: None,
        growth: None,
    }
}

fn reached(simulation: &Simulation, error: Option<f64>) -> Outcome {
    Outcome {
        category: Category::Stable,
        error,
        step: simulation.step_count(),
        sim_time_s: simulation.time_s(),
        energy_j: Some(simulation.observation().energy.moving_j()),
        verdict: Some(simulation.energy_verdict()),
        cause: None,
        message: String::new(),
        label: None,
        growth: None,
    }
}
