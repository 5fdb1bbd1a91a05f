//! `replay`: publishes a recording on the bus, with control from the bus and the keyboard.

use std::cell::Cell;
use std::path::PathBuf;
use std::sync::mpsc::channel;
use std::time::Duration;

use clap_complete::engine::ArgValueCompleter;
use indicatif::ProgressBar;
use tokio::sync::oneshot;

use super::async_runtime::runtime;
use super::bus_args::BusArgs;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::foxglove::{FoxgloveArgs, Viewers};
use super::keyboard::Keyboard;
use super::progress::bar;
use super::ros2_args::{Nodes, Ros2Args};
use super::service_names::on_the_bus;
use super::signals::interrupted;
use super::values::{number, positive_time, programs, time};
use crate::bus::{self, BusOptions, Name};
use crate::runtime::DurationQuantiles;
use crate::service::{self, OnStatus, RATES, Remap, ReplayAction, ReplayCommand, ReplayReport, ServiceError};
use crate::wire::Status;

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank replay recordings/crank.mcap
  flexcrank replay recordings/crank.mcap --rate 0.5 --start-offset 3 --duration 2 --loop --name ghost
  flexcrank replay recordings/crank.mcap --foxglove
  flexcrank replay recordings/crank.mcap --wait-for 1 --topics angles,loads
  flexcrank replay robot.mcap --remap /joint_states:=robot/joints
  flexcrank control ghost seek 3.5    (and pause, resume, rate 2, next, stop)

On the keyboard: space pauses and resumes, left and right seek 5 s, up and down change the rate by 10 %, n plays \
    the next message when paused, Home goes back to the start, q ends.

Any MCAP file is replayed: its topics become keys, without a leading slash; payloads are not touched. `status`, checkpoints \
    and, without --commands, commands of a flexcrank recording are left out: the replayer has a status of its own.";

#[derive(Debug, clap::Args)]
pub(super) struct ReplayArgs {
    /// The recording.
    #[arg(add = ArgValueCompleter::new(completions::recordings))]
    pub file: PathBuf,
    /// Recorded seconds per second.
    #[arg(long, short, default_value = "1", value_parser = rate)]
    pub rate: f64,
    /// Start again at the end, until interrupted.
    #[arg(long = "loop", short)]
    pub looped: bool,
    /// Skip this recorded time at the start.
    #[arg(long, value_name = "TIME", default_value = "0", value_parser = time)]
    pub start_offset: f64,
    /// Play only this recorded time.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    pub duration: Option<f64>,
    /// Start paused.
    #[arg(long)]
    pub start_paused: bool,
    /// Wait for this time before the first message.
    #[arg(long, value_name = "TIME", default_value = "0", value_parser = time)]
    pub delay: f64,
    /// Play only these recorded topics, by name or last chunks: angles, /tf. --commands adds the commands.
    #[arg(long, value_name = "TOPIC", value_delimiter = ',')]
    pub topics: Vec<String>,
    /// Publish a topic, or all that begin with OLD/, under another key; status, checkpoints and commands are left out there,
    /// too. If none stays below flexcrank/NAME/, the service is `replay`, unless --name says otherwise.
    #[arg(long, value_name = "OLD:=NEW")]
    pub remap: Vec<Remap>,
    /// Name of the service on the bus instead of the recorded one.
    #[arg(long)]
    pub name: Option<Name>,
    /// Also publish recorded commands, on `commands` with their replies, and on their own keys, whether --topics names them or not.
    #[arg(long)]
    pub commands: bool,
    /// Wait until N programs subscribe to the played topics, and no subscription has come for 0.2 s. Programs behind one router
    /// count as one.
    #[arg(long, value_name = "N", default_value = "0", value_parser = programs)]
    pub wait_for: usize,
    /// Wait at most this long for --wait-for.
    #[arg(long, value_name = "TIME", default_value = "1min", requires = "wait_for", value_parser = time)]
    pub wait_timeout: f64,
    /// Replay even if another service on the bus has this name.
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub ros2: Ros2Args,
    #[command(flatten)]
    pub foxglove: FoxgloveArgs,
    #[command(flatten)]
    pub bus: BusArgs,
}

/// A rate within the limits of replays.
pub(super) fn rate(text: &str) -> Result<f64, String> {
    number(text, *RATES.start(), *RATES.end())
}

pub(super) fn replay(args: ReplayArgs) -> CommandResult {
    Viewers::check(args.foxglove)?;
    // Beside viewers, too, a replay goes on at its end.
    let (domain, endless) = (args.ros2.domain()?, args.looped || args.foxglove.is_given());
    let bus = BusOptions { sees_subscriptions: args.wait_for > 1, gossip: domain.is_some(), ..args.bus.options() };
    let mut replay = service::ReplayOptions {
        file: args.file,
        rate: args.rate,
        looped: args.looped,
        start_offset_s: args.start_offset,
        duration_s: args.duration,
        start_paused: args.start_paused,
        delay: Duration::from_secs_f64(args.delay),
        topics: args.topics,
        remaps: args.remap,
        name: args.name,
        commands: args.commands,
        wait_for: args.wait_for,
        wait_timeout: Duration::from_secs_f64(args.wait_timeout),
        force: args.force,
        endpoints: Vec::new(),
    };
    let (sender, commands) = channel();
    let was_interrupted = Cell::new(false);
    let bar = bar(0, "{bar:30} {msg}");
    let shown = bar.clone();
    let report = runtime()?.block_on(async {
        let interrupted = interrupted();
        // Dropping the keyboard restores the terminal, however the replay ends.
        let _keyboard = Keyboard::listen(&sender);
        let (session, endpoints) = bus.open_listening()?;
        replay.endpoints.clone_from(&endpoints);
        let (player, own) = (session.clone(), sender.clone());
        let file = replay.file.display().to_string();
        let (runtime, driver, foxglove) = (tokio::runtime::Handle::current(), sender.clone(), args.foxglove);
        let (over, ended) = oneshot::channel();
        // The player has a thread of its own.
        let playing = std::thread::Builder::new().name("playing".to_owned()).spawn(move || {
            let (mut viewers, mut nodes) = (Viewers::default(), Nodes::default());
            let report = service::replay_beside(&player, &replay, (own, commands), |start| {
                let status_bar = shown.clone();
                let on_status: OnStatus = Box::new(move |status| show(&status_bar, status));
                let started = Viewers::beside_replay(foxglove, &player, start, driver, on_status);
                let viewer;
                (viewers, viewer) = runtime.block_on(started)?;
                nodes = Nodes::start(&player, std::iter::once(start.name), domain, false)?;
                let places = [Some(on_the_bus(start.name, &endpoints)), viewers.place(), Nodes::place(start.name, domain)];
                let places = places.into_iter().flatten().collect::<Vec<_>>().join("; ");
                shown.suspend(|| say!("replaying {file} {places}"));
                Ok(viewer)
            });
            let stopped = runtime.block_on(viewers.stop()).and(nodes.close());
            // The receiver is gone after an interruption.
            let _ = over.send(());
            report.map_err(Failure::from).and_then(|report| stopped.map(|()| report))
        })?;
        tokio::select! {
            _ = ended => {}
            // The replay may have ended already: then it needs no command.
            () = interrupted => {
                was_interrupted.set(true);
                drop(sender.send(ReplayCommand::quiet(ReplayAction::Stop)));
            }
        }
        let report = playing.join().map_err(|_| ServiceError::Died("playing"))?;
        bus::close(&session)?;
        report
    });
    bar.finish_and_clear();
    let done = conclude(&report?);
    // A replay without an end is over when it is interrupted.
    let early = was_interrupted.get() && !endless;
    if early {
        say_reason!("interrupted before the end of the recording");
    }
    Ok(if early && done == ExitStatus::Success { ExitStatus::Interrupted } else { done })
}

/// Prints the result of a replay.
fn conclude(report: &ReplayReport) -> ExitStatus {
    let rate = report.achieved_rate.map_or(String::new(), |rate| format!(" at {rate:.4} times the recorded speed"));
    let late = report.lateness.map_or(String::new(), |DurationQuantiles { p50_s, p99_s, max_s, .. }| {
        format!("; late by {:.3} ms (p50), {:.3} ms (p99), {:.3} ms (max)", p50_s * 1e3, p99_s * 1e3, max_s * 1e3)
    });
    say!("replayed {} messages as flexcrank/{}{rate}{late}", report.messages, report.name);
    if report.slips > 0 {
        say!("warning: fell behind by more than a second {} times, without catching up", report.slips);
    }
    for topic in &report.left_out {
        say_reason!("warning: left out {topic}");
    }
    if report.cut_off {
        say_reason!("warning: the recording ends early (still being recorded, or cut off); everything before was replayed");
    }
    if report.cut_off || !report.left_out.is_empty() { ExitStatus::Lossy } else { ExitStatus::Success }
}

fn show(bar: &ProgressBar, status: &Status) {
    let (Some(replay), Some(stamp)) = (&status.replay, &status.stamp) else { return };
    bar.set_length((replay.duration_s * 1e3) as u64);
    bar.set_position((stamp.sim_time_s * 1e3) as u64);
    let late = status.lateness_p99_s.map_or(String::new(), |late| format!("  late p99 {:.3} ms", late * 1e3));
    let paused = if replay.paused { "  paused" } else { "" };
    bar.set_message(format!("{:.1} of {:.1} s  rate {:.3}{late}{paused}", stamp.sim_time_s, replay.duration_s, replay.rate));
}
