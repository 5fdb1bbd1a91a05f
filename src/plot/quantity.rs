//! Column names read as people write quantities: `piston_acceleration_m_per_s2` is a piston acceleration in m/s².

use super::figure::Axis;

/// Units as they end names, and as they are written.
const UNITS: [&str; 15] = ["m", "m2", "s", "s2", "kg", "n", "nm", "j", "rad", "deg", "pa", "hz", "ns", "us", "w"];
const SIGNS: [&str; 15] = ["m", "m²", "s", "s²", "kg", "N", "N·m", "J", "rad", "°", "Pa", "Hz", "ns", "µs", "W"];
/// Divisors of dimensionless values.
const DIVISORS: [(&str, &str); 6] =
    [("l2", "l₂"), ("l1", "l₁"), ("m3", "m₃"), ("omega", "ω"), ("omega2", "ω²"), ("squared", "²")];

/// Label and unit that a column's name gives.
pub fn axis(column: &str) -> Axis {
    if let Some((stem, divisor)) = dimensionless(column) {
        return Axis::new(format!("{} / {divisor}", words(stem)), "");
    }
    let (stem, unit) = split(column);
    Axis::new(words(stem), unit)
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

/// `n_s_per_m` as `N·s/m`.
fn written(suffix: &str) -> Option<String> {
    let mut parts = suffix.split("per_");
    let product = |part: &str| {
        let sign = |token: &str| UNITS.iter().position(|name| *name == token).map(|place| SIGNS[place]);
        let signs: Option<Vec<&str>> = part.trim_end_matches('_').split('_').map(sign).collect();
        signs.map(|signs| signs.join("·"))
    };
    let above = product(parts.next()?)?;
    match (parts.next(), parts.next()) {
        (None, _) => Some(above),
        (Some(below), None) => Some(format!("{above}/{}", product(below)?)),
        _ => None,
    }
}
