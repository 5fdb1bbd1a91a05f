//! A scene run beside the rows of a reference file.

use std::path::Path;

use flexcrank::mechanics::{LinkObservation, Observation};
use flexcrank::scene::{Scene, SceneSource};
use flexcrank::simulation::Simulation;

/// The models, as overrides.
pub const RIGID: &str = "solver.model=rigid";
pub const MODAL: &str = "solver.model=modal";
pub const FINITE: &str = "solver.model=finite-element";
/// The implicit midpoint rule.
pub const MIDPOINT: [&str; 2] = ["solver.integrator=two-point", "solver.weight=0.5"];

/// A built-in scene, or one given as TOML, with overrides.
pub fn scene(name_or_text: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|&o| o.to_owned()).collect();
    let source = if name_or_text.contains('\n') {
        SceneSource::parse("test", name_or_text, &overrides)
    } else {
        SceneSource::open(name_or_text, &overrides)
    };
    source.unwrap_or_else(|error| panic!("{error}")).scene
}

/// The same, ready to run.
pub fn simulation(name_or_text: &str, overrides: &[&str]) -> Simulation {
    start(&scene(name_or_text, overrides))
}

/// A scene, ready to run.
pub fn start(scene: &Scene) -> Simulation {
    Simulation::new(scene).unwrap_or_else(|error| panic!("{error}"))
}

/// Steps to the step nearest to a time.
pub fn run_to(simulation: &mut Simulation, time_s: f64) {
    let half_step = 0.5 * simulation.step_s();
    while simulation.time_s() < time_s - half_step {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// The present state.
pub fn look(simulation: &mut Simulation) -> &Observation {
    simulation.observe().unwrap_or_else(|error| panic!("{error}"))
}

/// Mechanical energy as last observed, J.
pub fn energy_j(seen: &Observation) -> f64 {
    seen.energy.kinetic_j + seen.energy.strain_j.unwrap_or(0.0) + seen.energy.potential_j.unwrap_or(0.0)
}

/// The largest of numbers' magnitudes; NaN if any is.
pub fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().fold(0.0, |most, x| if x.abs() <= most { most } else { x.abs() })
}

/// Rows of a reference file, without its header.
pub fn rows(file: &str) -> Vec<Vec<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(file);
    csv::Reader::from_path(path).unwrap().deserialize().map(|row| row.unwrap()).collect()
}

/// A quantity of the model and the column of the file that it is compared with.
pub type Column = (usize, fn(&Observation) -> f64);

/// Runs to each row's time and returns the largest difference in each column.
pub fn worst<const N: usize>(simulation: &mut Simulation, rows: &[Vec<f64>], columns: [Column; N]) -> [f64; N] {
    let mut worst = [0.0_f64; N];
    for row in rows {
        run_to(simulation, row[0]);
        assert!((simulation.time_s() - row[0]).abs() < 1e-9, "rows must fall on steps: {} for {}", simulation.time_s(), row[0]);
        let seen = look(simulation);
        for (worst, (column, of)) in worst.iter_mut().zip(columns) {
            *worst = worst.max((of(seen) - row[column]).abs());
        }
    }
    worst
}

/// Chord angle of the first link.
pub fn chord(seen: &Observation) -> f64 {
    seen.links[0].chord_rad
}

/// Position of the slider.
pub fn slider(seen: &Observation) -> f64 {
    seen.links[1].nodes.last().unwrap().position_m[0]
}

/// Deflection at the middle of a link with an even number of elements.
pub fn middle(link: &LinkObservation) -> f64 {
    link.nodes[link.nodes.len() / 2].deflection_m.unwrap()
}

/// Deflection at the middle of the rod.
pub fn rod_middle(seen: &Observation) -> f64 {
    middle(&seen.links[1])
}

/// The number that a variable of the environment asks for, in place of the usual one: `tests/heavy/models` asks for more.
pub fn asked(variable: &str, usual: f64) -> f64 {
    std::env::var(variable).map_or(usual, |text| text.parse().unwrap_or_else(|error| panic!("{variable}={text}: {error}")))
}
