//! Shutdown signals.

use std::future::poll_fn;
use std::io::{self, IsTerminal as _, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Poll;

use super::async_runtime::runtime;
use super::failure::CommandResult;
use super::formatting::counted;
use crate::whole_file::discard_unfinished;
use tokio::runtime::Runtime;
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

/// The words for what an interruption leaves, if that is not files.
static LEFT: Mutex<Option<String>> = Mutex::new(None);

/// Sets what an interruption from now on leaves, in words.
pub(super) fn interruption_leaves(what: String) {
    *left() = Some(what);
}

/// An interruption from now on leaves nothing.
pub(super) fn interruption_leaves_nothing() {
    interruption_leaves(String::new());
}

/// An interruption from now on leaves files, if any.
pub(super) fn interruption_leaves_files() {
    *left() = None;
}

fn left() -> MutexGuard<'static, Option<String>> {
    LEFT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An interruption of long work that keeps what is done: the first signal asks the work to end, the second ends the process.
pub(super) struct Interruption {
    asked: Arc<AtomicBool>,
    keeps: Arc<AtomicBool>,
    /// Signals are handled as long as the runtime lives.
    _runtime: Runtime,
}

impl Interruption {
    /// Handles signals from now on.
    pub(super) fn watch() -> CommandResult<Self> {
        let (asked, keeps, runtime) = (Arc::<AtomicBool>::default(), Arc::<AtomicBool>::default(), runtime()?);
        let (told, keeping) = (Arc::clone(&asked), Arc::clone(&keeps));
        // Before this returns, not when the task first runs: by then the work may have begun a file.
        let mut signal = {
            let _context = runtime.enter();
            Box::pin(interrupted())
        };
        runtime.spawn(async move {
            loop {
                signal.as_mut().await;
                if told.swap(true, Ordering::Relaxed) || !keeping.load(Ordering::Relaxed) {
                    end();
                }
                let loses = if left().is_none() { ", which loses what was computed" } else { "" };
                say!("interrupted: waiting for what is being computed; press Ctrl-C again to stop at once{loses}");
            }
        });
        Ok(Interruption { asked, keeps, _runtime: runtime })
    }

    /// Sets whether there is something to keep; if not, a signal ends the process at once.
    pub(super) fn keeps(&self, keeps: bool) {
        self.keeps.store(keeps, Ordering::Relaxed);
    }

    /// Whether the work is to end.
    pub(super) fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }
}

/// Ends the process, and reports what was written, or what it leaves.
fn end() -> ! {
    if io::stderr().is_terminal() {
        // Over the progress that stands in the last line.
        let _ = io::stderr().write_all(b"\r\x1b[K");
    }
    match (discard_unfinished(), left().as_deref()) {
        (_, Some("")) => say_reason!("interrupted"),
        (_, Some(what)) => say_reason!("interrupted: {what}"),
        ([0, _], None) => say_reason!("interrupted: nothing was written"),
        ([finished, _], None) => say_reason!("interrupted: {} written, and no more", counted(finished as u64, "file")),
    }
    std::process::exit(130)
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
