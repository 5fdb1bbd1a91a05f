//! Which steps are published.

/// Samples per simulated second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PublishRate {
    /// Every step.
    All,
    /// So many a simulated second, or every step when steps are longer.
    Hz(f64),
}

impl PublishRate {
    /// Whether step `step` (the first is 1) of size `step_s` is published: whenever `n·h·rate` passes a whole number.
    pub(super) fn takes(self, step: u64, step_s: f64) -> bool {
        match self {
            PublishRate::All => true,
            PublishRate::Hz(rate_hz) => {
                let ticks = |step: u64| (step as f64 * step_s * rate_hz + 1e-9).floor();
                step == 0 || ticks(step) > ticks(step - 1)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_publishes_as_many_samples_as_asked() {
        let count = |rate: PublishRate, steps: u64, step_s: f64| (1..=steps).filter(|n| rate.takes(*n, step_s)).count();
        assert_eq!(count(PublishRate::Hz(200.0), 60_000, 1e-3), 12_000);
        assert_eq!(count(PublishRate::Hz(300.0), 10_000, 1e-3), 3_000);
        assert_eq!(count(PublishRate::Hz(200.0), 100, 0.1), 100);
        assert_eq!(count(PublishRate::All, 77, 1e-3), 77);
    }
}
