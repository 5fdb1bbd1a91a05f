//! Limits and types of the MCAP format that all readers share.

use mcap::read::ChannelAccumulator;

/// Size limit of records and chunks, bytes. A file that states a larger one is refused.
pub(super) const RECORD_LIMIT: usize = 64 * 1024 * 1024;

/// Largest single read, bytes, so that a wrong length allocates no memory.
pub(super) const PIECE: usize = 64 * 1024;

/// A topic of a recording, with its encoding and schema.
pub type Channel = mcap::Channel<'static>;

/// A message of a recording.
pub type RecordedMessage = mcap::Message<'static>;

/// Channels and schemas read so far.
pub(super) type Channels = ChannelAccumulator<'static>;

/// Size of the opcode and length before every record, bytes.
pub(super) const RECORD_HEAD: u64 = 9;
