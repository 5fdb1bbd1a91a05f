//! One run: a scene to its end, and the scalars that are left of it.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::scalars::{Instant, Place, Scalars};
use crate::integrate::Effort;
use crate::scene::{Scene, SceneError, SceneSource};
use crate::shown::figure;
use crate::simulation::{BuildError, Diverged, EnergyVerdict, Simulation};
use crate::study::panic_message::panic_message;

/// The end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ending {
    /// Ran to its end.
    Done,
    /// The simulation declared divergence.
    Diverged,
    /// Refused by the check of the scene, by the model, or by the limit of steps.
    Refused,
    /// The program panicked.
    Panicked,
}

impl Ending {
    /// All endings.
    pub const ALL: [Ending; 4] = [Ending::Done, Ending::Diverged, Ending::Refused, Ending::Panicked];

    /// Word for tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Ending::Done => "done",
            Ending::Diverged => "diverged",
            Ending::Refused => "refused",
            Ending::Panicked => "panicked",
        }
    }
}

/// The verdict on an energy balance that left its tolerance.
pub(super) const UNBALANCED: &str = "unbalanced";

/// Whether a row of a campaign's table, by its columns `ending` and `verdict`, is of a run that ended well and can be trusted.
pub fn is_trusted_row(ending: &str, verdict: &str) -> bool {
    ending == Ending::Done.as_str() && verdict != UNBALANCED
}

/// The outcome of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The end.
    pub ending: Ending,
    /// Why it did not run to its end; empty if it did.
    pub cause: String,
    /// Verdict on the energy balance; empty for a run that did not begin.
    pub verdict: &'static str,
    /// Scalars in the order of the table's columns; `None` where the model does not know it.
    pub numbers: Vec<Option<f64>>,
}

impl Outcome {
    /// Whether it ran to its end, and is to be trusted.
    pub fn ended_well(&self) -> bool {
        self.ending == Ending::Done && self.verdict != UNBALANCED
    }

    /// Whether it ran to its end, but is not to be trusted: its energy balance was off.
    pub fn is_untrusted(&self) -> bool {
        self.ending == Ending::Done && self.verdict == UNBALANCED
    }

    /// A scalar of the run as a whole; NaN if it is not known.
    pub(super) fn of_whole_run(&self, name: &str) -> f64 {
        let place = WHOLE_RUN.iter().position(|known| *known == name);
        place.and_then(|place| self.numbers.get(place).copied().flatten()).unwrap_or(f64::NAN)
    }
}

/// Scalars of the run as a whole, which stand before those read at every step.
pub(super) const WHOLE_RUN: [&str; 12] = [
    "steps",
    "diverged_step",
    "sim_time_s",
    "retried",
    "newton_iterations",
    "residuals",
    "factorizations",
    "final_energy_j",
    "work_in_j",
    "dissipated_j",
    "worst_balance_j",
    "in_play_j",
];
/// Names before this place are whole numbers, except `sim_time_s`.
const COUNTS: usize = 7;

/// A column of numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Name with unit.
    pub name: String,
    /// Whether it holds whole numbers.
    pub is_count: bool,
}

/// The numbers that runs of a scene leave.
pub(super) fn columns(scene: &Scene) -> Vec<Column> {
    let counts = WHOLE_RUN.iter().enumerate().map(|(place, name)| (place < COUNTS && *name != "sim_time_s", (*name).to_owned()));
    let read = Scalars::new(scene).names().into_iter().map(|name| (false, name));
    counts.chain(read).map(|(is_count, name)| Column { name, is_count }).collect()
}

/// Limits of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limits {
    /// Simulated time from which scalars are taken.
    pub from_s: f64,
    pub until_s: f64,
    pub max_steps: u64,
}

/// Why a run has no proper end.
enum Failed {
    Refused(String),
    Stopped,
}

impl From<SceneError> for Failed {
    fn from(error: SceneError) -> Self {
        Failed::Refused(error.to_string())
    }
}

impl From<BuildError> for Failed {
    fn from(error: BuildError) -> Self {
        Failed::Refused(error.to_string())
    }
}

/// Runs a scene; `None` if `stop` asked for an end before. A refusal, a divergence and a panic are outcomes like any other.
pub(super) fn run(
    source: impl FnOnce() -> Result<SceneSource, SceneError>,
    limits: Limits,
    columns: usize,
    stop: &dyn Fn() -> bool,
) -> Option<Outcome> {
    let failed = |ending, cause| Outcome { ending, cause, verdict: "", numbers: vec![None; columns] };
    match catch_unwind(AssertUnwindSafe(|| {
        source().map_err(Failed::from).and_then(|source| simulate(&source.scene, limits, stop))
    })) {
        Ok(Ok(outcome)) if outcome.numbers.len() == columns => Some(outcome),
        Ok(Ok(_)) => Some(failed(Ending::Refused, "has other links or joints than other runs of the campaign".to_owned())),
        Ok(Err(Failed::Refused(cause))) => Some(failed(Ending::Refused, cause)),
        Ok(Err(Failed::Stopped)) => None,
        Err(panic) => Some(failed(Ending::Panicked, panic_message(panic))),
    }
}

fn simulate(scene: &Scene, limits: Limits, stop: &dyn Fn() -> bool) -> Result<Outcome, Failed> {
    let mut simulation = Simulation::new(scene)?;
    let (until_s, step_s) = (limits.until_s, simulation.step_s());
    // As `run --until` does.
    if until_s < step_s * (1.0 - 1e-6) {
        let why = format!("until_s = {until_s}: the run would last {until_s} s, less than one step of {step_s} s");
        return Err(Failed::Refused(why));
    }
    // The last step ends at `until_s` or after it; quotients such as 22.8/0.1 may round up.
    let steps = (until_s / step_s - 1e-6).ceil().max(1.0);
    if steps > limits.max_steps as f64 {
        let step_s = figure(step_s);
        return Err(Failed::Refused(format!("needs {steps} steps of {step_s} s, more than max_steps = {}", limits.max_steps)));
    }
    let last_s = (steps - 1.0) * step_s;
    if last_s < limits.from_s - 1e-6 * step_s {
        let why = format!("from_s = {}: the last step, of {step_s} s, begins at {} s", limits.from_s, figure(last_s));
        return Err(Failed::Refused(why));
    }
    let mut read = Reading { scalars: Scalars::new(scene), from_s: limits.from_s - 1e-6 * step_s, before_s: None };
    let torque_nm = simulation.take_mean_torque_nm();
    read.at(simulation.time_s(), &Instant { torque_nm, seen: simulation.observation() });
    let mut cost = Cost::default();
    let mut diverged = None;
    while (simulation.step_count() as f64) < steps && diverged.is_none() {
        if stop() {
            return Err(Failed::Stopped);
        }
        diverged = step(&mut simulation, &mut read, &mut cost).err();
    }
    Ok(outcome(&simulation, &read.scalars, &cost, diverged))
}

/// The scalars of the steps that begin at a time or later.
struct Reading {
    scalars: Scalars,
    from_s: f64,
    /// Time of the instant before.
    before_s: Option<f64>,
}

impl Reading {
    fn at(&mut self, time_s: f64, now: &Instant) {
        let place = match self.before_s.replace(time_s) {
            None if time_s >= self.from_s => Place::Start,
            Some(before_s) if before_s >= self.from_s => Place::After,
            _ => Place::Before,
        };
        self.scalars.read(now, place);
    }
}

fn step(simulation: &mut Simulation, read: &mut Reading, cost: &mut Cost) -> Result<(), Diverged> {
    simulation.step()?;
    cost.add(simulation.effort());
    let (time_s, torque_nm) = (simulation.time_s(), simulation.take_mean_torque_nm());
    read.at(time_s, &Instant { seen: simulation.observe()?, torque_nm });
    Ok(())
}

/// Work of the solver over a run.
#[derive(Debug, Clone, Copy, Default)]
struct Cost {
    newton_iterations: u64,
    residuals: u64,
    factorizations: u64,
}

impl Cost {
    fn add(&mut self, effort: Effort) {
        self.newton_iterations += u64::from(effort.newton_iterations);
        self.residuals += u64::from(effort.residuals);
        self.factorizations += u64::from(effort.factorizations);
    }
}

fn outcome(simulation: &Simulation, scalars: &Scalars, cost: &Cost, diverged: Option<Diverged>) -> Outcome {
    let ledger = simulation.ledger();
    let count = |count: u64| Some(count as f64);
    let whole_run: [Option<f64>; WHOLE_RUN.len()] = [
        count(simulation.step_count()),
        diverged.as_ref().and_then(|diverged| count(diverged.step)),
        Some(simulation.time_s()),
        count(simulation.retried()),
        count(cost.newton_iterations),
        count(cost.residuals),
        count(cost.factorizations),
        Some(ledger.energy.total_j()),
        Some(ledger.work_in_j),
        Some(ledger.dissipated_j),
        Some(ledger.worst_balance_j),
        Some(ledger.in_play_j),
    ];
    let verdict = match simulation.energy_verdict() {
        EnergyVerdict::Balanced => "balanced",
        EnergyVerdict::Unbalanced { .. } => UNBALANCED,
        EnergyVerdict::NotJudged => "not judged",
    };
    Outcome {
        ending: if diverged.is_some() { Ending::Diverged } else { Ending::Done },
        cause: diverged.map(|diverged| diverged.cause.to_string()).unwrap_or_default(),
        verdict,
        numbers: whole_run.into_iter().chain(scalars.values()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run_of(overrides: &[&str], max_steps: u64) -> Outcome {
        let overrides: Vec<String> = overrides.iter().map(|change| (*change).to_owned()).collect();
        let base = SceneSource::open("thesis-crank-slider", &[]).unwrap();
        let columns = columns(&base.scene).len();
        let limits = Limits { from_s: 0.0, until_s: 22.8, max_steps };
        run(|| SceneSource::parse("test", &base.text, &overrides), limits, columns, &|| false).unwrap()
    }

    /// A step of 1.7 s was a row of 1.7 s, and `run --until 1` is refused.
    #[test]
    fn regress_a_run_shorter_than_its_step_is_refused_as_run_does() {
        let run_with = |step_s: f64, until_s: f64| {
            let base = SceneSource::open("thesis-oscillator", &[]).unwrap();
            let (columns, limits) = (columns(&base.scene).len(), Limits { from_s: 0.0, until_s, max_steps: 1000 });
            let change = format!("solver.step_s={step_s}");
            run(|| SceneSource::parse("test", &base.text, &[change]), limits, columns, &|| false).unwrap()
        };
        let refused = run_with(1.7, 1.0);
        let why = "until_s = 1: the run would last 1 s, less than one step of 1.7 s";
        assert_eq!((refused.ending, refused.cause.as_str()), (Ending::Refused, why));
        // One step is enough, also where its length is rounded; a last step may end after `until_s`.
        for (step_s, until_s, steps) in [(0.1, 0.1, 1.0), (0.1, 0.1 - 1e-12, 1.0), (0.3, 1.0, 4.0)] {
            assert_eq!(run_with(step_s, until_s).numbers[0], Some(steps), "{until_s} s in steps of {step_s} s");
        }
    }

    /// The rate of a half-cosine ramp from 0 to Ω over T is Ω/2 on average: over 2 T, the mean is 3 Ω/4; from T on, it is Ω.
    #[test]
    fn val_scalars_from_a_time_on_are_those_of_the_steady_motion() {
        let links = "[crank]\nlength_m = 0.1\nmass_kg = 0.1\n[rod]\nlength_m = 0.3\nmass_kg = 0.2\n[slider]\nmass_kg = 0.3\n";
        let solver = "[drive]\nramp = { to_rad_per_s = 10.0, over_s = 0.5 }\n[solver]\nmodel = \"rigid\"\nstep_s = 1e-3\n";
        let ramped = || SceneSource::parse("ramped.toml", &format!("{links}{solver}"), &[]);
        let columns = columns(&ramped().unwrap().scene);
        let mean_from = |from_s: f64| {
            let limits = Limits { from_s, until_s: 1.0, max_steps: 10_000 };
            let ended = run(ramped, limits, columns.len(), &|| false).unwrap();
            let mean = columns.iter().position(|column| column.name == "crank_mean_rate_rad_per_s").unwrap();
            (ended.ending, ended.numbers[mean].unwrap())
        };
        let (whole, steady) = (mean_from(0.0), mean_from(0.5));
        assert!(whole.0 == Ending::Done && (whole.1 - 7.5).abs() < 0.01, "{whole:?}");
        assert!(steady.0 == Ending::Done && (steady.1 - 10.0).abs() < 1e-9, "{steady:?}");
        let late = run(ramped, Limits { from_s: 0.9995, until_s: 1.0, max_steps: 10_000 }, columns.len(), &|| false).unwrap();
        assert_eq!(
            (late.ending, late.cause.as_str()),
            (Ending::Refused, "from_s = 0.9995: the last step, of 0.001 s, begins at 0.999 s")
        );
    }

    /// The slider m of a massless rod of length l, on a crank r at a steady rate Ω, is at x = r cos θ + √(l² − r² sin² θ), and presses on
    /// its guide by m x″ tan φ with l sin φ = r sin θ: over a turn 0 on average, but not its magnitude.
    #[test]
    fn val_the_mean_force_of_the_guide_is_that_of_its_magnitude() {
        let links = "[crank]\nlength_m = 0.1\nmass_kg = 0.1\n[rod]\nlength_m = 0.3\nmass_kg = 0.0\n[slider]\nmass_kg = 0.5\n";
        let solver = "[drive]\nspeed_rad_per_s = 6.283185307179586\n[solver]\nmodel = \"rigid\"\nstep_s = 1e-3\n";
        let turning = || SceneSource::parse("turning.toml", &format!("{links}{solver}"), &[]);
        let columns = columns(&turning().unwrap().scene);
        let ended = run(turning, Limits { from_s: 0.0, until_s: 1.0, max_steps: 10_000 }, columns.len(), &|| false).unwrap();
        let mean_n = ended.numbers[columns.iter().position(|column| column.name == "guide_mean_force_n").unwrap()].unwrap();
        let x_m = |turn: f64| {
            let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
            0.1 * cos + (0.09 - 0.01 * sin * sin).sqrt()
        };
        let force_n = |turn: f64| {
            let acceleration = (x_m(turn + 1e-3) - 2.0 * x_m(turn) + x_m(turn - 1e-3)) / 1e-6;
            let sin_rod = (std::f64::consts::TAU * turn).sin() / 3.0;
            0.5 * acceleration * sin_rod / (1.0 - sin_rod * sin_rod).sqrt()
        };
        let by_hand_n = (0..1000).map(|step| force_n(1e-3 * f64::from(step)).abs()).sum::<f64>() / 1000.0;
        assert!((mean_n / by_hand_n - 1.0).abs() < 1e-4, "{mean_n} {by_hand_n}");
    }

    /// The torque of a pulse that ends at `from_s` was a peak of what follows.
    #[test]
    fn regress_a_pulse_that_ends_there_is_no_peak_of_what_follows() {
        let pulse = ["pulse.0.start_s=0.1", "pulse.0.duration_s=0.1", "solver.model=rigid", "solver.step_s=0.01"];
        let pulse = pulse.map(str::to_owned);
        let pushed = || SceneSource::open("crank-slider", &pulse);
        let columns = columns(&pushed().unwrap().scene);
        let limits = Limits { from_s: 0.2, until_s: 0.5, max_steps: 10_000 };
        let ended = run(pushed, limits, columns.len(), &|| false).unwrap();
        let scalar = |name: &str| ended.numbers[columns.iter().position(|column| column.name == name).unwrap()];
        assert_eq!((scalar("driving_peak_torque_nm"), scalar("driving_mean_torque_nm")), (Some(0.0), Some(0.0)));
        assert!(scalar("crank_peak_moment_nm") < Some(1.0), "{:?}", scalar("crank_peak_moment_nm"));
    }

    /// Motion before `from_s` counts for `peak_out_of_range`, and for no other scalar.
    #[test]
    fn prop_nothing_before_is_read_but_how_far_a_link_bends() {
        let strip = "[beam]\nlength_m = 0.5\nelements = 4\ndensity_kg_per_m3 = 7850.0\nyoungs_modulus_pa = 2.1e11\n";
        let struck = "area_m2 = 1e-5\nsecond_moment_m4 = 8.3e-13\n[[pulse]]\nstart_s = 0.0\nduration_s = 0.02\ntorque_nm = 0.5\n";
        let solver = "[solver]\nmodel = \"modal\"\nstep_s = 1e-4\n";
        let bent = || SceneSource::parse("bent.toml", &format!("{strip}{struck}{solver}"), &[]);
        let columns = columns(&bent().unwrap().scene);
        let scalar = |from_s: f64, name: &str| {
            let limits = Limits { from_s, until_s: 0.2, max_steps: 10_000 };
            let ended = run(bent, limits, columns.len(), &|| false).unwrap();
            assert_eq!(ended.ending, Ending::Done, "{}", ended.cause);
            ended.numbers[columns.iter().position(|column| column.name == name).unwrap()]
        };
        assert!(scalar(0.0, "peak_out_of_range") > Some(0.0));
        assert_eq!(scalar(0.0, "peak_out_of_range"), scalar(0.19, "peak_out_of_range"));
        assert_eq!(scalar(0.0, "final_energy_j"), scalar(0.19, "final_energy_j"));
        assert!(scalar(0.0, "peak_strain_j") > scalar(0.19, "peak_strain_j"));
    }

    #[test]
    fn prop_every_end_is_an_outcome_with_its_cause() {
        let done = run_of(&["solver.model=rigid"], 1000);
        assert_eq!((done.ending, done.cause.as_str(), done.numbers[0], done.numbers[1]), (Ending::Done, "", Some(228.0), None));
        // The thesis's weight below one half diverges in step 88.
        let diverged = run_of(&["solver.weight=0.48"], 1000);
        assert_eq!((diverged.ending, diverged.numbers[0], diverged.numbers[1]), (Ending::Diverged, Some(87.0), Some(88.0)));
        assert!(
            diverged.cause.contains("energy") && diverged.numbers[2].is_some_and(|time_s| (time_s - 8.7).abs() < 1e-12),
            "{diverged:?}"
        );
        let refused = run_of(&["rod.length_m=-1"], 1000);
        assert!(refused.ending == Ending::Refused && refused.cause.contains("rod.length_m = -1"), "{refused:?}");
        let long = run_of(&[], 100);
        assert!(long.ending == Ending::Refused && long.cause.contains("max_steps = 100"), "{long:?}");
        let panicked =
            run(|| panic!("a fault of the program"), Limits { from_s: 0.0, until_s: 1.0, max_steps: 1 }, 3, &|| false).unwrap();
        assert_eq!((panicked.ending, panicked.cause.as_str()), (Ending::Panicked, "a fault of the program"));
        assert_eq!(
            run(|| SceneSource::open("crank-slider", &[]), Limits { from_s: 0.0, until_s: 1.0, max_steps: 1000 }, 3, &|| true),
            None
        );
    }
}
