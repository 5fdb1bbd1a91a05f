//! Recordings: sessions as MCAP files, written, read, recovered and exported. Only this layer uses the mcap library.

pub mod build_info;
mod error;
mod export;
mod format;
mod message;
mod metadata;
mod parse;
pub mod paths;
mod reader;
mod recorder;
mod recording_file;
mod records;
mod recover;
mod rows;
mod session_info;
mod settings;
mod summary;
mod topic_columns;
mod walk;
mod writer;

pub use error::RecordingError;
pub use export::{Export, Exported, export};
pub use format::{Channel, RecordedMessage};
pub use message::Message;
pub use metadata::RecordingMetadata;
pub use reader::{Messages, is_cut_off};
pub use recorder::Recorder;
pub use recording_file::RecordingFile;
pub use recover::{Loss, Recovered, recover};
pub use rows::scalars;
pub use session_info::{SessionInfo, log_time_ns, nanoseconds};
pub use settings::{Settings, Split, WhenFull};
pub use topic_columns::{Contents, TopicColumns, read_columns};
pub use walk::{Damage, Structure, WalkFlow, WalkItem, walk};
pub use writer::{SessionWriter, Written};
