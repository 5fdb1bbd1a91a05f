//! Histograms of durations: the lateness of steps and of replayed messages, the cost of steps, the age of samples.

use std::time::Duration;

use hdrhistogram::Histogram;

/// Longer durations are counted as this one, ns.
const LONGEST_NS: u64 = 100_000_000_000;
/// Bins in which durations double: the difference of two histograms shows a shift by a fifth.
const BINS_PER_DOUBLING: u32 = 4;

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

/// Counts of durations in bins whose limits double every few bins. The first is the number below 1 ns; with n bins per doubling, the
/// k-th after it is the number from 2^((k-1)/n) ns to below 2^(k/n) ns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DurationBins {
    /// Number of durations in each bin.
    pub counts: Vec<u64>,
    /// Number of bins in which the limits double.
    pub bins_per_doubling: u32,
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

    /// Returns the counts in four bins for each doubling from 1 ns on; `None` if the histogram is empty.
    pub fn bins(&self) -> Option<DurationBins> {
        let mut counts = Vec::new();
        for recorded in self.nanoseconds.iter_recorded() {
            let bin = bin(recorded.value_iterated_to());
            counts.resize(counts.len().max(bin + 1), 0);
            counts[bin] += recorded.count_at_value();
        }
        (!counts.is_empty()).then_some(DurationBins { counts, bins_per_doubling: BINS_PER_DOUBLING })
    }
}

/// The bin of a duration: 0 below 1 ns.
fn bin(nanoseconds: u64) -> usize {
    if nanoseconds == 0 { 0 } else { 1 + (f64::from(BINS_PER_DOUBLING) * (nanoseconds as f64).log2()) as usize }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail")]
mod tests {
    use super::*;

    #[test]
    fn val_four_bins_of_a_histogram_double() {
        let mut histogram = DurationHistogram::new().unwrap();
        assert_eq!((histogram.bins(), histogram.quantiles()), (None, None));
        for nanoseconds in [0, 1, 2, 3, 4, 7, 8, 1000] {
            histogram.record(Duration::from_nanos(nanoseconds));
        }
        let DurationBins { counts, bins_per_doubling } = histogram.bins().unwrap();
        let by_doubling: Vec<u64> = counts[1..].chunks(bins_per_doubling as usize).map(|bins| bins.iter().sum()).collect();
        assert_eq!((counts[0], &by_doubling[..5]), (1, &[1, 2, 2, 1, 0][..]), "{counts:?}");
        assert_eq!((counts.iter().sum::<u64>(), by_doubling.len()), (8, 10), "the last from 512 to 1023");
        assert_eq!((counts[9], counts.last()), (1, Some(&1)), "4 ns is the first of its doubling");
    }
}
