//! A message on its way into a recording.

/// A message to record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Key expression of its topic.
    pub topic: String,
    /// Fully qualified name of its protobuf type.
    pub schema: &'static str,
    /// Encoded message.
    pub payload: Vec<u8>,
    /// Session start plus simulated time since, ns since 1970.
    pub log_time_ns: u64,
    /// Wall clock, ns since 1970.
    pub publish_time_ns: u64,
    /// Whether a new part of the recording may begin with this message: a full state.
    pub begins_part: bool,
}
