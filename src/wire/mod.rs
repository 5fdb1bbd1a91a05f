//! The messages: generated from `proto/flexcrank.proto`, and their conversion to and from domain types.

mod checkpoint;
mod commands;
mod telemetry;

pub use checkpoint::{checkpoint, recorded_checkpoint};
use commands::pulse_shape;
pub use commands::{BadCommand, pulse_message, pulse_request, replay_action, shape};
pub use telemetry::{Telemetry, stamp, timestamp};

pub use messages::*;

/// The types that the compiler generates from the proto.
#[allow(missing_docs, clippy::all)]
mod messages {
    include!(concat!(env!("OUT_DIR"), "/flexcrank.v1.rs"));
}

/// The `google.protobuf.FileDescriptorSet` of all messages, imports included.
pub const DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/flexcrank.bin"));

/// Protobuf package of all messages.
pub const PACKAGE: &str = "flexcrank.v1";
