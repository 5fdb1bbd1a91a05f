//! The stepping thread and its queues: absolute deadlines, commands in, samples out.
//!
//! **Lateness** is the time from a step's deadline to the instant at which its solver can run its first instruction. The step from
//! t to t + h has its deadline when the clock of the deadlines shows t. Steps that share a wake-up have a deadline each.
//!
//! **Age** of a sample is the time from its step's deadline until all messages of the sample are handed to the bus.

mod command;
mod deadline_wait;
mod duration_histogram;
mod governor;
mod ladder;
mod missed_deadlines;
mod output;
mod pacer;
mod realtime;
mod reply;
mod reply_cache;
mod scene_change;
mod shadow;
mod slowdown;
mod spin;
mod status;
mod step_error_histogram;
mod step_worker;
mod stepper;
mod stepping_thread;

pub use command::{Action, Command, Inbox, Request, SharedState, inbox};
pub use deadline_wait::{DeadlineWait, deadline_wait};
pub use duration_histogram::{DurationBins, DurationHistogram, DurationQuantiles};
pub use governor::{Governor, LevelCost};
pub use ladder::{Ladder, SceneInForce};
pub use missed_deadlines::{CauseCount, Miss, MissCause, MissReport};
pub use output::{Advanced, Answer, MissedSamples, Outbox, Output};
pub use pacer::{GIVE_UP, Overrun, Pace, Pacer};
pub(crate) use realtime::{exact_timers, yield_to_others};
pub use reply::{Reply, ReplyTo, Response, StateAfter};
pub(crate) use reply_cache::ReplyCache;
pub use scene_change::{PreparedChange, Successor};
pub use shadow::{ModelDifference, ShadowSimulation, StateDifference, difference};
pub use slowdown::Slowdown;
pub use spin::{BadSpin, Spin};
pub use status::{OverrunCounts, RunPhase, RunStatus};
pub use step_error_histogram::{StepErrorHistogram, StepErrorQuantiles};
pub(crate) use stepper::{
    CHECKPOINT_PERIOD_S, GOVERNED, beyond_range, is_distrust, is_expiry, setpoint_warning, unbalanced, warning,
};
pub use stepper::{Ending, Ports, RunSummary, STATUS_PERIOD, Stepper, SteppingOptions};
pub use stepping_thread::{Finish, ThreadOptions, run_stepping_thread};
