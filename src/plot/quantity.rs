//! Column names read as people write quantities: `piston_acceleration_m_per_s2` is a piston acceleration in m/s².

use super::figure::Axis;

/// Units as they end names, and as they are written.
const UNITS: [&str; 14] = ["m", "m2", "s", "s2", "kg", "n", "nm", "j", "rad", "pa", "hz", "ns", "us", "w"];
const SIGNS: [&str; 14] = ["m", "m²", "s", "s²", "kg", "N", "N·m", "J", "rad", "Pa", "Hz", "ns", "µs", "W"];
/// Divisors of dimensionless values.
const DIVISORS: [(&str, &str); 6] =
    [("l2", "l₂"), ("l1", "l₁"), ("m3", "m₃"), ("omega", "ω"), ("omega2", "ω²"), ("squared", "²")];

/// Label and unit that a column's name gives.
pub(super) fn axis(column: &str) -> Axis {
    if let Some((stem, divisor)) = dimensionless(column) {
        return Axis::new(format!("{} / {divisor}", words(stem)), "");
    }
    let (stem, unit) = split(column);
    Axis::new(words(stem), unit)
}

fn words(stem: &str) -> String {
    let stem = ["links.", "joints."].iter().find_map(|list| stem.strip_prefix(list)).unwrap_or(stem);
    stem.replace(['_', '.'], " ")
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
