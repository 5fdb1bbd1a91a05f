//! Histogram of the estimated errors of single steps.

use hdrhistogram::Histogram;

/// Smaller errors are counted as zero, rad.
const UNIT_RAD: f64 = 1e-15;
/// Larger errors are counted as this one, in units of [`UNIT_RAD`]: a thousand radians.
const LARGEST: u64 = 1_000_000_000_000_000_000;

/// Quantiles of the estimated errors of single steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepErrorQuantiles {
    /// Median, rad.
    pub p50_rad: f64,
    /// Quantile 0.99, rad.
    pub p99_rad: f64,
    /// Largest error, rad.
    pub max_rad: f64,
}

/// A histogram of angles with a resolution of one digit.
pub struct StepErrorHistogram {
    units: Histogram<u64>,
}

impl StepErrorHistogram {
    /// Creates an empty histogram.
    ///
    /// # Errors
    /// Fails if the histogram cannot be allocated.
    pub fn new() -> Result<Self, hdrhistogram::CreationError> {
        Ok(StepErrorHistogram { units: Histogram::new_with_bounds(1, LARGEST, 1)? })
    }

    /// Adds an error, rad.
    pub fn record(&mut self, error_rad: f64) {
        self.units.saturating_record((error_rad / UNIT_RAD) as u64);
    }

    /// Returns the quantiles; `None` if the histogram is empty.
    pub fn quantiles(&self) -> Option<StepErrorQuantiles> {
        let at = |quantile: f64| self.units.value_at_quantile(quantile) as f64 * UNIT_RAD;
        let max_rad = self.units.max() as f64 * UNIT_RAD;
        (!self.units.is_empty()).then(|| StepErrorQuantiles { p50_rad: at(0.5), p99_rad: at(0.99), max_rad })
    }
}
