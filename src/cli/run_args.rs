//! Arguments of `run`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Parser, ValueEnum};
use clap_complete::engine::{ArgValueCandidates, ArgValueCompleter, CompletionCandidate};

use super::bus_args::BusArgs;
use super::completions;
use super::foxglove::FoxgloveArgs;
use super::resume::ResumeArgs;
use super::ros2_args::Ros2Args;
use super::values::{flush_period, frames, pace, positive, positive_time, recording_size, services, spin, split};
use crate::bus::Name;
use crate::recording::Split;
use crate::runtime::{Overrun, Pace, Spin};
use crate::scene::builtin;
use crate::simulation::PublishRates;

/// The shadow at the best level of the scene.
pub(super) const BEST: &str = "best";

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank run --pace max --until 10
  flexcrank run --set rod.length_m=1.2 --set pulse.0.torque_nm=5
  flexcrank run mine.toml --name left --publish-hz all --no-record
  flexcrank run mine.toml other.toml --count 10 --publish-hz 50,loads=all
  flexcrank run --record soak.mcap --split 10min --flush 50ms --fsync
  flexcrank run leveled.toml --overrun degrade --spare
  flexcrank run --foxglove
  flexcrank run --resume recordings/crank.mcap
  flexcrank run --supervise --record crank.mcap
  flexcrank run --fixed-cost --until 2
  flexcrank run --ros2";

#[derive(Debug, Parser)]
pub(super) struct Args {
    /// Built-in scenes or TOML files. Several run side by side in one process.
    #[arg(default_value = builtin::DEFAULT, add = ArgValueCompleter::new(completions::scenes))]
    pub scene: Vec<String>,
    /// Number of services to run per scene.
    #[arg(long, value_name = "N", default_value = "1", value_parser = services)]
    pub count: u32,
    #[command(flatten)]
    pub resume: ResumeArgs,
    /// Name on the bus: keys are flexcrank/NAME/…. Default: crank, or crank-2, crank-3, … if that is taken; or the name of the
    /// resumed session. Several services are named NAME-001, NAME-002, …
    #[arg(long)]
    pub name: Option<Name>,
    /// Pace: real, max, simulated seconds per second, or lockstep: clients ask for the steps (flexcrank/NAME/advance).
    #[arg(long, default_value = "real", value_parser = pace)]
    pub pace: Pace,
    /// Finish with the first step at or after this simulated time: 10, 0.5, 200ms, 10min.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    pub until: Option<f64>,
    /// Publishing rate: samples per simulated second, or all; or by topic (displacements, angles, loads, energies):
    /// 50,angles=all,energies=10. Energies have the rate of loads unless named. Default: 200, or the rate of the resumed session.
    /// A vibration needs some 10 samples in a period: `check` names the rate for a link that bends faster than the default shows.
    #[arg(long, value_name = "HZ")]
    pub publish_hz: Option<PublishRates>,
    /// Policy for deadlines missed by more than a step: catch-up; skip (move the deadlines and report it); stop, with exit code 5; or
    /// degrade (go to a cheaper [[level]] of the scene before a deadline is missed, and back when there is room).
    #[arg(long, value_name = "POLICY", default_value = "catch-up")]
    pub overrun: Overruns,
    /// Compute each step at the next cheaper level too, on a thread of its own, and go on from there when a step would be late. Needs
    /// --overrun degrade, and three processors.
    #[arg(long)]
    pub spare: bool,
    /// For trials: at random times, steps take this many times as long.
    #[arg(long, hide = true, value_name = "FACTOR", value_parser = positive)]
    pub slow_solver: Option<f64>,
    /// Busy-wait for this long before each deadline instead of sleeping (0 disables it). auto adapts, so that one wake-up in a
    /// thousand is later; at most 200us and a fifth of the period. Default: auto for one service, 0 for several.
    #[arg(long, value_name = "TIME", value_parser = spin)]
    pub spin: Option<Spin>,
    /// Do not request real-time scheduling, locked memory and processors that stay awake.
    #[arg(long)]
    pub no_realtime: bool,
    /// Record to this file instead of recordings/NAME-TIME.mcap; several services record to numbered files.
    #[arg(long, value_name = "PATH", conflicts_with = "no_record")]
    pub record: Option<PathBuf>,
    /// Do not record.
    #[arg(long)]
    pub no_record: bool,
    /// Flush period: a crash loses at most what was recorded in this time.
    #[arg(long, value_name = "TIME", default_value = "200ms", conflicts_with = "no_record", value_parser = flush_period)]
    pub flush: Duration,
    /// At every flush, wait until the data is on the disk: a power failure loses no more either.
    #[arg(long, conflicts_with = "no_record")]
    pub fsync: bool,
    /// Record into numbered parts of at least this size or recorded time: 500MB, 10min. A part ends soon after the flush that
    /// reaches it, and is complete by itself.
    #[arg(long, value_name = "SIZE|TIME", conflicts_with = "no_record", value_parser = split)]
    pub split: Option<Split>,
    /// Stop recording before it exceeds this size, all parts together; the simulation goes on: 2GB.
    #[arg(long, value_name = "SIZE", conflicts_with = "no_record", value_parser = recording_size)]
    pub max_recording_size: Option<bytesize::ByteSize>,
    /// Also publish the mechanism as shapes for Foxglove and Lichtblick: foxglove.SceneUpdate, at 25 Hz or HZ.
    #[arg(long, value_name = "HZ", num_args = 0..=1, require_equals = true, default_missing_value = "25", value_parser = frames)]
    pub scene_updates: Option<f64>,
    #[command(flatten)]
    pub foxglove: FoxgloveArgs,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Give every step the same number of Newton corrections, the least that suffices. It is found at the start, in some seconds,
    /// and printed with the error that it adds. Steps are not cut at the edges of pulses.
    #[arg(long, conflicts_with = "resume")]
    pub fixed_cost: bool,
    /// Run another model beside the first on the same commands, and publish the difference; best: the best [[level]] of the scene, on
    /// a thread of its own, which measures the error that cheaper levels leave.
    #[arg(long, value_name = "MODEL|best", add = ArgValueCandidates::new(shadows))]
    pub shadow: Option<String>,
    /// Run even if another service on the bus has this name.
    #[arg(long)]
    pub force: bool,
    /// Run the service in a process of its own. If that is killed or crashes, start another that resumes its recording, equal to
    /// the bit, and records to PATH-resumed-1.mcap, and so on.
    #[arg(long, conflicts_with_all = ["no_record", "count", "shadow"])]
    pub supervise: bool,
    /// The recording that the supervisor chose for its service.
    #[arg(long, hide = true, requires = "supervise")]
    pub supervised_record: Option<PathBuf>,
    /// The recording that the supervisor lets its service resume.
    #[arg(long, hide = true, requires = "supervise")]
    pub supervised_resume: Option<PathBuf>,
    /// Run without the bus, for batches: the service takes no port and no name on it. With --foxglove, viewers still reach it.
    #[arg(long, conflicts_with_all = ["listen", "connect", "zenoh_config", "force", "ros2"])]
    pub no_bus: bool,
    #[command(flatten)]
    pub ros2: Ros2Args,
    #[command(flatten)]
    pub bus: BusArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Overruns {
    /// Hurry until deadlines are met again.
    CatchUp,
    /// Move all later deadlines.
    Skip,
    /// End the run.
    Stop,
    /// Go to a cheaper level of the scene before a deadline is missed, and back when there is room.
    Degrade,
}

impl From<Overruns> for Overrun {
    fn from(policy: Overruns) -> Self {
        match policy {
            Overruns::CatchUp => Overrun::CatchUp,
            Overruns::Skip => Overrun::Skip,
            Overruns::Stop => Overrun::Stop,
            Overruns::Degrade => Overrun::Degrade,
        }
    }
}

/// Values of `--shadow`.
fn shadows() -> Vec<CompletionCandidate> {
    completions::models().into_iter().chain([CompletionCandidate::new(BEST)]).collect()
}
