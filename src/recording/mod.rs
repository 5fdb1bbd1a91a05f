//! Sessions as MCAP files: writing, reading, exporting. The only layer that names mcap.

mod about;
pub mod build;
mod chunk;
mod error;
mod export;
mod message;
mod parse;
pub mod place;
mod reader;
mod recorder;
mod recording_file;
mod recover;
mod rows;
mod session_info;
mod settings;
mod summary;
mod topic_columns;
mod walk;
mod writer;

pub use about::About;
pub use error::RecordingError;
pub use export::{Export, Exported, export};
pub use message::Message;
pub use reader::{Channel, Messages, Recorded, is_cut_off};
pub use recorder::Recorder;
pub use recording_file::RecordingFile;
pub use recover::{Loss, Recovered, recover};
pub use rows::scalars;
pub use session_info::{SessionInfo, log_time_ns, nanoseconds};
pub use settings::{Settings, Split, WhenFull};
pub use topic_columns::{Contents, TopicColumns, read_columns};
pub use walk::{Damage, Found, Going, Structure, walk};
pub use writer::{SessionWriter, Written};
