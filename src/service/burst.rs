//! Pauses within a burst of messages.

use std::thread::sleep;
use std::time::Duration;

/// Bytes that are handed to the bus in one go, a quarter of what zenoh queues for each subscriber (`bus/session.rs`).
const BYTES_IN_ONE_GO: usize = 32 * 1024;
/// Time for zenoh to send them.
const PAUSE: Duration = Duration::from_millis(1);

/// Messages published one after the other, with nothing to wait for in between.
///
/// After a stall of the machine, a service publishes up to a second of samples in some 20 ms. If zenoh's sending thread gets no
/// processor meanwhile, its queues fill, and it drops the rest for every subscriber.
#[derive(Debug, Default)]
pub(super) struct Burst {
    bytes: usize,
}

impl Burst {
    /// The output thread waits for output: zenoh can send.
    pub fn end(&mut self) {
        self.bytes = 0;
    }

    /// Counts bytes handed to the bus. Pauses if they are enough for one go; returns whether it did.
    pub fn add(&mut self, bytes: usize) -> bool {
        self.bytes += bytes;
        let pauses = self.bytes >= BYTES_IN_ONE_GO;
        if pauses {
            sleep(PAUSE);
            self.bytes = 0;
        }
        pauses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_burst_pauses_after_each_32_kib_and_a_trickle_never() {
        let mut burst = Burst::default();
        let pauses = (0..1024).filter(|_| burst.add(320)).count();
        assert_eq!(pauses, 1024 / BYTES_IN_ONE_GO.div_ceil(320));
        let mut trickle = Burst::default();
        assert!((0..1024).all(|_| {
            trickle.end();
            !trickle.add(320)
        }));
    }
}
