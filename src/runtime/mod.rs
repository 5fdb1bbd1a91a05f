//! The stepping thread and its queues: pacing by absolute deadlines, commands in, samples out.

mod approach;
mod command;
mod drive;
mod memory;
mod misses;
mod output;
mod pacer;
mod rate;
mod rates;
mod realtime;
mod shadow;
mod spread;
mod step_error;
mod stepper;
mod waiting;

pub use approach::{Approach, approach};
pub use command::{Command, Counts, Inbox, ReplyTo, Request, inbox};
pub use drive::{Finish, Waking, drive};
pub(crate) use memory::Memory;
pub use output::{Missed, MissedByTopic, Outbox, Output, RecordingRequest};
pub use pacer::{GIVE_UP, Overrun, Pace, Pacer};
pub use rate::{BadRate, PublishRate};
pub use rates::{BadRates, Due, PublishRates, TELEMETRY};
pub(crate) use realtime::exact_timers;
pub use shadow::Shadow;
pub use spread::Spread;
pub(crate) use stepper::unbalanced;
pub use stepper::{Ended, Ending, Ports, Stepper, Stepping};
pub use waiting::{BadSpin, Spin};
