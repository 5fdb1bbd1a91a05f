//! Parsers of option values.

use std::f64::consts::PI;
use std::time::Duration;

use super::aligned_table::figure;
use crate::percent::percent_hint;
use crate::recording::Split;
use crate::runtime::{BadSpin, Pace, Spin};
use crate::simulation::{LONGEST_HOLD_S, SHORTEST_HOLD_S};

/// A year, s.
const YEAR_S: f64 = 366.0 * 24.0 * 3600.0;

pub(super) fn pace(text: &str) -> Result<Pace, String> {
    match text {
        "real" => Ok(Pace::Factor(1.0)),
        "max" => Ok(Pace::Max),
        "lockstep" => Ok(Pace::Lockstep),
        factor => number(factor, 1e-3, 1e6).map(Pace::Factor).map_err(|problem| format!("real, max, lockstep, or {problem}")),
    }
}

pub(super) fn recording_size(text: &str) -> Result<bytesize::ByteSize, String> {
    let size = text.parse().map_err(|_| "a size such as 500MB".to_owned())?;
    if size >= bytesize::ByteSize::mb(1) { Ok(size) } else { Err("a size of 1MB or more".to_owned()) }
}

pub(super) fn frames(text: &str) -> Result<f64, String> {
    number(text, 1e-3, 1e3)
}

pub(super) fn flush_period(text: &str) -> Result<Duration, String> {
    time_within(text, 1e-3, 3600.0, "1ms to 1h").map(Duration::from_secs_f64)
}

pub(super) fn split(text: &str) -> Result<Split, String> {
    if seconds(text).is_some() {
        return time_within(text, 1.0, YEAR_S, "1s to 366d").map(|time_s| Split::Time(Duration::from_secs_f64(time_s)));
    }
    match text.parse::<bytesize::ByteSize>() {
        Ok(size) if size >= bytesize::ByteSize::mb(1) => Ok(Split::Bytes(size.as_u64())),
        Ok(_) => Err("a size of 1MB or more".to_owned()),
        Err(_) => Err("a size such as 500MB, or a time such as 10min".to_owned()),
    }
}

pub(super) fn spin(text: &str) -> Result<Spin, String> {
    let text = if finite(text).is_some() { format!("{text}s") } else { text.to_owned() };
    text.parse().map_err(|bad: BadSpin| bad.to_string())
}

/// The speed in rad/s of a value in revolutions a minute, such as `955rpm`.
pub(super) fn rpm_hint(value: &str) -> Option<String> {
    let rpm = finite(value.strip_suffix("rpm").or_else(|| value.strip_suffix("1/min"))?.trim_end())?;
    Some(format!("{value} are {} rad/s", figure(rpm * PI / 30.0)))
}

/// A time above zero, s.
pub(super) fn positive_time(text: &str) -> Result<f64, String> {
    time_within(text, 1e-9, 1e9, "1ns to 1e9 s")
}

/// The time that a setpoint holds, s. Its limits are the service's.
pub(super) fn hold(text: &str) -> Result<f64, String> {
    time_within(text, SHORTEST_HOLD_S, LONGEST_HOLD_S, "1us to 60s")
}

/// Pulses are rarely as long, s: a duration of this size without a unit may be meant in ms.
pub(super) const LONG_PULSE_S: f64 = 10.0;

/// A duration as it was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GivenDuration {
    /// In seconds.
    pub duration_s: f64,
    /// A possible mistake behind a long duration, with the number that was given.
    doubt: Option<(Doubt, f64)>,
}

/// A possible mistake behind a long duration.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Doubt {
    /// It was a number alone, and may be meant in ms.
    NoUnit,
    /// Its unit was `m`, minutes, and may be meant as ms.
    Minutes,
}

impl GivenDuration {
    /// A warning of a pulse's long duration whose unit is in doubt, of this name.
    pub(super) fn suspect_pulse(self, name: &str) -> Option<String> {
        let long = figure(self.duration_s);
        let (doubt, number) = self.doubt.filter(|_| self.duration_s >= LONG_PULSE_S)?;
        Some(match doubt {
            Doubt::NoUnit => format!("{name} {long} has no unit: that is {long} s"),
            Doubt::Minutes => format!("{name} {0}m is {0} min, {long} s; milliseconds are {0}ms", figure(number)),
        })
    }
}

/// The duration of a pulse. Its limits are those of [`PulseRequest::check`](crate::simulation::PulseRequest::check), as those of its
/// delay.
pub(super) fn pulse_duration(text: &str) -> Result<GivenDuration, String> {
    let duration_s = time_within(text, 1e-9, 3600.0, "1ns to 1h")?;
    let minutes = || text.trim().strip_suffix('m').and_then(|number| finite(number.trim()));
    let doubt = finite(text).map(|number| (Doubt::NoUnit, number)).or_else(|| Some((Doubt::Minutes, minutes()?)));
    Ok(GivenDuration { duration_s, doubt })
}

/// The delay of a pulse, s.
pub(super) fn pulse_delay(text: &str) -> Result<f64, String> {
    time_within(text, 0.0, 3600.0, "0 to 1h")
}

/// Examples of times; refusals show those that are within the limits.
const TIMES: [&str; 4] = ["10", "0.5", "200ms", "10min"];

/// A time from zero, s.
pub(super) fn time(text: &str) -> Result<f64, String> {
    time_within(text, 0.0, 1e9, "0 to 1e9 s")
}

/// The step of an integrator, s.
pub(super) fn step(text: &str) -> Result<f64, String> {
    time_within(text, 1e-9, 10.0, "1ns to 10s")
}

fn time_within(text: &str, low_s: f64, high_s: f64, range: &str) -> Result<f64, String> {
    let time_s = seconds(text).filter(|time_s| (low_s..=high_s).contains(time_s));
    time_s.ok_or_else(|| {
        let within = TIMES.iter().filter(|example| seconds(example).is_some_and(|time_s| (low_s..=high_s).contains(&time_s)));
        let examples: Vec<&str> = within.copied().collect();
        format!("a time from {range}, in seconds or with a unit: {}", examples.join(", "))
    })
}

/// The seconds of a time: a number of seconds, or one with a unit.
pub(super) fn seconds(text: &str) -> Option<f64> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.or_else(|| humantime::parse_duration(text).ok().map(|time| time.as_secs_f64()))
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    number(text, 1e-9, 1e9)
}

/// A torque, N·m. Its limits are the scene's.
pub(super) fn torque(text: &str) -> Result<f64, String> {
    finite(text).ok_or_else(|| "a number in N·m without its unit, such as -2.5".to_owned())
}

pub(super) fn finite(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// A change of a scene, `KEY=VALUE`. The scene checks the key and the value.
pub(super) fn change(text: &str) -> Result<String, String> {
    let given = text.split_once('=').filter(|(key, value)| !key.trim().is_empty() && !value.trim().is_empty());
    given.map(|_| text.to_owned()).ok_or_else(|| "KEY=VALUE, such as slider.mass_kg=0.3".to_owned())
}

/// A number of steps, messages or threads.
pub(super) fn count(text: &str) -> Result<u64, String> {
    text.parse().ok().filter(|count| *count > 0).ok_or_else(|| "a whole number from 1".to_owned())
}

/// A number of services of each scene.
pub(super) fn services(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|count| (1..=999).contains(count)).ok_or_else(|| "a whole number from 1 to 999".to_owned())
}

/// A number of programs, perhaps none.
pub(super) fn programs(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| "a whole number".to_owned())
}

pub(super) fn number(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (low..=high).contains(number));
    let hint = || match percent_hint(text) {
        Some(hint) => format!("; {hint}"),
        None if has_unit(text) && rpm_hint(text).is_none() => ", without a unit".to_owned(),
        None => String::new(),
    };
    number.ok_or_else(|| format!("a number from {} to {}{}", short(low), short(high), hint()))
}

/// Whether a text is a number with a unit: `1mm`, `100 Hz`.
fn has_unit(text: &str) -> bool {
    let number = text.trim_end_matches(|letter: char| letter.is_alphabetic() || "/°²³".contains(letter));
    number.len() < text.len() && !text.ends_with(['e', 'E', '/']) && finite(number.trim_end()).is_some()
}

/// A limit as people write it: `1e9`, `0.001`.
fn short(limit: f64) -> String {
    let magnitude = limit.abs();
    if magnitude == 0.0 || (1e-3..1e5).contains(&magnitude) { limit.to_string() } else { format!("{limit:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_times_have_a_unit_or_are_in_seconds() {
        for (text, time_s) in [
            ("10", 10.0),
            ("0.5", 0.5),
            ("1e-3", 1e-3),
            ("200ms", 0.2),
            ("50us", 50e-6),
            ("4.2s", 4.2),
            ("10min", 600.0),
            ("1h 30min", 5400.0),
        ] {
            assert_eq!(positive_time(text), Ok(time_s), "{text}");
        }
        for text in ["nan", "inf", "-1", "0", "", "ms", "10 parsecs", "1e300", "5Nm"] {
            let problem = positive_time(text).err().unwrap_or_default();
            assert_eq!(problem, "a time from 1ns to 1e9 s, in seconds or with a unit: 10, 0.5, 200ms, 10min", "{text}");
        }
        // Examples are within the limits: `10min` was refused with `10min` as an example.
        assert_eq!(step("10min"), Err("a time from 1ns to 10s, in seconds or with a unit: 10, 0.5, 200ms".to_owned()));
        assert_eq!(time("0"), Ok(0.0));
        assert_eq!(split("600"), split("10min"));
        assert_eq!(flush_period("0.2"), Ok(Duration::from_millis(200)));
    }

    #[test]
    fn regress_a_share_in_per_cent_is_refused_with_the_number_to_write() {
        assert_eq!(positive("1%"), Err("a number from 1e-9 to 1e9; 1% is written as 0.01".to_owned()));
        assert!(pace("50%").is_err_and(|problem| problem.ends_with("; 50% is written as 0.5")));
        for text in ["x", "rad", "inf", "1e", "2/", "10rpm"] {
            assert_eq!(positive(text), Err("a number from 1e-9 to 1e9".to_owned()));
        }
    }

    #[test]
    fn regress_a_number_with_a_unit_is_refused_for_its_unit() {
        for text in ["1mm", "100 Hz", "31.4rad/s", "-5e-3m²"] {
            assert_eq!(positive(text), Err("a number from 1e-9 to 1e9, without a unit".to_owned()), "{text}");
        }
    }

    #[test]
    fn val_a_spin_is_auto_or_a_time() {
        assert_eq!(spin("auto"), Ok(Spin::Auto));
        assert_eq!(spin("0"), Ok(Spin::NONE));
        assert_eq!(spin("50us"), Ok(Spin::Fixed(Duration::from_micros(50))));
        assert_eq!(spin("0.001"), Ok(Spin::Fixed(Duration::from_millis(1))));
        for text in ["11ms", "-1us", "50", "5kg", ""] {
            assert!(spin(text).is_err(), "{text}");
        }
    }

    #[test]
    fn val_limits_read_as_people_write_them() {
        assert_eq!([0.0, 1e-9, 0.001, 1000.0, 1e9, -1e12].map(short), ["0", "1e-9", "0.001", "1000", "1e9", "-1e12"]);
    }
}
