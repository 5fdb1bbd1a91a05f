//! The recorded driving torque over the period of a computed one. Each is a mean since the sample before, and steps of another size
//! reach fewer of the recorded samples.

use super::recorded_session::RecordedSession;
use super::timeline::Timeline;
use crate::scene::Drive;
use crate::simulation::{DeliveredImpulse, PublishRate};
use crate::wire::{Loads, Message, Stamp};

/// Follows the driving torque through the loads of a recording.
pub(super) struct RecordedTorque {
    rate: Option<PublishRate>,
    /// Whether it is a mean. The torque of a prescribed motion is that of an instant.
    is_mean: bool,
    /// Stamp of the last recorded loads, or of the beginning.
    last: Stamp,
    period: Period,
    /// Whether a torque was compared, and whether one was left out.
    compared: bool,
    left_out: bool,
}

/// The recorded loads since the last computed ones.
#[derive(Default)]
struct Period {
    delivered: DeliveredImpulse,
    samples: u64,
    /// Whether a sample is missing, so that the beginning of the next mean is unknown.
    lacks_samples: bool,
}

impl RecordedTorque {
    pub(super) fn new(source: &RecordedSession) -> Self {
        RecordedTorque {
            rate: source.publish.map(|rates| rates.loads),
            is_mean: !matches!(source.scene.scene.drive, Drive::Motion(_)),
            last: Stamp::default(),
            period: Period::default(),
            compared: false,
            left_out: false,
        }
    }

    /// Begins at an instant: of a checkpoint, or of the start of an epoch.
    pub(super) fn begin(&mut self, at: Stamp) {
        (self.last, self.period) = (at, Period::default());
    }

    /// Adds recorded loads; `timeline` has the times of the recording's steps.
    pub(super) fn add(&mut self, loads: &Loads, timeline: &Timeline) {
        let stamp = loads.stamp.unwrap_or_default();
        if stamp.epoch != self.last.epoch {
            self.begin(Stamp { epoch: stamp.epoch, ..Stamp::default() });
        }
        let missing = self.rate.map_or(0, |rate| timeline.due_between(rate, stamp.epoch, self.last.step, stamp.step));
        let over_s = stamp.sim_time_s - self.last.sim_time_s;
        self.period.delivered.impulse_nm_s += loads.driving_torque_nm * over_s;
        self.period.delivered.over_s += over_s;
        self.period.samples += 1;
        self.period.lacks_samples |= missing > 0;
        self.last = stamp;
    }

    /// Gives recorded loads the mean torque over the period of the computed ones. If samples are missing there, that mean is unknown.
    /// Then the computed torque replaces it: means over different periods are not compared.
    pub(super) fn match_period(&mut self, recorded: &mut Message, computed: &Message) {
        let (Message::Loads(recorded), Message::Loads(computed)) = (recorded, computed) else { return };
        let Period { delivered, samples, lacks_samples } = std::mem::take(&mut self.period);
        if !self.is_mean {
            return;
        }
        if lacks_samples {
            recorded.driving_torque_nm = computed.driving_torque_nm;
            self.left_out = true;
        } else if let Some(mean_nm) = delivered.mean_nm() {
            if samples > 1 {
                recorded.driving_torque_nm = mean_nm;
            }
            self.compared = true;
        }
    }

    /// Whether samples are missing before every torque, so that none was compared.
    pub(super) fn was_left_out(&self) -> bool {
        self.left_out && !self.compared
    }
}
