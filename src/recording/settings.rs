//! How a session is written to its file or files.

use std::time::Duration;

/// What to do when the queue to the disk is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WhenFull {
    /// Wait: nothing is lost, the simulation slows down.
    Wait,
    /// Leave the message out and say so.
    Drop,
}

/// When a session goes on in a new file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// When the file has reached so many bytes.
    Bytes(u64),
    /// When it spans so much recorded time.
    Time(Duration),
}

/// How to record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// A crash of the program loses at most what was recorded in this time.
    pub flush_period: Duration,
    /// Wait at every flush until the disk has it: then a crash of the machine loses no more either.
    pub fsync: bool,
    /// Go on in numbered parts.
    pub split: Option<Split>,
    /// End before the file, or all parts together, have more bytes than this.
    pub limit_bytes: Option<u64>,
    /// What to do when the disk is too slow.
    pub when_full: WhenFull,
}
