//! The standard figures of a recording, from the columns of its topics.

use super::band;
use super::figure::{Axis, Figure, Mark};
use super::quantity::place_words;
use super::selection::Named;
use super::session_time::{self, broken_at_resets};
use crate::study::Table;

/// Fewer rows than this are drawn as points: a line would pretend to know what is between, as between the seconds of a status.
const FEW: usize = 40;
/// The part of a recording that shows the deflections of its links.
pub const DEFLECTIONS: &str = "deflections";

/// The default figures of a recording, each with the name of its part of the recording; quantities that the model does not compute are omitted.
///
/// Curves are broken at resets; see [`add_session_time`](super::add_session_time()).
pub fn recorded(topics: &[Named]) -> Vec<(String, Figure)> {
    let topic = |name: &str| find_topic(topics, name).map(|topic| &topic.table);
    let mut figures = Vec::new();
    if let Some(table) = topic("angles") {
        let angle = |field: &str| in_list(table, "links", field);
        figures.push(over_time("angles", "Chord angles", table, Axis::new("chord angle", "rad"), angle("chord_rad")));
        figures.push(over_time("rates", "Chord rates", table, Axis::new("chord rate", "rad/s"), angle("rate_rad_per_s")));
        let axis = Axis::new("chord acceleration", "rad/s²");
        figures.push(over_time("accelerations", "Chord accelerations", table, axis, angle("acceleration_rad_per_s2")));
    }
    if let Some(table) = topic("displacements") {
        figures.extend(ends(table, has_slider(topics)));
        let axis = Axis::new("deflection", "m");
        figures.push(over_time(DEFLECTIONS, "Deflections from the chord", table, axis, deflections(table)));
    }
    if let Some(table) = topic("loads") {
        let torque = table.column("driving_torque_nm").map(|values| (String::new(), values)).into_iter().collect();
        figures.push(over_time("torque", "Driving torque", table, Axis::new("driving torque", "N·m"), torque));
        for (file, field, along) in [("forces-x", "fx_n", "x"), ("forces-y", "fy_n", "y")] {
            let title = format!("Joint forces along {along}, on the part after the joint");
            figures.push(over_time(file, &title, table, Axis::new("force", "N"), in_list(table, "joints", field)));
        }
    }
    // Recordings of earlier versions have energies in `status` only.
    if let Some(table) = topic("energies").or_else(|| topic("status")) {
        let kinds = [
            ("kinetic", "kinetic_j"),
            ("strain", "strain_j"),
            ("potential", "potential_j"),
            ("net supplied", "work_in_j"),
            ("dissipated", "dissipated_j"),
        ];
        let energy = |(kind, column): (&str, &str)| Some((kind.to_owned(), table.column(column)?));
        let energies = kinds.into_iter().filter_map(energy).collect();
        figures.push(over_time("energies", "Energies", table, Axis::new("energy", "J"), energies));
    }
    figures.retain(|(_, figure)| figure.panels.iter().any(|panel| !panel.series.is_empty()));
    figures
}

/// Shades figures over the time of a recording where the run was below its best level of detail: `best`, the first of the scene, or
/// else the one with the smallest stated error.
pub fn shade_levels(figures: &mut [(String, Figure)], topics: &[Named], best: Option<&str>) {
    let bands = find_topic(topics, "angles").map(|angles| band::levels(angles, times(&angles.table), best)).unwrap_or_default();
    for (_, figure) in figures.iter_mut().filter(|(_, figure)| figure.x.unit == "s") {
        figure.bands.clone_from(&bands);
    }
}

/// The topic of a recording whose name ends with this part.
pub(super) fn find_topic<'a>(topics: &'a [Named], name: &str) -> Option<&'a Named> {
    topics.iter().find(|topic| topic.name.rsplit('/').next() == Some(name))
}

/// Whether a recorded chain has a slider: its loads have the slider's resistance. Without loads, a slider is taken for granted.
pub(super) fn has_slider(topics: &[Named]) -> bool {
    find_topic(topics, "loads").is_none_or(|loads| loads.table.column("resistance_n").is_some())
}

/// Times of the rows, s.
fn times(table: &Table) -> &[f64] {
    session_time::times(table).unwrap_or_default()
}

fn over_time(file: &str, title: &str, table: &Table, y: Axis, curves: Vec<(String, &[f64])>) -> (String, Figure) {
    let times = times(table);
    // An exact solution lies on what was computed.
    let mark = |label: &str| match times.len() {
        0..FEW => Mark::Points,
        _ if label.ends_with("exact") => Mark::Dashes,
        _ => Mark::Line,
    };
    let known = |values: &[f64]| values.iter().any(|value| value.is_finite());
    let mut figure = Figure { signals: true, ..Figure::new(title, session_time::axis_of(table), y) };
    for (label, values) in curves.into_iter().filter(|(_, values)| known(values)) {
        let mark = mark(&label);
        let (xs, ys) = broken_at_resets(table, times, values);
        figure = figure.series(label, &xs, &ys, mark);
    }
    (file.to_owned(), figure)
}

/// The columns `LIST.<entry>.FIELD`, each under its entry's name.
fn in_list<'a>(table: &'a Table, list: &str, field: &str) -> Vec<(String, &'a [f64])> {
    let entry = |name: &str| Some(name.strip_prefix(list)?.strip_prefix('.')?.strip_suffix(field)?.strip_suffix('.')?.to_owned());
    table.columns().filter_map(|(name, values)| Some((entry(name)?.replace('-', " "), values))).collect()
}

/// Name of the last node of a link, as in `nodes.crank.4`.
fn last_node(table: &Table, link: &str) -> Option<String> {
    let index =
        |name: &str| name.strip_prefix("nodes.")?.strip_prefix(link)?.strip_prefix('.')?.strip_suffix(".x_m")?.parse().ok();
    let last: Option<u32> = table.columns().filter_map(|(name, _)| index(name)).max();
    last.map(|index| format!("nodes.{link}.{index}"))
}

/// Motion of the slider, of free ends and of masses, and the paths of the crank pin and of free ends.
fn ends(table: &Table, has_slider: bool) -> Vec<(String, Figure)> {
    let mut figures = Vec::new();
    let column = |node: &str, field: &str| table.column(&format!("{node}.{field}")).unwrap_or_default();
    let both = |node: &str, x: &str, y: &str| vec![("x".to_owned(), column(node, x)), ("y".to_owned(), column(node, y))];
    let (slider, free_end) = if has_slider { (last_node(table, "rod"), None) } else { (None, last_node(table, "rod")) };
    if let Some(slider) = slider {
        let x = vec![(String::new(), column(&slider, "x_m"))];
        figures.push(over_time("slider-position", "Slider position", table, Axis::new("x of the slider", "m"), x));
        let v = vec![(String::new(), column(&slider, "vx_m_per_s"))];
        figures.push(over_time("slider-velocity", "Slider velocity", table, Axis::new("velocity of the slider", "m/s"), v));
    }
    if let Some(end) = &free_end {
        let (position, velocity) = (both(end, "x_m", "y_m"), both(end, "vx_m_per_s", "vy_m_per_s"));
        figures.push(over_time("end-position", "Position of the rod's end", table, Axis::new("position", "m"), position));
        figures.push(over_time("end-velocity", "Velocity of the rod's end", table, Axis::new("velocity", "m/s"), velocity));
    }
    let masses = |field: &str, suffix: &str| -> Vec<(String, &[f64])> {
        // Nodes are counted from 0, masses in scenes from 1.
        let number = |place: String| place.parse::<usize>().map_or(place, |place| (place + 1).to_string());
        let named = |(place, values): (String, _)| (format!("mass {}{suffix}", number(place)), values);
        in_list(table, "nodes.mass", field).into_iter().map(named).collect()
    };
    let mut positions = masses("x_m", "");
    positions.extend(masses("exact_x_m", ", exact"));
    figures.push(over_time("masses", "Displacements of the masses", table, Axis::new("displacement", "m"), positions));
    let velocities = masses("vx_m_per_s", "");
    figures.push(over_time("mass-velocities", "Velocities of the masses", table, Axis::new("velocity", "m/s"), velocities));
    if let Some(end) = last_node(table, "beam") {
        let xy = both(&end, "dx_m", "dy_m");
        figures.push(over_time("end", "Displacement of the beam's end", table, Axis::new("displacement", "m"), xy));
    }
    for (file, title, node) in [
        ("path", "Path of the crank pin", last_node(table, "crank")),
        ("end-path", "Path of the rod's end", free_end),
        ("path", "Path of the beam's end", last_node(table, "beam")),
    ] {
        if let Some(node) = node {
            let path = Figure { equal_aspect: true, ..Figure::new(title, Axis::new("x", "m"), Axis::new("y", "m")) };
            let (xs, ys) = broken_at_resets(table, column(&node, "x_m"), column(&node, "y_m"));
            figures.push((file.to_owned(), path.line("", &xs, &ys)));
        }
    }
    figures
}

/// Deflections of every flexible link where it bends most, or at the places that were chosen for several recordings.
fn deflections(table: &Table) -> Vec<(String, &[f64])> {
    let chosen = in_list(table, "nodes", "deflection_m").into_iter().filter_map(|(entry, values)| {
        let (link, place) = entry.split_once('.').filter(|(_, place)| place.contains('/'))?;
        Some((format!("{}:", place_words("nodes", link, place)), values))
    });
    let chosen: Vec<(String, &[f64])> = chosen.collect();
    if !chosen.is_empty() {
        return chosen;
    }
    let size =
        |values: &[f64]| values.iter().filter(|value| value.is_finite()).fold(0.0_f64, |most, value| most.max(value.abs()));
    let mut most: Vec<(String, &[f64])> = Vec::new();
    for (entry, values) in in_list(table, "nodes", "deflection_m") {
        let Some((link, _)) = entry.split_once('.').filter(|_| size(values) > 0.0) else { continue };
        match most.iter_mut().find(|(other, _)| other == link) {
            Some(best) if size(best.1) >= size(values) => {}
            Some(best) => best.1 = values,
            None => most.push((link.to_owned(), values)),
        }
    }
    most
}
