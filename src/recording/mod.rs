//! Sessions as MCAP files: writing, reading, exporting. The only layer that names mcap.

mod columns;
mod error;
mod export;
mod message;
pub mod place;
mod reader;
mod recorder;
mod rows;
mod writer;

pub use columns::{Contents, Topic, read_columns};
pub use error::RecordingError;
pub use export::{Exported, export_csv};
pub use message::Message;
pub use reader::{Messages, Recorded, is_cut_off};
pub use recorder::{Recorder, WhenFull};
pub use writer::{Session, Written, nanoseconds};
