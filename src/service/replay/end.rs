//! The end of a recording: the replay begins again, stays there, or ends.

use super::player::Player;
use crate::service::ServiceError;

impl Player<'_> {
    /// At the end of what is played: begins again, or waits there for a command. Returns whether there is more to play.
    pub(super) fn goes_on_at_end(&mut self) -> Result<bool, ServiceError> {
        if self.messages == 0 {
            return Ok(false);
        }
        if self.replay.looped {
            self.move_to(self.replay.start_offset_s)?;
            return Ok(true);
        }
        if self.cursor.stays_at_end { self.stay_at_end() } else { Ok(false) }
    }

    /// Stays at the end, paused, until a command moves the replay or ends it. To play on means to begin again.
    fn stay_at_end(&mut self) -> Result<bool, ServiceError> {
        let end_s = self.source.duration_s().min(self.end_s());
        self.cursor.next_s = end_s;
        self.timeline.jump(self.clock.elapsed(), end_s);
        self.timeline.hold(self.clock.elapsed(), end_s);
        self.cursor.moved = false;
        self.next_status = std::time::Duration::ZERO;
        while !self.cursor.stopping && !self.cursor.moved {
            self.wait_and_serve(None)?;
            if self.timeline.is_running() && !self.cursor.moved {
                self.move_to(self.replay.start_offset_s)?;
            }
        }
        Ok(!self.cursor.stopping)
    }
}
