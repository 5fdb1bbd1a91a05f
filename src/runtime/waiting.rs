//! How a stepping thread waits for a deadline: it sleeps most of the time, and spins the last stretch.

use std::str::FromStr;
use std::time::{Duration, Instant};

/// No spin is longer.
pub(super) const LONGEST_SPIN: Duration = Duration::from_millis(10);
/// No measured spin is longer: what is left, the machine may lose.
const LONGEST_MEASURED: Duration = Duration::from_micros(200);
/// Nor shorter.
const SHORTEST_MEASURED: Duration = Duration::from_micros(10);
/// Sleeps by which a spin is measured, and how long each is.
const TRIALS: usize = 32;
const TRIAL: Duration = Duration::from_micros(200);

/// How long before a deadline a thread stops sleeping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spin {
    /// As long as this machine usually wakes late, found out at the start.
    #[default]
    Measured,
    /// So long.
    For(Duration),
}

impl Spin {
    /// Never.
    pub const NONE: Spin = Spin::For(Duration::ZERO);

    /// How long it is; finding out takes a few milliseconds.
    pub(super) fn length(self) -> Duration {
        match self {
            Spin::For(length) => length,
            Spin::Measured => enough(std::array::from_fn::<_, TRIALS, _>(|_| oversleep())),
        }
    }
}

/// How late the thread wakes from one sleep.
fn oversleep() -> Duration {
    let begun = Instant::now();
    std::thread::sleep(TRIAL);
    begun.elapsed().saturating_sub(TRIAL)
}

/// A quarter more than nine in ten sleeps are late by.
fn enough<const N: usize>(mut late: [Duration; N]) -> Duration {
    late.sort_unstable();
    let usual = late.get(N * 9 / 10).copied().unwrap_or_default();
    (usual * 5 / 4).clamp(SHORTEST_MEASURED, LONGEST_MEASURED)
}

/// Not a spin.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("auto, or a time from 0 to 10ms such as 50us")]
pub struct BadSpin;

impl FromStr for Spin {
    type Err = BadSpin;

    fn from_str(text: &str) -> Result<Self, BadSpin> {
        match text {
            "auto" => Ok(Spin::Measured),
            "0" => Ok(Spin::NONE),
            text => {
                let length = humantime::parse_duration(text).map_err(|_| BadSpin)?;
                if length <= LONGEST_SPIN { Ok(Spin::For(length)) } else { Err(BadSpin) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_spin_covers_the_usual_and_not_the_rare() {
        let mut late = [Duration::from_micros(60); 32];
        late[7] = Duration::from_millis(12);
        assert_eq!(enough(late), Duration::from_micros(75));
        assert_eq!(enough([Duration::from_millis(3); 32]), LONGEST_MEASURED);
        assert_eq!(enough([Duration::ZERO; 32]), SHORTEST_MEASURED);
    }

    #[test]
    fn val_spins_are_read() {
        assert_eq!(("0".parse(), "auto".parse()), (Ok(Spin::NONE), Ok(Spin::Measured)));
        assert_eq!("50us".parse(), Ok(Spin::For(Duration::from_micros(50))));
        for text in ["", "-1us", "1s", "50", "fast"] {
            assert_eq!(text.parse::<Spin>(), Err(BadSpin), "{text}");
        }
    }
}
