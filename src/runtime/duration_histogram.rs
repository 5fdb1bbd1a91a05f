//! Histograms of durations: the lateness of steps and of replayed messages, the cost of steps.

use std::time::Duration;

use hdrhistogram::Histogram;

use crate::wire;

/// Longer durations are counted as this one, ns.
const LONGEST_NS: u64 = 100_000_000_000;

/// Quantiles of a [`DurationHistogram`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DurationQuantiles {
    /// Median, s.
    pub p50_s: f64,
    /// Quantile 0.99, s.
    pub p99_s: f64,
    /// Quantile 0.999, s.
    pub p999_s: f64,
    /// Longest duration, s.
    pub max_s: f64,
}

/// A histogram of durations with a resolution of two digits, from 1 ns to 100 s.
pub struct DurationHistogram {
    nanoseconds: Histogram<u64>,
}

impl DurationHistogram {
    /// Creates an empty histogram.
    ///
    /// # Errors
    /// Fails if the histogram cannot be allocated.
    pub fn new() -> Result<Self, hdrhistogram::CreationError> {
        Ok(DurationHistogram { nanoseconds: Histogram::new_with_bounds(1, LONGEST_NS, 2)? })
    }

    /// Adds a duration.
    pub fn record(&mut self, duration: Duration) {
        self.nanoseconds.saturating_record(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX));
    }

    /// Returns the quantiles; `None` if the histogram is empty.
    pub fn quantiles(&self) -> Option<DurationQuantiles> {
        let at = |quantile: f64| self.nanoseconds.value_at_quantile(quantile) as f64 * 1e-9;
        let max_s = self.nanoseconds.max() as f64 * 1e-9;
        (!self.nanoseconds.is_empty()).then(|| DurationQuantiles { p50_s: at(0.5), p99_s: at(0.99), p999_s: at(0.999), max_s })
    }

    /// Returns the counts in bins that double from 1 ns on; `None` if the histogram is empty.
    pub fn histogram(&self) -> Option<wire::Histogram> {
        let counts = || self.nanoseconds.iter_log(1, 2.0).map(|bin| bin.count_since_last_iteration()).collect();
        (!self.nanoseconds.is_empty()).then(|| wire::Histogram { counts: counts() })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail")]
mod tests {
    use super::*;

    #[test]
    fn val_histogram_bins_double() {
        let mut histogram = DurationHistogram::new().unwrap();
        assert_eq!((histogram.histogram(), histogram.quantiles()), (None, None));
        for nanoseconds in [0, 1, 2, 3, 4, 7, 8, 1000] {
            histogram.record(Duration::from_nanos(nanoseconds));
        }
        let counts = histogram.histogram().unwrap().counts;
        assert_eq!(&counts[..6], [1, 1, 2, 2, 1, 0], "{counts:?}");
        assert_eq!((counts.iter().sum::<u64>(), counts.len()), (8, 11), "the last from 512 to 1023");
        assert_eq!(counts.last(), Some(&1));
    }
}
