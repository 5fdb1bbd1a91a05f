//! Sessions as MCAP files: writing, reading, exporting. The only layer that names mcap.

mod about;
pub mod build;
mod chunk;
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
mod source;
mod summary;
mod walk;
mod writer;

pub use about::About;
pub use columns::{Contents, Topic, read_columns};
pub use error::RecordingError;
pub use export::{Export, Exported, export};
pub use facts::{Session, log_time_ns, nanoseconds};
pub use message::Message;
pub use reader::{Channel, Messages, Recorded, is_cut_off};
pub use recorder::Recorder;
pub use recover::{Loss, Recovered, recover};
pub use rows::scalars;
pub use settings::{Settings, Split, WhenFull};
pub use source::Source;
pub use walk::{Damage, Found, Going, Structure, walk};
pub use writer::{SessionWriter, Written};
