//! `control`: sends control commands to a service or replay.

use std::time::Duration;

use clap::Subcommand;
use clap_complete::engine::ArgValueCandidates;

use super::client_args::ClientArgs;
use super::completions;
use super::failure::{CommandResult, Failure};
use super::replay::rate;
use super::replies::{Answer, fresh_id, send_and_print, send_over};
use super::suspect_numbers::newly_suspect;
use super::values::{change, count, time};
use crate::bus::{BusError, Name, Session, client};
use crate::scene::SceneSource;
use crate::shown::shown_s;
use crate::wire::status::State;
use crate::wire::{self, CommandReply, Control, Next, Rate, ReplayControl, Seek, control, replay_control};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank control crank pause
  flexcrank control crank step 100
  flexcrank control crank start-recording take-2
  flexcrank control crank set slider.mass_kg=0.3 rod.damping_s=2e-4
  flexcrank control crank set solver.model=rigid solver.integrator=runge-kutta
  flexcrank control ghost seek 3.5
  flexcrank control ghost rate 2
  flexcrank control crank pause --wait=10s --json

--json prints id, accepted, reason, effective_step, effective_sim_time_s.";

/// Time in which a service replies, beside the one that it takes to an instant.
const BESIDE: Duration = Duration::from_secs(3);
/// Slowest pace whose instants are waited for, simulated seconds per second.
const SLOWEST: f64 = 0.01;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Name of the service or replay.
    #[arg(add = ArgValueCandidates::new(completions::services))]
    pub name: Name,
    #[command(subcommand)]
    pub action: Action,
    /// Print the reply as one line of JSON.
    #[arg(long, global = true)]
    pub json: bool,
    #[command(flatten)]
    pub client: ClientArgs,
}

#[derive(Debug, Clone, Subcommand)]
pub(super) enum Action {
    /// Pause the simulation or replay.
    Pause,
    /// Resume it.
    Resume,
    /// While paused, advance by COUNT steps; a replay advances by COUNT messages.
    Step {
        /// Number of steps or messages.
        #[arg(default_value = "1", value_parser = count)]
        count: u64,
    },
    /// Return to the start of the scene, or of the recording.
    Reset,
    /// End the run or the replay.
    Stop,
    /// Start a recording in the service's recordings folder.
    StartRecording {
        /// File name without a folder.
        file: Option<String>,
    },
    /// Stop the recording.
    StopRecording,
    /// Change the running scene, all keys or none: masses, stiffness, damping, loads, model, modes, mesh, integrator, step.
    Set {
        /// KEY=VALUE, as in `run --set`.
        #[arg(required = true, value_name = "KEY=VALUE", value_parser = change)]
        changes: Vec<String>,
    },
    /// Go on at a level of detail that the scene names.
    Level {
        /// Name of the level.
        name: String,
    },
    /// Replay only: jump to a recorded time.
    Seek {
        /// Recorded time since the first message.
        #[arg(value_parser = time)]
        time: f64,
    },
    /// Replay only: set the rate.
    Rate {
        /// Recorded seconds per second.
        #[arg(value_parser = rate)]
        factor: f64,
    },
    /// Replay only: while paused, play COUNT messages.
    Next {
        /// Number of messages.
        #[arg(default_value = "1", value_parser = count)]
        count: u64,
    },
}

pub(super) fn control(args: Args) -> CommandResult {
    let action = match args.action.clone() {
        Action::Pause => control::Action::Pause(wire::Pause {}),
        Action::Resume => control::Action::Resume(wire::Resume {}),
        Action::Step { count } => control::Action::Step(wire::Steps { count }),
        Action::Reset => control::Action::Reset(wire::Reset {}),
        Action::Stop => control::Action::Stop(wire::Stop {}),
        Action::StartRecording { file } => {
            control::Action::StartRecording(wire::StartRecording { name: file.unwrap_or_default() })
        }
        Action::StopRecording => control::Action::StopRecording(wire::StopRecording {}),
        Action::Level { name } => control::Action::Level(wire::Level { name }),
        Action::Set { changes } => control::Action::Set(wire::Set { changes }),
        Action::Seek { time } => {
            return control_replay(&args, replay_control::Action::Seek(Seek { time_s: time }));
        }
        Action::Rate { factor } => return control_replay(&args, replay_control::Action::Rate(Rate { factor })),
        Action::Next { count } => return control_replay(&args, replay_control::Action::Next(Next { count })),
    };
    let message = Control { id: fresh_id(), action: Some(action) };
    let session = args.client.open(&args.name)?;
    let changed = changed_scene(&session, &args.name, &args.action);
    if let (Action::Set { .. }, Some((running, after))) = (&args.action, &changed) {
        newly_suspect(&running.scene, &after.scene).iter().for_each(|warning| say!("warning: {warning}"));
    }
    let answer = Answer::to("command");
    answer.told(send_over(&session, args.json, |session| answer.noted(send(session, &args.name, &message, changed))))
}

/// Sends a command. A service replies to a longer step when it has come to an instant at which that can begin.
fn send(
    session: &Session,
    name: &Name,
    message: &Control,
    changed: Option<(SceneSource, SceneSource)>,
) -> Result<CommandReply, BusError> {
    let steps_s = changed.map(|(running, after)| [running.scene.solver.step_s, after.scene.solver.step_s]);
    let longer_s = steps_s.filter(|[running_s, after_s]| after_s > running_s).map(|[_, after_s]| after_s);
    let status = longer_s.and_then(|_| client::snapshot(session, name)?.status).filter(|status| status.state() == State::Running);
    let (Some(longer_s), Some(status)) = (longer_s, status) else { return client::control(session, name, message) };
    let latest_s = status.stamp.map_or(0.0, |stamp| stamp.sim_time_s) + longer_s;
    // A pace of its own, or none that is known yet.
    let wall_s = longer_s / status.real_time_factor.unwrap_or(0.0).clamp(SLOWEST, 1.0);
    client::control_later(session, name, message, BESIDE + Duration::from_secs_f64(2.0 * wall_s), || {
        say!(
            "no reply yet: steps of {longer_s} s begin at an instant that both steps reach, at t = {} s at the latest. Ctrl-C ends the \
             waiting, not the change",
            shown_s(latest_s)
        );
    })
}

/// The running scene, and the same with a change or at a level; `None` for other commands, and for what no running scene accepts: the
/// reply states the reason.
fn changed_scene(session: &Session, name: &Name, action: &Action) -> Option<(SceneSource, SceneSource)> {
    let running = || SceneSource::parse("scene.toml", &client::scene(session, name)?, &[]).ok();
    match action {
        Action::Set { changes } => {
            let running = running()?;
            let after = running.changed(changes).ok()?;
            Some((running, after))
        }
        Action::Level { name } => {
            let running = running()?;
            let level = running.scene.levels.iter().position(|level| level.name == *name)?;
            let after = running.at_level(level).ok()?;
            Some((running, after))
        }
        _ => None,
    }
}

/// Sends a command that only a replay accepts.
fn control_replay(args: &Args, action: replay_control::Action) -> CommandResult {
    let name = &args.name;
    let message = ReplayControl { id: fresh_id(), action: Some(action) };
    let answer = Answer::to("command");
    answer.told(send_and_print(&args.client, name, args.json, |session| {
        answer.noted(client::replay_control(session, name, &message).map_err(|error| match error {
            BusError::NoReply(_) => {
                let state = client::snapshot(session, name).and_then(|snapshot| snapshot.status).map(|status| status.state());
                let why = match state {
                    Some(State::Replaying) | None => format!("may not be a replay: {error}"),
                    Some(_) => "is a simulation: reset and step are its commands".to_owned(),
                };
                Failure::Failed(format!("only a replay accepts seek, rate and next, and `{name}` {why}"))
            }
            error => Failure::from(error),
        }))
    }))
}
