//! The messages: generated from `proto/flexcrank.proto`, and their conversion to and from domain types.

mod account;
mod checkpoint;
mod commands;
mod scene_update;
mod shape;
mod telemetry;

pub use checkpoint::{checkpoint, recorded_checkpoint};
use commands::pulse_shape;
pub use commands::{BadCommand, pulse_message, pulse_request, replay_action, shape};
pub use scene_update::scene_update;
pub use shape::{bending, bent_line, by_link};
pub use telemetry::{Telemetry, stamp, timestamp};

pub use messages::*;

/// The types that the compiler generates from the proto.
#[allow(missing_docs, clippy::all)]
mod messages {
    include!(concat!(env!("OUT_DIR"), "/flexcrank.v1.rs"));
}

/// What viewers know: generated from `proto/foxglove`.
#[allow(missing_docs, clippy::all)]
pub mod foxglove {
    include!(concat!(env!("OUT_DIR"), "/foxglove.rs"));
}

/// The `google.protobuf.FileDescriptorSet` of all our own messages, imports included.
pub const DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/flexcrank.bin"));

/// That of the messages that viewers know.
const FOXGLOVE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/foxglove.bin"));

/// The descriptor set of everything that is published.
pub const EVERY_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/every.bin"));

/// The descriptor set that has a message of this fully qualified name, and no more than it needs.
pub fn descriptor_set(schema: &str) -> &'static [u8] {
    if schema.starts_with("foxglove.") { FOXGLOVE_DESCRIPTOR_SET } else { DESCRIPTOR_SET }
}

/// Protobuf package of all messages.
pub const PACKAGE: &str = "flexcrank.v1";
