//! A run as a table: what a scene's mechanism does over time.

use super::Table;
use crate::mechanics::Observation;
use crate::scene::{Scene, System};
use crate::simulation::{BuildError, Diverged, Simulation};

/// A run that failed.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    /// The model cannot compute the scene.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The simulation stopped.
    #[error(transparent)]
    Diverged(#[from] Diverged),
}

type Value = (String, Box<dyn Fn(&Observation) -> Option<f64>>);

/// Runs a scene until `until_s`; one row a step, the start first.
///
/// Columns: `time_s`; `driving_torque_nm`, its mean over the step that ends there, or under a prescribed motion its value there; then
/// for every link (`crank`, `rod`, `beam`) `…_angle_rad` and `…_rate_rad_per_s` of its chord, and `…_start_…` and `…_end_…` of its
/// ends: `x_m`, `y_m`, `vx_m_per_s`, `vy_m_per_s`, and the tangent's `rotation_rad`. An oscillator has, for every mass from 1:
/// `mass1_x_m`, `mass1_vx_m_per_s` and `mass1_exact_x_m`, the exact solution. Values unknown to the model are NaN.
///
/// # Errors
/// [`HistoryError`] when the scene cannot be computed, or not to the end.
pub fn history(scene: &Scene, until_s: f64) -> Result<Table, HistoryError> {
    let mut simulation = Simulation::new(scene)?;
    let values: Vec<Value> = match &scene.system {
        System::Chain(chain) => (0..).zip(&chain.links).flat_map(|(place, link)| of_link(place, link.name.as_str())).collect(),
        System::Oscillator(oscillator) => (0..oscillator.masses_kg.len()).flat_map(of_mass).collect(),
    };
    let steps = (until_s / simulation.step_s()).round().max(0.0) as u64;
    let mut times = Vec::new();
    let mut torques = Vec::new();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); values.len()];
    for step in 0..=steps {
        if step > 0 {
            simulation.step()?;
        }
        times.push(simulation.time_s());
        let delivered = simulation.take_mean_torque_nm();
        let seen = simulation.observe()?;
        torques.push(seen.motion_torque_nm.unwrap_or(delivered));
        for (column, (_, value)) in columns.iter_mut().zip(&values) {
            column.push(value(seen).unwrap_or(f64::NAN));
        }
    }
    let mut table = Table::default();
    table.push("time_s", times);
    table.push("driving_torque_nm", torques);
    values.into_iter().zip(columns).for_each(|((name, _), values)| table.push(name, values));
    Ok(table)
}

fn of_link(link: usize, name: &str) -> Vec<Value> {
    let mut values: Vec<Value> = vec![
        (format!("{name}_angle_rad"), Box::new(move |seen| Some(seen.links.get(link)?.chord_rad))),
        (format!("{name}_rate_rad_per_s"), Box::new(move |seen| Some(seen.links.get(link)?.rate_rad_per_s))),
    ];
    for (end, last) in [("start", false), ("end", true)] {
        let node = move |seen: &Observation| {
            let nodes = &seen.links.get(link)?.nodes;
            if last { nodes.last().copied() } else { nodes.first().copied() }
        };
        values.push((format!("{name}_{end}_x_m"), Box::new(move |seen| Some(node(seen)?.position_m[0]))));
        values.push((format!("{name}_{end}_y_m"), Box::new(move |seen| Some(node(seen)?.position_m[1]))));
        values.push((format!("{name}_{end}_vx_m_per_s"), Box::new(move |seen| Some(node(seen)?.velocity_m_per_s[0]))));
        values.push((format!("{name}_{end}_vy_m_per_s"), Box::new(move |seen| Some(node(seen)?.velocity_m_per_s[1]))));
        values.push((format!("{name}_{end}_rotation_rad"), Box::new(move |seen| node(seen)?.rotation_rad)));
    }
    values
}

fn of_mass(place: usize) -> Vec<Value> {
    let name = format!("mass{}", place + 1);
    vec![
        (format!("{name}_x_m"), Box::new(move |seen| Some(seen.links.first()?.nodes.get(place)?.position_m[0]))),
        (format!("{name}_vx_m_per_s"), Box::new(move |seen| Some(seen.links.first()?.nodes.get(place)?.velocity_m_per_s[0]))),
        (format!("{name}_exact_x_m"), Box::new(move |seen| seen.links.first()?.exact_x_m.get(place).copied())),
    ]
}
