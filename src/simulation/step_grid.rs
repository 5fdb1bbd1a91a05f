//! Times of steps, also where the step has changed.

/// Times of the steps of an epoch: `t = origin + (n − n₀) h`, never accumulated. A change of the step begins a new grid where it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepGrid {
    /// The step at the grid's origin, n₀.
    pub origin_step: u64,
    /// Simulated time there, s.
    pub origin_s: f64,
    /// Size of a step, h, s.
    pub step_s: f64,
    /// Size of the step that ends at the origin, s: it decides whether a sample was due there.
    pub previous_step_s: f64,
}

/// Largest difference of a ratio of steps from a whole number.
const ROUNDING: f64 = 1e-6;

impl StepGrid {
    /// The grid of an epoch that begins with steps of this size.
    pub fn new(step_s: f64) -> Self {
        StepGrid { origin_step: 0, origin_s: 0.0, step_s, previous_step_s: step_s }
    }

    /// Simulated time after `step` steps, s; before the origin that of the last step only.
    pub fn time_s(&self, step: u64) -> f64 {
        let step_s = if step < self.origin_step { self.previous_step_s } else { self.step_s };
        self.origin_s + (step as f64 - self.origin_step as f64) * step_s
    }

    /// The grid from `step` on, with steps of another size; this one if the size is the same.
    pub fn with_step(self, step: u64, step_s: f64) -> Self {
        let same = step_s.to_bits() == self.step_s.to_bits();
        if same {
            return self;
        }
        let previous_step_s = if step == self.origin_step { self.previous_step_s } else { self.step_s };
        StepGrid { origin_step: step, origin_s: self.time_s(step), step_s, previous_step_s }
    }

    /// Steps from `step` to the next instant that steps of `step_s` since t = 0 reach as well; `None` if neither size is a multiple
    /// of the other.
    pub fn steps_to_common(&self, step: u64, step_s: f64) -> Option<u64> {
        let ratio = step_s / self.step_s;
        if !is_whole(ratio) && !is_whole(1.0 / ratio) {
            return None;
        }
        let passed = self.time_s(step) / step_s;
        let common = ratio < 1.5 || is_whole_or_zero(passed);
        Some(if common { 0 } else { ((passed.ceil() - passed) * ratio).round() as u64 })
    }
}

fn is_whole(number: f64) -> bool {
    number > 0.5 && is_whole_or_zero(number)
}

fn is_whole_or_zero(number: f64) -> bool {
    (number - number.round()).abs() < ROUNDING
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_times_go_on_where_the_step_changes() {
        let grid = StepGrid::new(2e-3).with_step(500, 1e-3);
        assert_eq!((grid.time_s(500), grid.time_s(501)), (1.0, 1.001));
        let back = grid.with_step(600, 2e-3);
        assert_eq!((back.time_s(600), back.time_s(700)), (1.1, 1.3));
        assert_eq!(back.with_step(650, 2e-3), back);
        // The step that ended at the origin is as long as it was, however often the next one changes.
        let again = back.with_step(700, 1e-3).with_step(700, 4e-3);
        assert_eq!((again.time_s(699), again.time_s(700), again.time_s(701)), (back.time_s(699), back.time_s(700), 1.304));
    }

    #[test]
    fn val_a_longer_step_begins_at_a_common_instant() {
        let grid = StepGrid::new(2e-3);
        assert_eq!(grid.steps_to_common(500, 1e-3), Some(0));
        assert_eq!([0, 1, 2, 3].map(|step| grid.steps_to_common(step, 6e-3)), [Some(0), Some(2), Some(1), Some(0)]);
        assert_eq!(grid.steps_to_common(0, 3e-3), None);
        // Millions of steps later, too.
        assert_eq!(grid.steps_to_common(300_000_001, 4e-3), Some(1));
    }
}
