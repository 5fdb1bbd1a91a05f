//! Busy-waiting before a deadline: the stepping thread sleeps most of the time and spins for the last stretch.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// The longest spin a user may set.
pub(super) const LONGEST_SPIN: Duration = Duration::from_millis(10);
/// The longest adaptive spin. It does not try to cover wake-ups that are later: the machine is overloaded then.
const LONGEST_AUTO_SPIN: Duration = Duration::from_micros(200);
/// The shortest adaptive spin.
const SHORTEST_AUTO_SPIN: Duration = Duration::from_micros(10);
/// The adaptive spin takes at most this fraction (1/SHARE) of the time between two deadlines.
const SHARE: u32 = 5;
/// The adaptive spin lets one wake-up in this many come later than its length.
const RARE: f64 = 1000.0;
/// Factor by which the adaptive spin grows after a wake-up that was later.
const LONGER: f64 = 1.25;

/// Busy-waiting time before each deadline, during which the thread does not sleep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spin {
    /// Adapts to how late this machine wakes, measured at every wake-up.
    #[default]
    Auto,
    /// A fixed time.
    Fixed(Duration),
}

impl Spin {
    /// No busy-waiting.
    pub const NONE: Spin = Spin::Fixed(Duration::ZERO);
}

impl fmt::Display for Spin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            &Spin::NONE => f.write_str("never spins"),
            Spin::Fixed(length) => write!(f, "spins for the last {length:?}"),
            Spin::Auto => write!(f, "spins for {SHORTEST_AUTO_SPIN:?} to {LONGEST_AUTO_SPIN:?}, as late as it wakes"),
        }
    }
}

/// The current spin of a thread, fixed or adaptive.
///
/// The adaptive spin grows by a quarter after every wake-up later than its length, and shrinks after every other. Both cancel out
/// when one wake-up in [`RARE`] is later: stochastic approximation (Robbins and Monro 1951) of the logarithm of that quantile. It
/// starts at its longest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AdaptiveSpin {
    length_s: f64,
    is_auto: bool,
}

impl AdaptiveSpin {
    /// Creates the spin that the options ask for.
    pub(super) fn new(spin: Spin) -> Self {
        let (length, is_auto) = match spin {
            Spin::Fixed(length) => (length, false),
            Spin::Auto => (LONGEST_AUTO_SPIN, true),
        };
        AdaptiveSpin { length_s: length.as_secs_f64(), is_auto }
    }

    /// Returns the spin before a deadline that comes `period` after the last one.
    pub(super) fn length(&self, period: Duration) -> Duration {
        let length = Duration::from_secs_f64(self.length_s);
        if self.is_auto { length.min(period / SHARE) } else { length }
    }

    /// Learns from a wake-up that was `late`.
    pub(super) fn woke(&mut self, late: Duration) {
        // No allowed spin would have covered this wake-up, so it says nothing about the best length.
        if !self.is_auto || late > LONGEST_AUTO_SPIN {
            return;
        }
        let factor = if late.as_secs_f64() > self.length_s { LONGER } else { LONGER.powf(-1.0 / (RARE - 1.0)) };
        self.length_s = (self.length_s * factor).clamp(SHORTEST_AUTO_SPIN.as_secs_f64(), LONGEST_AUTO_SPIN.as_secs_f64());
    }
}

/// The text is not a spin.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("auto, or a time from 0 to 10ms such as 50us")]
pub struct BadSpin;

impl FromStr for Spin {
    type Err = BadSpin;

    fn from_str(text: &str) -> Result<Self, BadSpin> {
        match text {
            "auto" => Ok(Spin::Auto),
            "0" => Ok(Spin::NONE),
            text => {
                let length = humantime::parse_duration(text).map_err(|_| BadSpin)?;
                if length <= LONGEST_SPIN { Ok(Spin::Fixed(length)) } else { Err(BadSpin) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(1);
    const US: f64 = 1e-6;

    /// Applies `count` wake-ups whose lateness is `late` of evenly spread numbers from 0 to 1. Returns how many exceeded the
    /// spin.
    fn wake(spin: &mut AdaptiveSpin, count: u32, late: impl Fn(f64) -> f64) -> u32 {
        // Multiples of the golden ratio, modulo 1, are evenly spread.
        let even = (1..=count).map(|n| (f64::from(n) * 0.618_033_988_749_894_9).fract());
        even.map(|at| Duration::from_secs_f64(late(at))).fold(0, |missed, late| {
            let length = spin.length(PERIOD);
            spin.woke(late);
            missed + u32::from(late > length)
        })
    }

    /// Exponential distribution: one in a thousand is later than ln(1000) = 6.9 times the mean.
    fn exponential(mean_s: f64) -> impl Fn(f64) -> f64 {
        move |at| -mean_s * (1.0 - at).ln()
    }

    #[test]
    fn val_one_wake_up_in_a_thousand_exceeds_the_adaptive_spin() {
        let mut spin = AdaptiveSpin::new(Spin::Auto);
        wake(&mut spin, 20_000, exponential(8.0 * US));
        let missed = wake(&mut spin, 1_000_000, exponential(8.0 * US));
        assert!((900..1100).contains(&missed), "{missed}");
        let (length_s, exact_s) = (spin.length(PERIOD).as_secs_f64(), 8.0 * US * 1000_f64.ln());
        assert!((length_s / exact_s - 1.0).abs() < 0.3, "{length_s} for {exact_s}");
    }

    #[test]
    fn val_the_adaptive_spin_grows_at_once_and_shrinks_in_seconds() {
        let mut spin = AdaptiveSpin::new(Spin::Auto);
        wake(&mut spin, 20_000, |_| 20.0 * US);
        assert!(spin.length(PERIOD) < Duration::from_micros(26), "{spin:?}");
        assert!(wake(&mut spin, 100, |_| 80.0 * US) <= 7, "five times as long within seven wake-ups");
        wake(&mut spin, 10_000, |_| 20.0 * US);
        assert!(spin.length(PERIOD) < Duration::from_micros(26), "{spin:?}");
    }

    #[test]
    fn prop_a_spin_stays_in_its_bounds() {
        let mut spin = AdaptiveSpin::new(Spin::Auto);
        wake(&mut spin, 100_000, |_| 0.0);
        assert_eq!(spin.length(PERIOD), SHORTEST_AUTO_SPIN);
        wake(&mut spin, 1000, |_| 3e-3);
        assert_eq!(spin.length(PERIOD), SHORTEST_AUTO_SPIN, "no spin would have caught these");
        for _ in 0..1000 {
            wake(&mut spin, 1, |_| 200.0 * US);
            assert!(spin.length(PERIOD) <= LONGEST_AUTO_SPIN, "{spin:?}");
        }
        assert!(spin.length(PERIOD) > LONGEST_AUTO_SPIN * 99 / 100, "{spin:?}");
        assert_eq!(spin.length(PERIOD / 2), PERIOD / 10, "a fifth of the time");
        let mut fixed = AdaptiveSpin::new(Spin::Fixed(PERIOD));
        wake(&mut fixed, 100, |_| 100.0 * US);
        assert_eq!(fixed.length(PERIOD), PERIOD);
    }

    #[test]
    fn val_spins_are_parsed() {
        assert_eq!(("0".parse(), "auto".parse()), (Ok(Spin::NONE), Ok(Spin::Auto)));
        assert_eq!("50us".parse(), Ok(Spin::Fixed(Duration::from_micros(50))));
        for text in ["", "-1us", "1s", "50", "fast"] {
            assert_eq!(text.parse::<Spin>(), Err(BadSpin), "{text}");
        }
    }
}
