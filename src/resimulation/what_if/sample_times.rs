//! The samples of a recording that the steps of a changed session reach.

use crate::wire::Stamp;

/// The number of samples of a recording that lie between the steps of a changed session.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SampleTimes {
    /// Samples in the recording.
    pub all: u64,
    /// Those between two steps of the changed session, where it has no sample.
    pub left_out: u64,
    /// Shortest and longest time from a sample to the next, s.
    intervals_s: Option<[f64; 2]>,
    /// Epoch and simulated time of the last one, s.
    last: Option<(u64, f64)>,
}

impl SampleTimes {
    /// Counts one more sample.
    pub(super) fn count(&mut self, stamp: Stamp, is_reached: bool) {
        self.all += 1;
        self.left_out += u64::from(!is_reached);
        let before_s = self.last.filter(|(epoch, _)| *epoch == stamp.epoch).map(|(_, time_s)| time_s);
        if let Some(interval_s) = before_s.map(|before_s| stamp.sim_time_s - before_s) {
            let [shortest_s, longest_s] = self.intervals_s.unwrap_or([interval_s; 2]);
            self.intervals_s = Some([shortest_s.min(interval_s), longest_s.max(interval_s)]);
        }
        self.last = Some((stamp.epoch, stamp.sim_time_s));
    }

    /// Time from each sample to the next, s; `None` if it is not always the same.
    pub fn interval_s(&self) -> Option<f64> {
        let [shortest_s, longest_s] = self.intervals_s?;
        (longest_s - shortest_s <= 1e-6 * longest_s).then_some(shortest_s)
    }
}
