//! Shutdown signals.

use std::future::poll_fn;
use std::task::Poll;

use tokio::signal::unix::{Signal, SignalKind, signal};

/// File in which Linux lists, among others, the signals that this process ignores.
const PROCESS: &str = "/proc/self/status";

/// Resolves at Ctrl-C, SIGTERM or SIGHUP (the terminal was closed, or ssh lost). From this call on, these signals no longer end
/// the process. A process that was started with SIGHUP ignored, as by `nohup`, keeps ignoring it.
pub(super) fn interrupted() -> impl Future<Output = ()> {
    let hangup = (!ignores(SignalKind::hangup())).then(SignalKind::hangup);
    let ends = [SignalKind::interrupt(), SignalKind::terminate()].into_iter().chain(hangup);
    let mut signals: Vec<Signal> = ends.filter_map(|end| signal(end).ok()).collect();
    poll_fn(move |context| match signals.iter_mut().any(|signal| signal.poll_recv(context).is_ready()) {
        true => Poll::Ready(()),
        false => Poll::Pending,
    })
}

/// Whether this process was started with a signal ignored. If that cannot be determined, the signal is left alone.
fn ignores(kind: SignalKind) -> bool {
    let status = std::fs::read_to_string(PROCESS).unwrap_or_default();
    status.lines().find_map(|line| line.strip_prefix("SigIgn:")).is_none_or(|mask| has(mask.trim(), kind))
}

/// Whether a signal is in a mask; the lowest bit is signal 1.
fn has(mask: &str, kind: SignalKind) -> bool {
    u64::from_str_radix(mask, 16).is_ok_and(|mask| mask >> (kind.as_raw_value() - 1) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_masks_as_linux_writes_them() {
        for (mask, hangup, terminate) in [
            ("0000000000000001", true, false),
            ("0000000000001000", false, false),
            ("0000000000004000", false, true),
            ("0000000180015201", true, true),
        ] {
            assert_eq!(
                [SignalKind::hangup(), SignalKind::terminate()].map(|kind| has(mask, kind)),
                [hangup, terminate],
                "{mask}"
            );
        }
    }
}
