//! The last seconds of one signal in bounded memory: its range in every hundredth of a second.

use std::collections::VecDeque;

/// Time span kept, s.
pub(super) const KEPT_S: f64 = 30.0;
/// Time span of one entry, s.
const ENTRY_S: f64 = 0.01;

/// The range of a signal in one time span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StripEntry {
    pub time_s: f64,
    pub low: f64,
    pub high: f64,
}

/// The recent past of a signal.
#[derive(Debug, Clone, Default)]
pub(super) struct Strip {
    grains: VecDeque<StripEntry>,
    /// The newest value, even if it is NaN.
    pub now: f64,
}

impl Strip {
    /// Adds a value. If time goes back, as at a reset or a seek, the strip starts again.
    pub(super) fn push(&mut self, time_s: f64, value: f64) {
        self.now = value;
        if !time_s.is_finite() || !value.is_finite() {
            return;
        }
        let last = self.grains.back_mut();
        match last {
            Some(last) if time_s < last.time_s => self.grains.clear(),
            Some(last) if time_s < last.time_s + ENTRY_S => {
                (last.low, last.high) = (last.low.min(value), last.high.max(value));
                return;
            }
            _ => {}
        }
        self.grains.push_back(StripEntry { time_s, low: value, high: value });
        while self.grains.front().is_some_and(|first| time_s - first.time_s > KEPT_S) {
            self.grains.pop_front();
        }
    }

    /// The entries of the last seconds, oldest first.
    pub(super) fn last(&self, seconds: f64) -> impl Iterator<Item = StripEntry> + '_ {
        let end = self.end_s();
        self.grains.iter().copied().skip_while(move |entry| end - entry.time_s > seconds)
    }

    /// Start of the newest entry, s.
    pub(super) fn end_s(&self) -> f64 {
        self.grains.back().map_or(0.0, |last| last.time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_peak_between_two_grains_is_kept_and_memory_is_bounded() {
        let mut strip = Strip::default();
        for step in 0..1_000_000_u32 {
            strip.push(f64::from(step) * 1e-3, if step == 999_995 { 7.0 } else { 0.0 });
        }
        assert!(strip.grains.len() <= (KEPT_S / ENTRY_S) as usize + 2, "{}", strip.grains.len());
        assert_eq!(strip.last(1.0).map(|entry| entry.high).fold(0.0, f64::max), 7.0);
        assert_eq!(strip.now, 0.0);
    }

    #[test]
    fn prop_a_strip_restarts_when_time_goes_back_and_skips_nan() {
        let mut strip = Strip::default();
        strip.push(5.0, 1.0);
        strip.push(f64::NAN, 1.0);
        strip.push(6.0, f64::INFINITY);
        assert_eq!(strip.last(10.0).count(), 1);
        strip.push(0.5, 2.0);
        assert_eq!(strip.last(10.0).collect::<Vec<_>>(), [StripEntry { time_s: 0.5, low: 2.0, high: 2.0 }]);
    }
}
