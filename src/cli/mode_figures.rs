//! Figures of modes in words.

use super::aligned_table::figure;
use crate::small_motion::ModeReport;

pub(super) fn hertz(mode: &ModeReport) -> String {
    if mode.eigenvalue_per_s == [0.0; 2] { "0".to_owned() } else { figure(mode.frequency_hz) }
}

pub(super) fn percent(part: f64) -> String {
    format!("{:.0} %", 100.0 * part)
}

/// Part of an eigenvalue that is told if rounding may change as much.
const ROUNDED: f64 = 0.02;

/// A remark on a motion that is rounding in part, as of very many short elements.
pub(super) fn rounded(mode: &ModeReport) -> Option<String> {
    let (name, part) = (&mode.name, percent(mode.rounding));
    let advice = "fewer elements, or solver.model = \"modal\", round less";
    (mode.rounding > ROUNDED).then(|| format!("  {name}: rounding may change it by {part}: {advice}"))
}

/// Damping in per cent of the critical; of what does not vibrate, its rate.
pub(super) fn damping(mode: &ModeReport) -> String {
    match mode.eigenvalue_per_s {
        [0.0, 0.0] => "–".to_owned(),
        [rate, 0.0] => format!("e^({}t)", figure(rate)),
        // Eigenvalues are found to some 1e-9.
        _ if mode.damping_ratio.abs() < 1e-8 => "0 %".to_owned(),
        _ if mode.damping_ratio.abs() < 1e-4 => format!("{:.1e} %", 100.0 * mode.damping_ratio),
        _ => format!("{:.2} %", 100.0 * mode.damping_ratio),
    }
}
