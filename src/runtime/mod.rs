//! The stepping thread and its queues: pacing by absolute deadlines, commands in, samples out.

mod approach;
mod command;
mod lateness;
mod memory;
mod output;
mod pacer;
mod rate;
mod shadow;
mod stepper;

pub use approach::{Approach, approach};
pub use command::{Command, Counts, Inbox, ReplyTo, Request, inbox};
pub use lateness::Lateness;
pub(crate) use memory::Memory;
pub use output::{Missed, Output, RecordingRequest};
pub use pacer::{Pace, Pacer};
pub use rate::{BadRate, PublishRate};
pub use shadow::Shadow;
pub use stepper::{Ending, Ports, Stepper, Stepping};
