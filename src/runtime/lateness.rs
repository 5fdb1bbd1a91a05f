//! How late things begin: steps, messages put back on the bus.

use std::time::Duration;

use hdrhistogram::Histogram;

/// Lateness against deadlines, kept to three digits from 1 ns to 1 h.
pub struct Lateness {
    nanoseconds: Histogram<u64>,
}

impl Lateness {
    /// Nothing recorded yet.
    ///
    /// # Errors
    /// When the histogram cannot be made.
    pub fn new() -> Result<Self, hdrhistogram::CreationError> {
        Ok(Lateness { nanoseconds: Histogram::new_with_bounds(1, 3_600_000_000_000, 3)? })
    }

    /// Counts one more.
    pub fn record(&mut self, late: Duration) {
        self.nanoseconds.saturating_record(u64::try_from(late.as_nanos()).unwrap_or(u64::MAX));
    }

    /// Quantiles 0.5, 0.99, 0.999 and the largest, s; `None` before the first.
    pub fn quantiles_s(&self) -> Option<[f64; 4]> {
        let at = |quantile: f64| self.nanoseconds.value_at_quantile(quantile) as f64 * 1e-9;
        (!self.nanoseconds.is_empty()).then(|| [at(0.5), at(0.99), at(0.999), self.nanoseconds.max() as f64 * 1e-9])
    }
}
