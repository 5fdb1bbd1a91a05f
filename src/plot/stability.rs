//! Maps of where the numbers break.

use super::figure::{Axis, Figure, Mark, Scale};
use super::heat_map::{HeatMap, Key};
use super::output::Picture;
use crate::study::Table;
use crate::study::stability::{self, Category, Spacing, Swept, grid};

/// The categories of a swept map over its axes.
pub fn swept(swept: &Swept) -> HeatMap {
    let [(x, xs), (y, ys)] = [&swept.map.x, &swept.map.y].map(axis);
    let names = Category::ALL.map(|category| category.as_str().to_owned()).to_vec();
    let title = swept.map.title.clone();
    HeatMap { title, x, y, xs, ys, values: grid(swept), key: Key::Categories(names) }
}

/// An axis of a map, and where its cells are along it.
fn axis(axis: &stability::Axis) -> (Axis, Vec<f64>) {
    let mut drawn = Axis::new(axis.of.words, axis.of.unit);
    let mut places = axis.values.clone();
    match axis.spacing {
        Spacing::Log => drawn.scale = Scale::Log,
        Spacing::Linear => {}
        Spacing::Listed => {
            drawn.names = places.iter().map(|place| axis.shown(*place)).collect();
            places = (0..places.len()).map(|place| place as f64).collect();
        }
    }
    (drawn, places)
}

/// The spectral radii as run on the left half-plane over |z|, and upwards the direction of z; where the scheme has a parameter,
/// the parameter, and the largest radius of all directions. With the name of its file.
pub fn left_half_plane(name: &str, radii: &Table) -> (String, Box<dyn Picture>) {
    let column = |name| radii.column(name).unwrap_or_default();
    let (magnitudes, run) = (column("magnitude"), column("radius_as_run"));
    let (y, places) = match radii.column("parameter") {
        Some(parameters) => (Axis::new(parameter(name), ""), parameters),
        None => (Axis::new("direction of z", "°"), column("angle_deg")),
    };
    let (xs, ys) = (distinct(magnitudes), distinct(places));
    let mut values = vec![vec![0.0_f64; xs.len()]; ys.len()];
    let place = |among: &[f64], value: f64| among.partition_point(|other| *other < value);
    for ((magnitude, at), radius) in magnitudes.iter().zip(places).zip(run) {
        let cell = values.get_mut(place(&ys, *at)).and_then(|row| row.get_mut(place(&xs, *magnitude)));
        cell.into_iter().for_each(|cell| *cell = cell.max(*radius));
    }
    let title = format!("{name}: spectral radius on the left half-plane");
    let key = Key::Quantity(Axis::log("spectral radius", ""));
    let map = HeatMap { title, x: Axis::log("|z|", ""), y, xs, ys, values, key };
    (format!("left-half-plane-{name}"), Box::new(map))
}

fn parameter(name: &str) -> &'static str {
    if name == "two-point" { "weight ϑ" } else { "ρ∞" }
}

/// The spectral radii of a scheme's table over ωh: maps over its parameter, one of theory and one as run; curves of both where it
/// has none. The order over the parameter, too. Each with the name of its file.
pub fn scheme(name: &str, radii: &Table, orders: &Table) -> Vec<(String, Box<dyn Picture>)> {
    let column = |name| radii.column(name).unwrap_or_default();
    let (omegas, theory, run) = (column("omega_h"), column("radius_in_theory"), column("radius_as_run"));
    let words = ["in theory", "as run"];
    let Some(parameters) = radii.column("parameter") else {
        let title = format!("{name}: spectral radius");
        let figure = Figure::new(title, Axis::log("ωh", ""), Axis::log("spectral radius", ""));
        let figure = figure.line(words[0], omegas, theory).series(words[1], omegas, run, Mark::Dashes);
        return vec![(format!("spectral-radius-{name}"), Box::new(figure))];
    };
    let parameter = parameter(name);
    let ys = distinct(parameters);
    let xs = distinct(&omegas[..omegas.len() / ys.len().max(1)]);
    let map = |word: &str, radii: &[f64]| {
        let mut rows: Vec<(f64, Vec<f64>)> =
            parameters.chunks(xs.len()).zip(radii.chunks(xs.len())).map(|(at, row)| (at[0], row.to_vec())).collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let title = format!("{name}: spectral radius {word}");
        let (x, y) = (Axis::log("ωh", ""), Axis::new(parameter, ""));
        let values = rows.into_iter().map(|(_, row)| row).collect();
        let key = Key::Quantity(Axis::log("spectral radius", ""));
        let map = HeatMap { title, x, y, xs: xs.clone(), ys: ys.clone(), values, key };
        (format!("spectral-radius-{name}-{}", word.replace(' ', "-")), Box::new(map) as Box<dyn Picture>)
    };
    vec![map(words[0], theory), map(words[1], run), order(name, parameter, orders)]
}

fn order(name: &str, parameter: &str, orders: &Table) -> (String, Box<dyn Picture>) {
    let column = |name| orders.column(name).unwrap_or_default();
    let mut rows: Vec<[f64; 3]> = (0..orders.rows())
        .map(|row| {
            ["parameter", "order_in_theory", "order_as_run"].map(|name| column(name).get(row).copied().unwrap_or(f64::NAN))
        })
        .collect();
    rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let [at, theory, run] = [0, 1, 2].map(|k| rows.iter().map(|row| row[k]).collect::<Vec<f64>>());
    let figure = Figure::new(format!("{name}: order"), Axis::new(parameter, ""), Axis::new("order", ""));
    let figure = figure.line("in theory", &at, &theory).series("as run", &at, &run, Mark::Points);
    (format!("order-{name}"), Box::new(figure))
}

/// Ascending, each once.
fn distinct(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}
