//! Reference files and simulations to run beside them.

use std::path::Path;

use flexcrank::mechanics::NodeObservation;
use flexcrank::scene::SceneSource;
use flexcrank::simulation::Simulation;

pub type Outcome = Result<(), Box<dyn std::error::Error>>;

/// Rows of a reference file, without its header.
pub fn reference(file: &str) -> Result<Vec<Vec<f64>>, Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(file);
    let mut reader = csv::Reader::from_path(path)?;
    reader.deserialize().map(|row| Ok(row?)).collect()
}

pub fn simulation(scene: &str, overrides: &[&str]) -> Result<Simulation, Box<dyn std::error::Error>> {
    let overrides: Vec<String> = overrides.iter().map(|&o| o.to_owned()).collect();
    Ok(Simulation::new(&SceneSource::open(scene, &overrides)?.scene)?)
}

/// Rotation of a node.
pub fn turn(node: &NodeObservation) -> f64 {
    node.rotation_rad.unwrap_or(f64::NAN)
}
