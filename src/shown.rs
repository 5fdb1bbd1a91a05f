//! Numbers, and texts from outside, as they are shown to people.

use std::fmt;

/// Rounds simulated time for display: n·h, which is published to the last bit, may be 1.5010000000000001.
pub(crate) fn shown_s(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
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
