//! The instants at which all runs are compared, and the steps that meet them.

/// Approximate number of instants in a run.
const INSTANTS: f64 = 200.0;
/// Fewer instants than this miss much of what happens between them.
const FEW: usize = 50;
/// Steps are taken as dividing the interval when the quotient is this close to whole.
const WHOLE: f64 = 1e-9;
/// Divisors of the interval that give the default steps.
const DIVISORS: [f64; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// `count` instants after t = 0, `interval_s` apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Time between instants, s.
    pub interval_s: f64,
    /// Number of instants.
    pub count: usize,
}

/// Steps that no common interval meets.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "--steps: {step_s} s does not divide a common sampling interval with {longest_s} s; the nearest that does is {nearest_s} s"
)]
pub struct NoCommonInterval {
    step_s: f64,
    longest_s: f64,
    nearest_s: f64,
}

impl Grid {
    /// Creates a grid for a run of at least `until_s`: about 200 instants, at a round interval, or at one that every one of
    /// `steps_s` divides.
    ///
    /// # Errors
    /// [`NoCommonInterval`] if there is none.
    pub fn new(until_s: f64, steps_s: Option<&[f64]>) -> Result<Self, NoCommonInterval> {
        let interval_s = match steps_s {
            None => round_up(until_s / INSTANTS),
            Some(steps_s) => common_s(until_s / INSTANTS, steps_s)?,
        };
        Ok(Grid { interval_s, count: ((until_s / interval_s - WHOLE).ceil() as usize).max(1) })
    }

    /// Whether there are so few instants that errors between them may be missed. Without steps asked for, there are 80 or more.
    pub fn has_few_instants(&self) -> bool {
        self.count < FEW
    }

    /// Steps of `step_s` between two instants.
    pub fn steps(&self, step_s: f64) -> u64 {
        (self.interval_s / step_s).round() as u64
    }

    /// Simulated duration, s.
    pub fn until_s(&self) -> f64 {
        tidy(self.interval_s * self.count as f64)
    }

    /// Steps to try, longest first.
    pub(super) fn usual_steps_s(&self) -> Vec<f64> {
        DIVISORS.iter().map(|divisor| tidy(self.interval_s / divisor)).collect()
    }
}

/// Rounds up to 1, 2, 5 times a power of ten.
fn round_up(x: f64) -> f64 {
    let power = 10_f64.powf(x.log10().floor());
    let mantissa = x / power;
    tidy([1.0, 2.0, 5.0, 10.0].into_iter().find(|m| *m >= mantissa * (1.0 - WHOLE)).unwrap_or(10.0) * power)
}

/// Removes the digits that rounding left behind in a quotient or a product.
pub(super) fn tidy(x: f64) -> f64 {
    format!("{x:.12e}").parse().unwrap_or(x)
}

fn divides(step_s: f64, interval_s: f64) -> bool {
    let quotient = interval_s / step_s;
    (quotient - quotient.round()).abs() < WHOLE * quotient && quotient.round() >= 1.0
}

/// The least multiple of the longest step, from about `least_s` on, that all steps divide.
fn common_s(least_s: f64, steps_s: &[f64]) -> Result<f64, NoCommonInterval> {
    let longest_s = steps_s.iter().copied().fold(0.0, f64::max);
    let first = (least_s / longest_s).round().max(1.0);
    let candidates = (0..100).map(|k| tidy((first + f64::from(k)) * longest_s));
    let all = |interval_s: &f64| steps_s.iter().all(|step_s| divides(*step_s, *interval_s));
    candidates.clone().find(all).ok_or_else(|| {
        let interval_s = tidy(first * longest_s);
        let step_s = steps_s.iter().copied().find(|step_s| !divides(*step_s, interval_s)).unwrap_or(longest_s);
        NoCommonInterval { step_s, longest_s, nearest_s: tidy(interval_s / (interval_s / step_s).round().max(1.0)) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_steps_meet_the_instants() {
        let grid = Grid::new(2.0, None).unwrap();
        assert_eq!((grid.interval_s, grid.count, grid.steps(1e-3)), (0.01, 200, 10));
        let grid = Grid::new(2.0, Some(&[1e-3, 3e-4])).unwrap();
        assert!(grid.usual_steps_s().len() == 10 && divides(3e-4, grid.interval_s) && divides(1e-3, grid.interval_s));
        let refused = Grid::new(2.0, Some(&[1e-3, 1e-3 / std::f64::consts::PI])).unwrap_err();
        assert!(refused.to_string().contains("nearest"), "{refused}");
        for until_s in [0.0838, 3.0, 20.0, 1e-4] {
            let grid = Grid::new(until_s, None).unwrap();
            assert!(grid.until_s() >= until_s * (1.0 - 1e-9) && grid.until_s() < 1.02 * until_s, "{until_s}: {grid:?}");
            assert!((80..=200).contains(&grid.count) && !grid.has_few_instants(), "{until_s}: {grid:?}");
        }
        let grid = Grid::new(2.0, Some(&[1.0, 0.5])).unwrap();
        assert!(grid.count == 2 && grid.has_few_instants(), "{grid:?}");
    }

    #[test]
    fn regress_times_that_are_shown_have_no_digits_of_rounding() {
        let grid = Grid::new(2.3, None).unwrap();
        assert_eq!((grid.until_s(), grid.interval_s), (2.3, 0.02));
        let refused = Grid::new(2.0, Some(&[1e-3, 1e-3 / std::f64::consts::PI])).unwrap_err().to_string();
        assert!(refused.ends_with("the nearest that does is 0.0003225806451613 s"), "{refused}");
    }
}
