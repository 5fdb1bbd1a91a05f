//! Rate of scene updates: which samples are published as shapes for 3D viewers.

/// Selects samples at a rate of session time.
#[derive(Debug, Clone, Copy)]
pub(super) struct SceneUpdateTimer {
    rate_hz: f64,
    /// Number of periods begun at the last selected sample.
    begun: f64,
}

impl SceneUpdateTimer {
    pub(super) fn new(rate_hz: f64) -> Self {
        SceneUpdateTimer { rate_hz, begun: f64::NEG_INFINITY }
    }

    /// Whether the sample at this session time is the first in its period.
    pub(super) fn is_due(&mut self, session_s: f64) -> bool {
        let begun = (session_s * self.rate_hz + 1e-9).floor();
        let first = begun > self.begun;
        self.begun = self.begun.max(begun);
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_scene_updates_are_evenly_spaced() {
        let mut scene_update_timer = SceneUpdateTimer::new(25.0);
        let taken: Vec<u32> = (0..2000).filter(|&step| scene_update_timer.is_due(f64::from(step) * 5e-3)).collect();
        assert_eq!(taken.len(), 250);
        assert!(taken.windows(2).all(|pair| pair[1] - pair[0] == 8), "every 40 ms of samples at 5 ms");
    }

    #[test]
    fn prop_no_sample_is_selected_twice_and_slow_ones_all() {
        let mut scene_update_timer = SceneUpdateTimer::new(25.0);
        assert!(
            scene_update_timer.is_due(0.0)
                && !scene_update_timer.is_due(0.0)
                && scene_update_timer.is_due(1.0)
                && scene_update_timer.is_due(2.0)
        );
    }
}
