//! Chapter 4: one turn of the rigid crank-slider, dimensionless, for several crank-to-rod ratios.

use super::{axis, entry};
use crate::plot::rows::runs;
use crate::plot::{Axis, Entry, Figure};
use crate::study::Table;

const SECTION: &str = "Chapter 4: the rigid crank-slider, over one turn at constant speed";
const X: &str = "crank_angle_rad";

/// Number, title, column, sentence.
type OverAngle = (&'static str, &'static str, &'static str, &'static str);

const OVER_ANGLE: [OverAngle; 15] = [
    ("4.3", "Rod angle", "rod_angle_rad", "The rod swings by asin λ to either side, most at a right-angled crank."),
    (
        "4.6",
        "Rod rate",
        "rod_rate_over_omega",
        "The rod turns fastest at the dead centres, and stands still at a right-angled crank.",
    ),
    (
        "4.9",
        "Rod acceleration",
        "rod_acceleration_over_omega2",
        "The rod's angular acceleration is least and greatest where its angle is.",
    ),
    ("4.11", "Piston position", "piston_position_over_l2", "The piston travels twice the crank's length, from 1 − λ to 1 + λ."),
    (
        "4.14",
        "Piston velocity",
        "piston_velocity_over_l2_omega",
        "The piston is fastest when the crank is short of a right angle to the outer dead centre, the more so the larger λ is.",
    ),
    (
        "4.17",
        "Piston acceleration",
        "piston_acceleration_over_l2_omega2",
        "The piston's acceleration is largest at the outer dead centre: −λ (1 + λ). Its other extreme is at the inner one, but for large λ on either side of it.",
    ),
    (
        "4.30",
        "Centre of mass, x",
        "centre_of_mass_x_over_l2",
        "The centre of mass of crank, rod and piston moves along x with the piston.",
    ),
    ("4.31", "Centre of mass, y", "centre_of_mass_y_over_l2", "Across, only the rod and the crank move it: a pure sine."),
    (
        "4.36",
        "Velocity of the centre of mass, x",
        "centre_of_mass_velocity_x_over_l2_omega",
        "Its velocity along x has the piston's asymmetry.",
    ),
    (
        "4.37",
        "Velocity of the centre of mass, y",
        "centre_of_mass_velocity_y_over_l2_omega",
        "Its velocity along y is a pure cosine.",
    ),
    (
        "4.42",
        "Acceleration of the centre of mass, x",
        "centre_of_mass_acceleration_x_over_l2_omega2",
        "Times the total mass, this is the shaking force along x, with its sign changed.",
    ),
    (
        "4.43",
        "Acceleration of the centre of mass, y",
        "centre_of_mass_acceleration_y_over_l2_omega2",
        "Across, the shaking force is a pure sine.",
    ),
    (
        "4.54",
        "Force at O along x",
        "force_o_x_over_m3_l2_omega2",
        "Force of the ground on the crank: everything that moves has to be accelerated.",
    ),
    (
        "4.53",
        "Force at A along x",
        "force_a_x_over_m3_l2_omega2",
        "Force of the crank on the rod: rod and piston have to be accelerated.",
    ),
    (
        "4.52",
        "Force at E along x",
        "force_e_x_over_m3_l2_omega2",
        "Force of the rod on the piston: the piston's acceleration, as there is no resistance.",
    ),
];

pub(super) fn figures(table: &Table) -> Vec<Entry> {
    let over = |list: &[OverAngle]| list.iter().map(|entry| over_angle(table, entry)).collect::<Vec<_>>();
    let mut figures = over(&OVER_ANGLE[..8]);
    figures.push(path(
        table,
        (
            "4.30, 4.31",
            "Path of the centre of mass",
            "The centre of mass goes round a closed curve, the longer along x the larger λ is.",
        ),
        ["centre_of_mass_x_over_l2", "centre_of_mass_y_over_l2"],
        ["x / l₂", "y / l₂"],
    ));
    figures.extend(over(&OVER_ANGLE[8..10]));
    figures.push(path(
        table,
        ("4.36, 4.37", "Hodograph of the centre of mass", "The tip of the centre's velocity, drawn from the origin."),
        ["centre_of_mass_velocity_x_over_l2_omega", "centre_of_mass_velocity_y_over_l2_omega"],
        ["velocity along x / (l₂ ω)", "velocity along y / (l₂ ω)"],
    ));
    figures.extend(over(&OVER_ANGLE[10..]));
    figures
}

fn over_angle(table: &Table, (number, title, column, sentence): &OverAngle) -> Entry {
    let figure = Figure::new(*title, Axis::angle("crank angle θ"), axis(title, column));
    entry(SECTION, number, sentence, by_ratio(table, figure, [X, column]))
}

fn path(
    table: &Table,
    (number, title, sentence): (&'static str, &'static str, &'static str),
    columns: [&str; 2],
    labels: [&str; 2],
) -> Entry {
    let [x, y] = labels.map(|label| Axis::new(label, ""));
    let figure = by_ratio(table, Figure { equal_aspect: true, ..Figure::new(title, x, y) }, columns);
    entry(SECTION, number, sentence, figure)
}

fn by_ratio(table: &Table, figure: Figure, columns: [&str; 2]) -> Figure {
    let [xs, ys] = columns.map(|column| table.column(column).unwrap_or_default());
    // The thesis counts the rod's angle clockwise.
    let sign = if columns[1].starts_with("rod_") { -1.0 } else { 1.0 };
    let ys: Vec<f64> = ys.iter().map(|y| sign * y).collect();
    let ratios = runs(table.column("ratio").unwrap_or_default());
    ratios.into_iter().fold(figure, |figure, (ratio, rows)| {
        let part = |values: &[f64]| values.get(rows.clone()).unwrap_or_default().to_vec();
        figure.line(format!("λ = {ratio}"), &part(xs), &part(&ys))
    })
}
