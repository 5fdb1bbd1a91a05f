//! Column names read as people write quantities: `piston_acceleration_m_per_s2` is a piston acceleration in m/s².

use super::figure::Axis;

/// Units as they end names, and as they are written.
const UNITS: [&str; 17] = ["m", "m2", "m3", "m4", "s", "s2", "kg", "n", "nm", "j", "rad", "deg", "pa", "hz", "ns", "us", "w"];
const SIGNS: [&str; 17] = ["m", "m²", "m³", "m⁴", "s", "s²", "kg", "N", "N·m", "J", "rad", "°", "Pa", "Hz", "ns", "µs", "W"];
/// Divisors of dimensionless values.
const DIVISORS: [(&str, &str); 6] =
    [("l2", "l₂"), ("l1", "l₁"), ("m3", "m₃"), ("omega", "ω"), ("omega2", "ω²"), ("squared", "²")];
/// Counts and times of each second: the end of the name, the words, and the unit.
const PER_SECOND: [(&str, &str, &str); 2] =
    [("steps_per_s", "steps per second", ""), ("seconds_per_simulated_s", "computing time per simulated second", "s/s")];
/// Names with this beginning end in the unit of a quantity, though its relative error has none.
const RELATIVE: &str = "relative_error_";

/// Label and unit that a column's name gives.
pub fn axis(column: &str) -> Axis {
    if let Some((stem, divisor)) = dimensionless(column) {
        return Axis::new(format!("{} / {divisor}", words(stem)), "");
    }
    if let Some(axis) = per_second(column).or_else(|| quotient(column)) {
        return axis;
    }
    let (stem, unit) = split(column);
    Axis::new(words(stem), if column.starts_with(RELATIVE) { String::new() } else { unit })
}

/// `slowest_seconds_per_simulated_s` as slowest computing time per simulated second, in s/s.
fn per_second(column: &str) -> Option<Axis> {
    PER_SECOND.into_iter().find_map(|(name, label, unit)| {
        let before = column.strip_suffix(name)?;
        (before.is_empty() || before.ends_with('_')).then(|| Axis::new(before.replace('_', " ") + label, unit))
    })
}

/// A quantity divided by another: `rod_deflection_m_per_torque_nm` as rod deflection per torque, in m per N·m.
fn quotient(column: &str) -> Option<Axis> {
    let (above, below) = column.rsplit_once("_per_").filter(|(_, below)| written(below).is_none())?;
    let [(above, unit), (below, of)] = [above, below].map(split);
    let have_units = !unit.is_empty() && !of.is_empty();
    have_units.then(|| Axis::new(format!("{} per {}", words(above), words(below)), format!("{unit} per {of}")))
}

/// Fields of messages whose names say less than their comments do.
const FIELDS: [(&str, &str); 19] = [
    ("chord", "chord angle"),
    ("dx", "displacement along x"),
    ("dy", "displacement along y"),
    ("vx", "velocity along x"),
    ("vy", "velocity along y"),
    ("fx", "force along x"),
    ("fy", "force along y"),
    ("axial", "axial force"),
    ("shear", "shear force"),
    ("moment_start", "bending moment at the start"),
    ("moment_end", "bending moment at the end"),
    ("kinetic", "kinetic energy"),
    ("strain", "strain energy"),
    ("potential", "potential energy"),
    ("work_in", "net energy put in"),
    ("dissipated", "dissipated energy"),
    ("changed", "energy of changes"),
    ("balance_error", "error of the energy balance"),
    ("real_time_factor", "real-time factor"),
];

fn words(stem: &str) -> String {
    let field = |name: &str| {
        FIELDS.iter().find(|(known, _)| *known == name).map_or_else(|| name.replace('_', " "), |(_, words)| (*words).to_owned())
    };
    match stem.split('.').collect::<Vec<&str>>().as_slice() {
        [list @ ("nodes" | "elements"), link, place, name] if place.contains('/') => {
            format!("{}: {}", place_words(list, link, place), field(name))
        }
        ["links" | "joints", of, name] => format!("{of} {}", field(name)),
        ["nodes", link, index, name] => format!("{link} node {index} {}", field(name)),
        ["elements", link, index, name] => format!("{link} element {index} {}", field(name)),
        [name] => field(name),
        parts => parts.join(" ").replace('_', " "),
    }
}

/// The place of a node, or an element of a mesh, in words: `1/2` as `rod at 1/2 length`, or `rod element 1 of 2`.
pub(super) fn place_words(list: &str, link: &str, place: &str) -> String {
    match (list, place) {
        ("elements", place) => format!("{link} element {}", place.replace('/', " of ")),
        (_, "0/1") => format!("{link} at its start"),
        (_, "1/1") => format!("{link} at its end"),
        (_, place) => format!("{link} at {place} length"),
    }
}

/// Columns in words, as a title: at most three.
pub fn title(columns: &[&str]) -> String {
    let mut labels: Vec<String> = columns.iter().map(|column| axis(column).label).collect();
    if labels.len() > 3 {
        let more = format!("{} more", labels.len() - 2);
        labels.splice(2.., [more]);
    }
    let title = labels.join(", ");
    let mut letters = title.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn dimensionless(column: &str) -> Option<(&str, String)> {
    let (stem, divisor) = column.split_once("_over_")?;
    let mut factors: Vec<String> = Vec::new();
    for token in divisor.split('_') {
        let sign = DIVISORS.iter().find(|(name, _)| *name == token)?.1;
        match factors.last_mut().filter(|_| token == "squared") {
            Some(last) => last.push_str(sign),
            None => factors.push(sign.to_owned()),
        }
    }
    let together = factors.join(" ");
    Some((stem, if factors.len() > 1 { format!("({together})") } else { together }))
}

/// The longest ending that is a unit, with something before it.
fn split(column: &str) -> (&str, String) {
    let mut best = (column, String::new());
    for (place, _) in column.match_indices('_').collect::<Vec<_>>().into_iter().rev() {
        match written(&column[place + 1..]) {
            Some(unit) if place > 0 => best = (&column[..place], unit),
            _ if column[place + 1..].starts_with("per_") => {}
            _ => break,
        }
    }
    best
}

/// `n_s_per_m` as `N·s/m`, and `per_s` as `1/s`.
fn written(suffix: &str) -> Option<String> {
    let mut parts = suffix.split("per_");
    let product = |part: &str| {
        let sign = |token: &str| UNITS.iter().position(|name| *name == token).map(|place| SIGNS[place]);
        let signs: Option<Vec<&str>> = part.trim_end_matches('_').split('_').map(sign).collect();
        signs.map(|signs| signs.join("·"))
    };
    match (parts.next()?, parts.next(), parts.next()) {
        (above, None, _) => product(above),
        ("", Some(below), None) => Some(format!("1/{}", product(below)?)),
        (above, Some(below), None) => Some(format!("{}/{}", product(above)?, product(below)?)),
        _ => None,
    }
}
