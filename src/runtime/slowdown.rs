//! A load for trials of deadlines: at random times, each step takes several times as long as the solver needs.

use std::time::{Duration, Instant};

/// Shortest and longest load, and shortest and longest time between two.
const LOAD_MS: [u64; 2] = [200, 2000];
const REST_MS: [u64; 2] = [1500, 5000];

/// Loads that begin and end at random times, the same for the same seed in every thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slowdown {
    factor: f64,
    random: u64,
    loaded: bool,
    /// End of the present load or rest.
    until: Duration,
    onsets: u32,
}

impl Slowdown {
    /// Loads under which a step takes `factor` times as long.
    pub fn new(factor: f64, seed: u64) -> Self {
        Slowdown { factor, random: seed, loaded: true, until: Duration::ZERO, onsets: 0 }
    }

    /// Number of loads that have begun.
    pub fn onsets(&self) -> u32 {
        self.onsets
    }

    /// Prolongs a step that began at `begun` and ends at `now`, if there is a load.
    pub(super) fn prolong(&mut self, now: Duration, begun: Instant) {
        while now >= self.until {
            self.loaded = !self.loaded;
            self.onsets += u32::from(self.loaded);
            let [low, high] = if self.loaded { LOAD_MS } else { REST_MS };
            // Knuth's linear congruence. From the end of the last one: no thread lags behind another because it looks later.
            self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            self.until += Duration::from_millis(low + (self.random >> 33) % (high - low));
        }
        if self.loaded {
            let end = begun.elapsed().mul_f64(self.factor);
            while begun.elapsed() < end {
                std::hint::spin_loop();
            }
        }
    }
}
