//! Where bus, recording and runtime meet: a live service, and a replayed one.

mod desk;
mod drawing;
mod error;
mod gaps;
mod live;
mod replay;

pub use desk::OnStatus;
pub use error::ServiceError;
pub use live::{Live, LiveReport, Member, Resumption, run, run_all};
pub use replay::{Action, BadRemap, Order, Orders, RATES, Remap, Replay, ReplayReport, replay};
