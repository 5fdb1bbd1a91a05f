//! The messages generated from `proto/flexcrank.proto`, and their conversion to and from domain types.

mod account;
mod checkpoint;
mod commands;
mod rates;
mod run;
mod scene_update;
mod shape;
mod telemetry;
mod topic;

pub use checkpoint::{checkpoint, recorded_checkpoint};
pub use commands::{
    BadCommand, advance_message, advance_request, pulse_message, pulse_request, replay_action, setpoint_message,
    setpoint_request, shape,
};
pub use rates::BadRates;
pub use run::shadow;
pub use scene_update::scene_update;
pub use shape::{bending, bent_line, by_link};
pub use telemetry::{stamp, timestamp};
pub use topic::{Message, ROOT, Topic};

pub use messages::*;

/// The generated types.
#[allow(missing_docs, clippy::all)]
mod messages {
    include!("../../proto/generated/flexcrank.v1.rs");
}

/// Messages for viewers, generated from `proto/foxglove`.
#[allow(missing_docs, clippy::all)]
pub mod foxglove {
    include!("../../proto/generated/foxglove.rs");
}

/// The `google.protobuf.FileDescriptorSet` of all flexcrank messages, with imports.
pub const DESCRIPTOR_SET: &[u8] = include_bytes!("../../proto/generated/flexcrank.bin");

/// The descriptor set of the viewers' messages.
const FOXGLOVE_DESCRIPTOR_SET: &[u8] = include_bytes!("../../proto/generated/foxglove.bin");

/// The descriptor set of everything published.
pub const EVERY_DESCRIPTOR_SET: &[u8] = include_bytes!("../../proto/generated/every.bin");

/// Returns the smallest descriptor set that has a message of this fully qualified name.
pub fn descriptor_set(schema: &str) -> &'static [u8] {
    if schema.starts_with("foxglove.") { FOXGLOVE_DESCRIPTOR_SET } else { DESCRIPTOR_SET }
}
