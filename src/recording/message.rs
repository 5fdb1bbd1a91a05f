//! A message as it is recorded.

/// One message on its way into a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// The key expression it was published under.
    pub topic: String,
    /// Fully qualified name of its protobuf type.
    pub schema: &'static str,
    /// Its bytes.
    pub payload: Vec<u8>,
    /// Session start plus simulated time elapsed, ns since 1970.
    pub log_time_ns: u64,
    /// Wall clock, ns since 1970.
    pub publish_time_ns: u64,
    /// Whether a part of a recording may begin with it: a full state.
    pub begins_part: bool,
}
