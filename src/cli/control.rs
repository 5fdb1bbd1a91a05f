//! `control`: sends control commands to a service or replay.

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
    if let Action::Set { changes } = &args.action {
        warn_of_suspect_changes(&session, &args.name, changes);
    }
    let answer = Answer::to("command");
    answer.told(send_over(&session, args.json, |session| answer.noted(send(session, &args, &message))))
}

/// Sends a command. A service replies to a longer step once it has come to an instant at which that can hold: until then, the command is
/// sent again under its id.
fn send(session: &Session, args: &Args, message: &Control) -> Result<CommandReply, BusError> {
    let longer = longer_step(session, &args.name, &args.action);
    let mut is_told = false;
    loop {
        match (client::control(session, &args.name, message), &longer) {
            (Err(BusError::NoReply(_)), Some(longer)) if longer.may_still_come(session, &args.name) => {
                if !is_told {
                    say!(
                        "steps of {} s begin at an instant that both steps reach, at t = {} s at the latest: waiting for it. Ctrl-C ends the \
                         waiting, not the change",
                        longer.step_s,
                        shown_s(longer.latest_s)
                    );
                }
                is_told = true;
            }
            (reply, _) => return reply,
        }
    }
}

/// Steps longer than those of the running service, that it was asked for.
struct LongerStep {
    step_s: f64,
    /// Simulated time at which they begin at the latest, s.
    latest_s: f64,
}

impl LongerStep {
    fn may_still_come(&self, session: &Session, name: &Name) -> bool {
        let now_s = running_at_s(session, name);
        now_s.is_some_and(|now_s| now_s <= self.latest_s)
    }
}

/// The longer step that a command asks for, if it does.
fn longer_step(session: &Session, name: &Name, action: &Action) -> Option<LongerStep> {
    if !matches!(action, Action::Set { .. } | Action::Level { .. }) {
        return None;
    }
    let running = SceneSource::parse("scene.toml", &client::scene(session, name)?, &[]).ok()?;
    let after = match action {
        Action::Set { changes } => running.changed(changes).ok()?,
        Action::Level { name } => running.at_level(running.scene.levels.iter().position(|level| level.name == *name)?).ok()?,
        _ => return None,
    };
    let step_s = after.scene.solver.step_s;
    (step_s > running.scene.solver.step_s).then_some(LongerStep { step_s, latest_s: running_at_s(session, name)? + step_s })
}

/// Simulated time of the last status of a service that runs, s.
fn running_at_s(session: &Session, name: &Name) -> Option<f64> {
    let status = client::snapshot(session, name)?.status.filter(|status| status.state() == State::Running)?;
    Some(status.stamp?.sim_time_s)
}

/// Warns of numbers that look like mistakes in the changed scene, unless the running one has them already. A change that no running
/// scene accepts gets no warning: the reply states the reason.
fn warn_of_suspect_changes(session: &Session, name: &Name, changes: &[String]) {
    let Some(text) = client::scene(session, name) else { return };
    let running = SceneSource::parse("scene.toml", &text, &[]);
    let suspects = running.and_then(|before| Ok(newly_suspect(&before.scene, &before.changed(changes)?.scene)));
    suspects.iter().flatten().for_each(|warning| say!("warning: {warning}"));
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
