//! Sessions as MCAP files: writing, reading, exporting. The only layer that names mcap.

pub mod build;
mod columns;
mod error;
mod export;
mod facts;
mod message;
mod parse;
pub mod place;
mod reader;
mod recorder;
mod recover;
mod rows;
mod settings;
mod writer;

pub use columns::{Contents, Topic, read_columns};
pub use error::RecordingError;
pub use export::{Exported, export_csv};
pub use facts::{Session, nanoseconds};
pub use message::Message;
pub use reader::{Messages, Recorded, is_cut_off};
pub use recorder::Recorder;
pub use recover::{Loss, Recovered, recover};
pub use settings::{Settings, Split, WhenFull};
pub use writer::Written;
