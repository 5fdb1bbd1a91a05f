//! One run of one configuration, sampled and timed.

use std::time::Instant;

use hdrhistogram::Histogram;
use rustix::time::{ClockId, clock_gettime};

use super::configuration::Configuration;
use super::effort::RunEffort;
use super::grid::Grid;
use super::output_group::{Probe, Sample};
use crate::scene::Scene;
use crate::simulation::{BuildError, Diverged, EnergyLedger, EnergyVerdict, Simulation};

/// Why there is no run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Failed {
    /// The model cannot compute the scene.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// It diverged.
    #[error(transparent)]
    Diverged(#[from] Diverged),
    /// The histogram of single steps could not be set up.
    #[error("{0}")]
    Histogram(#[from] hdrhistogram::CreationError),
}

/// The reproducible results of a run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Run {
    pub samples: Vec<Sample>,
    pub effort: RunEffort,
    /// See [`Balance::error`].
    pub energy_error: f64,
    /// The run's own estimate of its error in the first link's chord angle, rad.
    pub estimated_angle_rad: Option<f64>,
    pub out_of_range: bool,
    /// Whether it kept its energy balance, or is not judged by that.
    pub balance_kept: bool,
}

/// Computing time of a configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Seconds of computing per simulated second: median of the repeats.
    pub seconds_per_s: f64,
    /// Seconds of computing per simulated second: quickest repeat.
    pub quickest_per_s: f64,
    /// Seconds of computing per simulated second: slowest repeat.
    pub slowest_per_s: f64,
    /// Repeats.
    pub repeats: usize,
    /// 99.9th percentile of single steps, s.
    pub step_p999_s: f64,
    /// Worst single step, s.
    pub step_worst_s: f64,
}

/// Repeats take about this long together, s.
const REPEATS_S: f64 = 0.5;
const REPEATS_MAX: f64 = 9.0;

/// Runs once, sampled at the instants after t = 0; returns the seconds that the steps took, too.
///
/// At t = 0 the state is given, and links are not bent yet by the loads that act there: joint forces grow without limit as the mesh
/// gets finer.
pub(super) fn run(configuration: &Configuration, scene: &Scene, grid: &Grid) -> Result<(Run, f64), Failed> {
    let scene = configuration.scene(scene);
    let mut simulation = Simulation::new(&scene)?;
    let steps = grid.steps(configuration.step_s);
    let probe = scene.chain().map(Probe::new);
    let mut effort = RunEffort::default();
    let (mut samples, mut seconds, mut out_of_range) = (Vec::with_capacity(grid.count), 0.0, false);
    let mut balance = Balance::default();
    for instant in 0..=grid.count {
        if instant > 0 {
            let begin_s = thread_s();
            for _ in 0..steps {
                simulation.step()?;
                effort.residuals += u64::from(simulation.effort().residuals);
                effort.newton_iterations += u64::from(simulation.effort().newton_iterations);
                effort.factorizations += u64::from(simulation.effort().factorizations);
            }
            seconds += thread_s() - begin_s;
        }
        let seen = simulation.observe()?;
        out_of_range |= seen.out_of_range.is_some();
        samples.extend(probe.as_ref().filter(|_| instant > 0).map(|probe| probe.sample(seen)));
        balance.see(&simulation.ledger());
    }
    effort.steps = simulation.step_count();
    effort.retried = simulation.retried();
    let estimated_angle_rad = simulation.error_estimate().map(|error| error.angle_rad());
    let energy_error = balance.error();
    let balance_kept = !matches!(simulation.energy_verdict(), EnergyVerdict::Unbalanced { .. });
    Ok((Run { samples, effort, energy_error, estimated_angle_rad, out_of_range, balance_kept }, seconds))
}

/// The energy balance of a run.
#[derive(Debug, Clone, Copy, Default)]
struct Balance {
    worst_j: f64,
    most_j: f64,
}

impl Balance {
    fn see(&mut self, ledger: &EnergyLedger) {
        self.worst_j = self.worst_j.max(ledger.balance_error_j.abs());
        self.most_j = self.most_j.max(ledger.energy.moving_j());
    }

    /// Largest error of the balance at any instant over the most kinetic and strain energy at any.
    fn error(&self) -> f64 {
        if self.most_j > 0.0 { self.worst_j / self.most_j } else { 0.0 }
    }
}

/// The error of the energy balance, see [`Balance::error`], in a run of at least `until_s`.
pub(super) fn energy_error(configuration: &Configuration, scene: &Scene, grid: &Grid, until_s: f64) -> Result<f64, Failed> {
    let mut simulation = Simulation::new(&configuration.scene(scene))?;
    let mut balance = Balance::default();
    while simulation.time_s() < until_s {
        for _ in 0..grid.steps(configuration.step_s) {
            simulation.step()?;
        }
        simulation.observe()?;
        balance.see(&simulation.ledger());
    }
    Ok(balance.error())
}

/// Times a configuration that ran before in `first_s`: whole runs, and one with every step timed.
pub(super) fn time(configuration: &Configuration, scene: &Scene, grid: &Grid, first_s: f64) -> Result<Timing, Failed> {
    let scene = configuration.scene(scene);
    let mut simulation = Simulation::new(&scene)?;
    let total = grid.steps(configuration.step_s) * grid.count as u64;
    let mut seconds = vec![first_s];
    let repeats = (REPEATS_S / first_s).clamp(1.0, REPEATS_MAX) as usize;
    for _ in 1..repeats {
        simulation.reset()?;
        let begin_s = thread_s();
        for _ in 0..total {
            simulation.step()?;
        }
        seconds.push(thread_s() - begin_s);
    }
    simulation.reset()?;
    let mut single = Histogram::new_with_bounds(1, 3_600_000_000_000, 3)?;
    seconds.push(single_steps(&mut simulation, total, &mut single)?);
    seconds.sort_by(f64::total_cmp);
    let per_s = |seconds: f64| seconds / grid.until_s();
    Ok(Timing {
        seconds_per_s: per_s(seconds[(seconds.len() - 1) / 2]),
        quickest_per_s: per_s(seconds[0]),
        slowest_per_s: per_s(seconds[seconds.len() - 1]),
        repeats: seconds.len(),
        step_p999_s: 1e-9 * single.value_at_quantile(0.999) as f64,
        step_worst_s: 1e-9 * single.max() as f64,
    })
}

/// Records the nanoseconds of every step; returns the seconds of them all.
fn single_steps(simulation: &mut Simulation, total: u64, histogram: &mut Histogram<u64>) -> Result<f64, Diverged> {
    let begin_s = thread_s();
    let mut last = Instant::now();
    for _ in 0..total {
        simulation.step()?;
        let now = Instant::now();
        histogram.saturating_record((now - last).as_nanos() as u64);
        last = now;
    }
    Ok(thread_s() - begin_s)
}

/// Seconds that this thread has computed: another program that takes its processor does not count.
fn thread_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}
