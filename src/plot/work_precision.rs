//! Work–precision diagrams: error over cost, both logarithmic.

use super::{Axis, Figure, Mark};
use crate::study::Table;
use crate::study::trade::front;

const COST: &str = "seconds_per_simulated_s";
const ERROR: &str = "error";

/// A configuration in the diagram.
struct Point {
    family: String,
    name: String,
    cost: f64,
    error: f64,
}

/// The diagram of a table as `trade` writes it; `None` of any other table.
///
/// A curve for every model and integrator, through its best meshes and steps; then the Pareto front of all, and the names of the
/// configurations on it.
pub fn work_precision(title: &str, table: &Table) -> Option<Figure> {
    let points = points(table)?;
    let mut figure = Figure::new(title, Axis::log("computing a simulated second", "s/s"), Axis::log("error", ""));
    let mut families: Vec<&str> = Vec::new();
    for point in &points {
        if !families.contains(&point.family.as_str()) {
            families.push(&point.family);
        }
    }
    for family in families {
        let own: Vec<&Point> = points.iter().filter(|point| point.family == family).collect();
        let [costs, errors] = columns(&best(&own));
        figure = figure.series(family, &costs, &errors, Mark::LineAndPoints);
    }
    let best = best(&points.iter().collect::<Vec<_>>());
    let [costs, errors] = columns(&best);
    figure = figure.series("front", &costs, &errors, Mark::LineAndPoints);
    Some(best.iter().fold(figure, |figure, point| figure.series(&point.name, &[point.cost], &[point.error], Mark::Points)))
}

fn points(table: &Table) -> Option<Vec<Point>> {
    let words = |name: &str| table.words(name);
    let (models, integrators, links) = (words("model")?, words("integrator")?, words("discretization")?);
    let (costs, errors, steps) = (table.column(COST)?, table.column(ERROR)?, table.column("step_s")?);
    let point = |row: usize| {
        let family = format!("{}, {}", models.get(row)?, integrators.get(row)?);
        let size = links.get(row).filter(|size| *size != "–").map(|size| format!(", {size}")).unwrap_or_default();
        let name = format!("{family}{size}, {:.2e} s", steps.get(row)?);
        let point = Point { family, name, cost: *costs.get(row)?, error: *errors.get(row)? };
        (point.cost > 0.0 && point.error > 0.0 && point.error.is_finite()).then_some(point)
    };
    Some((0..table.rows()).filter_map(point).collect())
}

/// The points of the front, cheapest first.
fn best<'a>(points: &[&'a Point]) -> Vec<&'a Point> {
    let on_front = front(&points.iter().map(|point| [point.cost, point.error]).collect::<Vec<_>>());
    let mut best: Vec<&Point> = points.iter().zip(on_front).filter(|(_, on_front)| *on_front).map(|(point, _)| *point).collect();
    best.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    best
}

fn columns(points: &[&Point]) -> [Vec<f64>; 2] {
    [points.iter().map(|point| point.cost).collect(), points.iter().map(|point| point.error).collect()]
}
