//! Numbers as they are shown to people.

/// Rounds simulated time for display: n·h, which is published to the last bit, may be 1.5010000000000001.
pub(crate) fn shown_s(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}
