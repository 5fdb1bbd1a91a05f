//! Work–precision diagrams: error over cost, both logarithmic.

use super::figure::{Axis, Figure, Mark, Numbered};
use crate::study::Table;
use crate::study::trade::{INTERRUPTED, front};

const COST: &str = "seconds_per_simulated_s";
const ERROR: &str = "error";

/// A configuration in the diagram.
struct Point {
    model: String,
    lines: [String; 2],
    at: [f64; 2],
}

/// The diagram of a table as `trade` writes it; `None` of any other table.
///
/// Every configuration is a point in the colour of its model. Those of the Pareto front are numbered, cheapest first. It has
/// a title only if the study was interrupted, so that the table is a part.
pub fn work_precision(table: &Table) -> Option<Figure> {
    let points = points(table)?;
    let title = if table.column(INTERRUPTED).is_some() { "interrupted study" } else { "" };
    let mut figure = Figure::new(title, Axis::log("computing time per simulated second", "s/s"), Axis::log("relative error", ""));
    let mut models: Vec<&str> = Vec::new();
    for point in &points {
        if !models.contains(&point.model.as_str()) {
            models.push(&point.model);
        }
    }
    for model in &models {
        let own = || points.iter().filter(|point| point.model == *model).map(|point| point.at);
        let [costs, errors] = [0, 1].map(|axis| own().map(|at| at[axis]).collect::<Vec<_>>());
        figure = figure.series(*model, &costs, &errors, Mark::Points);
    }
    let on_front = front(&points.iter().map(|point| point.at).collect::<Vec<_>>());
    let best = points.iter().zip(on_front).filter(|(_, on_front)| *on_front);
    let series = |point: &Point| models.iter().position(|model| *model == point.model).unwrap_or_default();
    figure.numbered =
        best.map(|(point, _)| Numbered { at: point.at, series: series(point), lines: point.lines.clone() }).collect();
    figure.numbered.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
    Some(figure)
}

fn points(table: &Table) -> Option<Vec<Point>> {
    let words = |name: &str| table.words(name);
    let (models, integrators, links) = (words("model")?, words("integrator")?, words("discretization")?);
    let (costs, errors, steps) = (table.column(COST)?, table.column(ERROR)?, table.column("step_s")?);
    let point = |row: usize| {
        let model = models.get(row)?.clone();
        let size = links.get(row).filter(|size| *size != "–").map(|size| format!("{size}, ")).unwrap_or_default();
        let lines = [format!("{model}, {}", integrators.get(row)?), format!("{size}step {}", shown_step(*steps.get(row)?))];
        let at = [*costs.get(row)?, *errors.get(row)?];
        at.iter().all(|value| *value > 0.0 && value.is_finite()).then_some(Point { model, lines, at })
    };
    Some((0..table.rows()).filter_map(point).collect())
}

/// A step in ms or µs, without the last bits' digits.
fn shown_step(step_s: f64) -> String {
    let (factor, unit) = if step_s < 1e-3 { (1e6, "µs") } else { (1e3, "ms") };
    format!("{} {unit}", (step_s * factor * 1e3).round() / 1e3)
}
