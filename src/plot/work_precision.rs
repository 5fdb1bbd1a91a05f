//! Work–precision diagrams: error over cost, both logarithmic.

use super::figure::{Axis, Figure, Mark, Numbered, Scale};
use super::quantity;
use crate::study::Table;
use crate::study::trade::{ERROR_IS_BOUND, REFERENCE_ERROR, WELL_RESOLVED, front};

const COST: &str = "seconds_per_simulated_s";
const ERROR: &str = "error";
/// Markers of errors that the reference knows less well, as the legend explains them.
const EXPLAINED: [(Mark, &str); 2] =
    [(Mark::Triangles, "below the reference's own uncertainty"), (Mark::Rings, "reference not ten times better")];

/// A configuration in the diagram.
struct Point {
    model: String,
    lines: [String; 2],
    at: [f64; 2],
    mark: Mark,
}

/// The diagram of a table as `trade` writes it; `None` of any other table.
///
/// Every configuration is a point in the colour of its model. Those of the Pareto front are numbered, cheapest first. Errors
/// that are bounds, and those for which the reference is not ten times better, have hollow markers, and a line shows its
/// uncertainty; tables of earlier versions do not tell them apart. It has no title.
pub fn work_precision(table: &Table) -> Option<Figure> {
    let points = points(table)?;
    let cost = Axis { scale: Scale::Log, ..quantity::axis(COST) };
    let mut figure = Figure::new("", cost, Axis::log("relative error", ""));
    let mut models: Vec<&str> = Vec::new();
    for point in &points {
        if !models.contains(&point.model.as_str()) {
            models.push(&point.model);
        }
    }
    for model in &models {
        for mark in [Mark::Points, Mark::Rings, Mark::Triangles] {
            let own = || points.iter().filter(|point| point.model == *model && point.mark == mark).map(|point| point.at);
            let [costs, errors] = [0, 1].map(|axis| own().map(|at| at[axis]).collect::<Vec<_>>());
            // The legend shows a model by its dots, even if it has none.
            if mark == Mark::Points || !costs.is_empty() {
                figure = figure.series(*model, &costs, &errors, mark);
            }
        }
    }
    let is_there = |mark: Mark| points.iter().any(|point| point.mark == mark);
    figure.explained =
        EXPLAINED.iter().filter(|(mark, _)| is_there(*mark)).map(|(mark, label)| (*mark, (*label).to_owned())).collect();
    if !figure.explained.is_empty() {
        figure = with_uncertainty(figure, table, &points);
    }
    let on_front = front(&points.iter().map(|point| point.at).collect::<Vec<_>>());
    let best = points.iter().zip(on_front).filter(|(_, on_front)| *on_front);
    let series = |point: &Point| models.iter().position(|model| *model == point.model).unwrap_or_default();
    let numbered = |point: &Point| Numbered { at: point.at, series: series(point), mark: point.mark, lines: point.lines.clone() };
    figure.numbered = best.map(|(point, _)| numbered(point)).collect();
    figure.numbered.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
    Some(figure)
}

/// The figure with a line at the uncertainty of the reference, below which it knows no error.
fn with_uncertainty(figure: Figure, table: &Table, points: &[Point]) -> Figure {
    let uncertainty = table.column(REFERENCE_ERROR).unwrap_or_default().iter().copied().fold(0.0, f64::max);
    let costs = || points.iter().map(|point| point.at[0]);
    let ends = [costs().fold(f64::INFINITY, f64::min), costs().fold(0.0, f64::max)];
    figure.series("uncertainty of the reference", &ends, &[uncertainty; 2], Mark::Limit)
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
        let mark = marker(table, row, at[1]);
        at.iter().all(|value| *value > 0.0 && value.is_finite()).then_some(Point { model, lines, at, mark })
    };
    Some((0..table.rows()).filter_map(point).collect())
}

/// The marker of the error in a row: of a bound, of one for which the reference is not ten times better, or of any other.
fn marker(table: &Table, row: usize, error: f64) -> Mark {
    let cell = |name: &str| table.column(name).and_then(|column| column.get(row)).copied();
    if cell(ERROR_IS_BOUND).is_some_and(|is_bound| is_bound > 0.0) {
        Mark::Triangles
    } else if cell(REFERENCE_ERROR).is_some_and(|uncertainty| error < WELL_RESOLVED * uncertainty) {
        Mark::Rings
    } else {
        Mark::Points
    }
}

/// A step in ms or µs, without the last bits' digits.
fn shown_step(step_s: f64) -> String {
    let (factor, unit) = if step_s < 1e-3 { (1e6, "µs") } else { (1e3, "ms") };
    format!("{} {unit}", (step_s * factor * 1e3).round() / 1e3)
}
