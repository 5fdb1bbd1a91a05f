//! Exit codes of commands that ran to their end.

use std::process::ExitCode;

/// The end of a command, by exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ExitStatus {
    /// Success: 0.
    Success,
    /// A service refused the command, or a file is unreadable or not as it should be: 1.
    Refused,
    /// Finished with losses: 3.
    Lossy,
    /// The simulation diverged: 4.
    Diverged,
    /// A deadline was missed with `--overrun stop`: 5.
    Late,
    /// Finished, but the energy balance was off: 6.
    Untrusted,
    /// The exit code of a supervised service.
    OfService(u8),
    /// Interrupted by a signal before the requested end: 130.
    Interrupted,
}

impl ExitStatus {
    /// The graver end of two files: 1 before 3, and 3 before 0.
    pub(super) fn graver(self, other: Self) -> Self {
        let ends = [self, other];
        [ExitStatus::Refused, ExitStatus::Lossy].into_iter().find(|grave| ends.contains(grave)).unwrap_or(other)
    }
}

impl From<ExitStatus> for ExitCode {
    fn from(status: ExitStatus) -> Self {
        ExitCode::from(match status {
            ExitStatus::Success => 0,
            ExitStatus::Refused => 1,
            ExitStatus::Lossy => 3,
            ExitStatus::Diverged => 4,
            ExitStatus::Late => 5,
            ExitStatus::Untrusted => 6,
            ExitStatus::OfService(code) => code,
            ExitStatus::Interrupted => 130,
        })
    }
}
