//! Rate-limited log of refused commands whose sender waits for no reply.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::runtime::Reply;

/// Rate limit: time between two lines of the log.
const LOG_PERIOD: Duration = Duration::from_secs(1);

/// The time of the last line, and the number of refusals since.
#[derive(Clone, Default)]
pub(crate) struct RefusalLog {
    since: Arc<Mutex<(Option<Instant>, u64)>>,
}

impl RefusalLog {
    /// Logs a refusal, or counts it if the last line is less than a second old.
    pub(crate) fn record(&self, reply: &Reply) {
        if reply.accepted {
            return;
        }
        if let Some(others) = self.count(Instant::now()) {
            tracing::warn!(id = reply.id, reason = reply.reason, others, "a command was refused");
        }
    }

    /// Returns the number of refusals not logged since the last line; `None` if it is too early for another line.
    fn count(&self, now: Instant) -> Option<u64> {
        let mut since = self.since.lock().unwrap_or_else(PoisonError::into_inner);
        let (logged, others) = &mut *since;
        if logged.is_some_and(|logged| now.saturating_duration_since(logged) < LOG_PERIOD) {
            *others += 1;
            return None;
        }
        *logged = Some(now);
        Some(std::mem::take(others))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_the_rate_limit_is_one_line_a_second() {
        let refusal_log = RefusalLog::default();
        let begun = Instant::now();
        assert_eq!(refusal_log.count(begun), Some(0));
        assert!((0..1000).all(|_| refusal_log.count(begun).is_none()));
        assert_eq!(refusal_log.count(begun + LOG_PERIOD), Some(1000));
    }
}
