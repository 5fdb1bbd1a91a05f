//! Damped scenes at every step: the motion is right, or the run warns that it is not.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

mod cases;
mod deflection;
mod draw;
mod estimate;
mod random;

use flexcrank::scene::SceneSource;
use flexcrank::simulation::{BuildError, Diverged, EnergyVerdict, Simulation};

/// Number of observations in a run.
pub const LOOKS: usize = 20;

/// A run to its end.
#[derive(Debug, Clone)]
pub struct Run {
    /// The crank's chord angle at each look, rad.
    pub angles_rad: [f64; LOOKS],
    /// Its error as the run itself estimated it at most, rad.
    pub estimate_rad: f64,
    /// The run's verdict on its energy balance.
    pub verdict: EnergyVerdict,
}

/// Why there is no run.
#[derive(Debug, Clone)]
pub enum End {
    /// The scene is refused.
    Refused(String),
    /// The run declared itself diverged.
    Diverged(Diverged),
}

impl From<BuildError> for End {
    fn from(error: BuildError) -> Self {
        End::Refused(error.to_string())
    }
}

impl From<Diverged> for End {
    fn from(diverged: Diverged) -> Self {
        End::Diverged(diverged)
    }
}

/// Runs a scene with `between` steps from one look to the next.
pub fn run(scene: &str, overrides: &[String], between: usize) -> Result<Run, End> {
    let source =
        if scene.contains('\n') { SceneSource::parse("random", scene, overrides) } else { SceneSource::open(scene, overrides) };
    let source = source.unwrap_or_else(|error| panic!("{error}\n{scene}{overrides:?}"));
    let mut simulation = Simulation::new(&source.scene)?;
    let (mut angles_rad, mut estimate_rad) = ([0.0; LOOKS], 0.0_f64);
    for angle in &mut angles_rad {
        for _ in 0..between {
            simulation.step()?;
        }
        *angle = simulation.observe()?.links[0].chord_rad;
        estimate_rad = estimate_rad.max(simulation.error_estimate().map_or(0.0, |estimate| estimate.angle_rad()));
    }
    Ok(Run { angles_rad, estimate_rad, verdict: simulation.energy_verdict() })
}

/// Largest difference of two runs' angles, rad.
pub fn apart_rad(one: &Run, other: &Run) -> f64 {
    one.angles_rad.iter().zip(&other.angles_rad).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
