//! Publishing rate: which steps are published.

use super::StepGrid;

/// Samples per simulated second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PublishRate {
    /// Publish every step.
    All,
    /// Publish this many samples per simulated second, or every step if steps are longer.
    Hz(f64),
}

impl PublishRate {
    /// The publishing rate unless another is given.
    pub const DEFAULT: PublishRate = PublishRate::Hz(200.0);

    /// Whether step `step` (from 1) of a grid is published: whenever `t·rate` passes a whole number.
    pub fn is_due(self, step: u64, grid: &StepGrid) -> bool {
        match self {
            PublishRate::All => true,
            PublishRate::Hz(rate_hz) => step == 0 || ticks(step, grid, rate_hz) > ticks(step - 1, grid, rate_hz),
        }
    }

    /// Number of published steps after `after` and before `before`, on one grid.
    pub fn due_between(self, after: u64, before: u64, grid: &StepGrid) -> u64 {
        let steps = before.saturating_sub(after).saturating_sub(1);
        match self {
            PublishRate::Hz(rate_hz) if steps > 0 => {
                let passed = ticks(before - 1, grid, rate_hz) - ticks(after, grid, rate_hz);
                steps.min(passed as u64)
            }
            _ => steps,
        }
    }
}

fn ticks(step: u64, grid: &StepGrid, rate_hz: f64) -> f64 {
    (grid.time_s(step) * rate_hz + 1e-9).floor()
}

impl std::fmt::Display for PublishRate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            PublishRate::All => f.write_str("all"),
            PublishRate::Hz(rate_hz) => write!(f, "{rate_hz}"),
        }
    }
}

/// The text is not a publishing rate.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("all, or a number from 0.001 to 1000000.0")]
pub struct BadRate;

impl std::str::FromStr for PublishRate {
    type Err = BadRate;

    fn from_str(text: &str) -> Result<Self, BadRate> {
        if text == "all" {
            return Ok(PublishRate::All);
        }
        text.parse().ok().filter(|rate| (1e-3..=1e6).contains(rate)).map(PublishRate::Hz).ok_or(BadRate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_publishes_as_many_samples_as_asked() {
        let count =
            |rate: PublishRate, steps: u64, step_s: f64| (1..=steps).filter(|n| rate.is_due(*n, &StepGrid::new(step_s))).count();
        assert_eq!(count(PublishRate::Hz(200.0), 60_000, 1e-3), 12_000);
        assert_eq!(count(PublishRate::Hz(300.0), 10_000, 1e-3), 3_000);
        assert_eq!(count(PublishRate::Hz(200.0), 100, 0.1), 100);
        assert_eq!(count(PublishRate::All, 77, 1e-3), 77);
    }

    #[test]
    fn prop_count_of_due_steps_agrees_with_each_step() {
        let rates = [PublishRate::All, PublishRate::Hz(200.0), PublishRate::Hz(37.0), PublishRate::Hz(3e3), PublishRate::Hz(0.7)];
        let grid = StepGrid::new(1e-3);
        for rate in rates {
            for (after, before) in [(0, 0), (0, 1), (5, 5), (3, 1), (0, 1000), (17, 18), (17, 19), (123, 4567)] {
                let taken = (after + 1..before).filter(|n| rate.is_due(*n, &grid)).count() as u64;
                assert_eq!(rate.due_between(after, before, &grid), taken, "{rate:?} {after}..{before}");
            }
            assert_eq!(rate.to_string().parse(), Ok(rate));
        }
    }
}
