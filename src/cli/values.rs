//! Parsers of option values.

use std::time::Duration;

use crate::recording::Split;
use crate::runtime::Pace;

pub(super) fn pace(text: &str) -> Result<Pace, String> {
    match text {
        "real" => Ok(Pace::Factor(1.0)),
        "max" => Ok(Pace::Max),
        factor => number(factor, 1e-3, 1e6).map(Pace::Factor).map_err(|problem| format!("real, max, or {problem}")),
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
    let period = humantime::parse_duration(text).map_err(|error| format!("{error}; a time such as 200ms"))?;
    let allowed = Duration::from_millis(1)..=Duration::from_secs(3600);
    if allowed.contains(&period) { Ok(period) } else { Err("a time from 1ms to 1h".to_owned()) }
}

pub(super) fn split(text: &str) -> Result<Split, String> {
    if let Ok(time) = humantime::parse_duration(text) {
        let allowed = Duration::from_secs(1)..=Duration::from_secs(366 * 24 * 3600);
        return if allowed.contains(&time) { Ok(Split::Time(time)) } else { Err("a time from 1s to 1year".to_owned()) };
    }
    match text.parse::<bytesize::ByteSize>() {
        Ok(size) if size >= bytesize::ByteSize::mb(1) => Ok(Split::Bytes(size.as_u64())),
        Ok(_) => Err("a size of 1MB or more".to_owned()),
        Err(_) => Err("a size such as 500MB, or a time such as 10min".to_owned()),
    }
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    number(text, 1e-9, 1e9)
}

pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    number(text, 0.0, 1e9)
}

pub(super) fn number(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (low..=high).contains(number));
    number.ok_or_else(|| format!("a number from {low:?} to {high:?}"))
}
