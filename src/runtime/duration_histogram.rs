//! How durations are spread: the lateness of steps or messages, the cost of steps.

use std::time::Duration;

use hdrhistogram::Histogram;

use crate::wire;

/// Longest duration that is told from longer ones, ns.
const LONGEST_NS: u64 = 100_000_000_000;

/// A histogram of durations, kept to two digits from 1 ns to 100 s.
pub struct DurationHistogram {
    nanoseconds: Histogram<u64>,
}

impl DurationHistogram {
    /// Nothing recorded yet.
    ///
    /// # Errors
    /// When the histogram cannot be made.
    pub fn new() -> Result<Self, hdrhistogram::CreationError> {
        Ok(DurationHistogram { nanoseconds: Histogram::new_with_bounds(1, LONGEST_NS, 2)? })
    }

    /// SharedCounters one more.
    pub fn record(&mut self, duration: Duration) {
        self.nanoseconds.saturating_record(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX));
    }

    /// Quantiles 0.5, 0.99, 0.999 and the largest, s; `None` before the first.
    pub fn quantiles_s(&self) -> Option<[f64; 4]> {
        let at = |quantile: f64| self.nanoseconds.value_at_quantile(quantile) as f64 * 1e-9;
        (!self.nanoseconds.is_empty()).then(|| [at(0.5), at(0.99), at(0.999), self.nanoseconds.max() as f64 * 1e-9])
    }

    /// All of it, by powers of two of a nanosecond; `None` before the first.
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
    fn val_bins_double() {
        let mut spread = DurationHistogram::new().unwrap();
        assert_eq!((spread.histogram(), spread.quantiles_s()), (None, None));
        for nanoseconds in [0, 1, 2, 3, 4, 7, 8, 1000] {
            spread.record(Duration::from_nanos(nanoseconds));
        }
        let counts = spread.histogram().unwrap().counts;
        assert_eq!(&counts[..6], [1, 1, 2, 2, 1, 0], "{counts:?}");
        assert_eq!((counts.iter().sum::<u64>(), counts.len()), (8, 11), "the last from 512 to 1023");
        assert_eq!(counts.last(), Some(&1));
    }
}
