//! How a service is told to end.

use std::future::poll_fn;
use std::task::Poll;

use tokio::signal::unix::{Signal, SignalKind, signal};

/// What the system says of this process: there, among others, the signals that it ignores.
const PROCESS: &str = "/proc/self/status";

/// Resolves at Ctrl-C, SIGTERM or SIGHUP (the terminal is closed, or ssh lost), which end nothing by themselves any more from
/// the moment of this call. Who was started to outlive its terminal, as by `nohup`, does not hear of SIGHUP.
pub(super) fn interrupted() -> impl Future<Output = ()> {
    let hangup = (!ignores(SignalKind::hangup())).then(SignalKind::hangup);
    let ends = [SignalKind::interrupt(), SignalKind::terminate()].into_iter().chain(hangup);
    let mut signals: Vec<Signal> = ends.filter_map(|end| signal(end).ok()).collect();
    poll_fn(move |context| match signals.iter_mut().any(|signal| signal.poll_recv(context).is_ready()) {
        true => Poll::Ready(()),
        false => Poll::Pending,
    })
}

/// Whether this process was started so as to ignore a signal; where that cannot be known, it is left as it is.
fn ignores(kind: SignalKind) -> bool {
    let status = std::fs::read_to_string(PROCESS).unwrap_or_default();
    status.lines().find_map(|line| line.strip_prefix("SigIgn:")).is_none_or(|mask| has(mask.trim(), kind))
}

/// Whether a signal is in a mask, of which the lowest bit is signal 1.
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
