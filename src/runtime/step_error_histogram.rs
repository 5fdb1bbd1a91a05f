//! How the errors of single steps are spread.

use hdrhistogram::Histogram;

/// Smallest error told from none, rad.
const UNIT_RAD: f64 = 1e-15;
/// Largest told from larger ones, in units: a thousand radians.
const LARGEST: u64 = 1_000_000_000_000_000_000;

/// A histogram of angles, kept to one digit.
pub struct StepErrorHistogram {
    units: Histogram<u64>,
}

impl StepErrorHistogram {
    /// Nothing recorded yet.
    ///
    /// # Errors
    /// When the histogram cannot be made.
    pub fn new() -> Result<Self, hdrhistogram::CreationError> {
        Ok(StepErrorHistogram { units: Histogram::new_with_bounds(1, LARGEST, 1)? })
    }

    /// SharedCounters one more, rad.
    pub fn record(&mut self, error_rad: f64) {
        self.units.saturating_record((error_rad / UNIT_RAD) as u64);
    }

    /// Quantiles 0.5 and 0.99 and the largest, rad; `None` before the first.
    pub fn quantiles_rad(&self) -> Option<[f64; 3]> {
        let at = |quantile: f64| self.units.value_at_quantile(quantile) as f64 * UNIT_RAD;
        (!self.units.is_empty()).then(|| [at(0.5), at(0.99), self.units.max() as f64 * UNIT_RAD])
    }
}
