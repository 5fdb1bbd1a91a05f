//! Numbers, and texts from outside, as they are shown to people.

use std::fmt;

/// Rounds simulated time for display: n·h, which is published to the last bit, may be 1.5010000000000001.
pub(crate) fn shown_s(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}

/// Formats with six significant digits, and a power of ten only where needed.
pub(crate) fn figure(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e7).contains(&magnitude) {
        return format!("{value:.5e}");
    }
    let digits = (5 - magnitude.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// An energy, with six decimals or, below a millijoule, with three digits.
pub(crate) fn shown_j(energy_j: f64) -> String {
    if energy_j.abs() < 1e-3 && energy_j != 0.0 { format!("{energy_j:.2e}") } else { format!("{energy_j:.6}") }
}

/// Text from outside in a message: with control characters escaped, and cut after so many characters.
pub(crate) struct Shown<'a>(pub &'a str, pub usize);

/// Most characters of a name that are shown.
#[cfg(feature = "service")]
const NAME: usize = 200;

/// A name from a file or the bus: on one line, and not much of it.
#[cfg(feature = "service")]
pub(crate) fn shown_name(name: &str) -> Shown<'_> {
    Shown(name, NAME)
}

/// Names in a list.
#[cfg(feature = "service")]
pub(crate) fn shown_names(names: &[String]) -> String {
    let names: Vec<String> = names.iter().map(|name| shown_name(name).to_string()).collect();
    names.join(", ")
}

/// A sentence that contains names from outside.
#[cfg(feature = "service")]
pub(crate) fn shown_sentence(text: &str) -> Shown<'_> {
    Shown(text, 5 * NAME)
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Shown(text, most) = self;
        for c in text.chars().take(*most) {
            if c.is_control() { write!(f, "{}", c.escape_default())? } else { write!(f, "{c}")? }
        }
        match text.chars().nth(*most) {
            Some(_) => write!(f, "… ({} characters)", text.chars().count()),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::figure;

    #[test]
    fn val_figures_have_six_digits() {
        for (value, text) in [
            (0.0, "0"),
            (-0.25, "-0.25"),
            (157.07963267948966, "157.08"),
            (1234567.0, "1234567"),
            (1e-13, "1.00000e-13"),
            (0.00123456789, "0.00123457"),
        ] {
            assert_eq!(figure(value), text);
        }
    }
}
