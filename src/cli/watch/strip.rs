//! The last seconds of one signal, in bounded memory: what it went between in every hundredth of a second.

use std::collections::VecDeque;

/// What is kept, s.
pub(super) const KEPT_S: f64 = 30.0;
/// What one entry spans, s.
const GRAIN_S: f64 = 0.01;

/// What a signal went between in one grain of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grain {
    pub time_s: f64,
    pub low: f64,
    pub high: f64,
}

/// A signal's recent past.
#[derive(Debug, Clone, Default)]
pub(super) struct Strip {
    grains: VecDeque<Grain>,
    /// Its newest value, whatever that is.
    pub now: f64,
}

impl Strip {
    /// Takes a value. Time that goes back, as at a reset or in a replay that seeks, begins the strip anew.
    pub(super) fn push(&mut self, time_s: f64, value: f64) {
        self.now = value;
        if !time_s.is_finite() || !value.is_finite() {
            return;
        }
        let last = self.grains.back_mut();
        match last {
            Some(last) if time_s < last.time_s => self.grains.clear(),
            Some(last) if time_s < last.time_s + GRAIN_S => {
                (last.low, last.high) = (last.low.min(value), last.high.max(value));
                return;
            }
            _ => {}
        }
        self.grains.push_back(Grain { time_s, low: value, high: value });
        while self.grains.front().is_some_and(|first| time_s - first.time_s > KEPT_S) {
            self.grains.pop_front();
        }
    }

    /// The grains of the last seconds, oldest first.
    pub(super) fn last(&self, seconds: f64) -> impl Iterator<Item = Grain> + '_ {
        let end = self.end_s();
        self.grains.iter().copied().skip_while(move |grain| end - grain.time_s > seconds)
    }

    /// When the newest grain began, s.
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
        assert!(strip.grains.len() <= (KEPT_S / GRAIN_S) as usize + 2, "{}", strip.grains.len());
        assert_eq!(strip.last(1.0).map(|grain| grain.high).fold(0.0, f64::max), 7.0);
        assert_eq!(strip.now, 0.0);
    }

    #[test]
    fn prop_time_that_goes_back_begins_anew_and_nan_leaves_no_trace() {
        let mut strip = Strip::default();
        strip.push(5.0, 1.0);
        strip.push(f64::NAN, 1.0);
        strip.push(6.0, f64::INFINITY);
        assert_eq!(strip.last(10.0).count(), 1);
        strip.push(0.5, 2.0);
        assert_eq!(strip.last(10.0).collect::<Vec<_>>(), [Grain { time_s: 0.5, low: 2.0, high: 2.0 }]);
    }
}
