//! Live services and replays: the layer that joins bus, recording and runtime.

mod advance_answers;
mod applied;
mod beside;
mod best_level;
mod best_level_output;
mod burst;
mod drop_ledger;
mod error;
mod live;
mod live_modes;
mod output_thread;
mod output_worker;
mod replay;
mod scene_changer;
mod scene_update_timer;
mod status;

pub use error::ServiceError;
pub use live::{LiveOptions, LiveReport, LiveSimulation, Resumption, SecondRun, run, run_all};
pub use output_worker::OnStatus;
pub use replay::{
    BadRemap, RATES, Remap, ReplayAction, ReplayCommand, ReplayCommands, ReplayOptions, ReplayReport, ReplayStart, ReplayViewer,
    replay, replay_beside,
};
