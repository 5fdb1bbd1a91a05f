//! Formatting of times and counts.

/// Rounds simulated time for display: n·h, which is published to the last bit, may be 1.5010000000000001.
pub(super) fn shown_s(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}

/// A count with its noun, singular or plural.
pub(super) fn counted(count: u64, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}
