//! A scene run beside the rows of a reference file.

use std::path::Path;

use flexcrank::mechanics::{LinkObservation, Observation};
use flexcrank::scene::SceneSource;
use flexcrank::simulation::Simulation;

/// A built-in scene with overrides, ready to run.
pub fn simulation(scene: &str, overrides: &[&str]) -> Simulation {
    let overrides: Vec<String> = overrides.iter().map(|&o| o.to_owned()).collect();
    let source = SceneSource::open(scene, &overrides).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(&source.scene).unwrap_or_else(|error| panic!("{error}"))
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
        let half_step = 0.5 * simulation.step_s();
        while simulation.time_s() < row[0] - half_step {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        assert!((simulation.time_s() - row[0]).abs() < 1e-9, "rows must fall on steps: {} for {}", simulation.time_s(), row[0]);
        let seen = simulation.observe().unwrap_or_else(|error| panic!("{error}"));
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
