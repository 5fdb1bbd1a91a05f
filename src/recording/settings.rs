//! Settings of a recording: flushing, parts, size limit.

use std::time::Duration;

/// Policy when the queue to the disk is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WhenFull {
    /// Wait: nothing is lost, but the simulation slows down.
    Wait,
    /// Drop the message and report it.
    Drop,
}

/// When a session continues in a new file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// When the file reaches this size, bytes.
    Bytes(u64),
    /// When the file spans this recorded time.
    Time(Duration),
}

/// Settings of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// A crash of the program loses at most what was recorded in this time.
    pub flush_period: Duration,
    /// At every flush, wait for the disk: a crash of the machine loses no more either.
    pub fsync: bool,
    /// Record in numbered parts.
    pub split: Option<Split>,
    /// Size limit of the file, or of all parts together, bytes.
    pub limit_bytes: Option<u64>,
    /// Policy when the disk is too slow.
    pub when_full: WhenFull,
}
