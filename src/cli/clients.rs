//! `list`, `pulse` and `control`: short requests to services.

use std::io::Write as _;
use std::path::Path;
use std::time::SystemTime;

use super::args::{Action, Bus, ControlArgs, PulseArgs};
use super::sequence::{self, ListedPulse};
use super::{ExitStatus, shown_s};
use crate::bus::{self, BusError, Name, Session, client};
use crate::simulation::PulseRequest;
use crate::wire::{self, CommandReply, Control, Next, Rate, ReplayControl, Seek, control, replay_control};

pub(super) fn list(args: &Bus) -> anyhow::Result<ExitStatus> {
    let session = args.options().open_client()?;
    let found = client::services(&session, client::DISCOVERY_TIMEOUT / 2, |_| false)?;
    bus::close(&session)?;
    for name in &found {
        writeln!(std::io::stdout(), "{name}")?;
    }
    if found.is_empty() { Err(BusError::NoLocalService.into()) } else { Ok(ExitStatus::Success) }
}

pub(super) fn pulse(args: PulseArgs) -> anyhow::Result<ExitStatus> {
    if let Some(file) = &args.from {
        return sequence(&args.bus, &args.name, file);
    }
    let request = PulseRequest {
        torque_nm: args.torque.unwrap_or_default(),
        duration_s: args.duration.unwrap_or_default(),
        delay_s: args.delay,
        shape: args.shape.into(),
    };
    let message = wire::pulse_message(&args.id.unwrap_or_else(fresh_id), &request);
    send_and_print(&args.bus, &args.name, |session| client::pulse(session, &args.name, &message))
}

/// Sends the pulses of a file in order; stops at the first refusal.
fn sequence(bus: &Bus, name: &Name, file: &Path) -> anyhow::Result<ExitStatus> {
    let pulses = sequence::read(file)?;
    let session = bus.options().open_client()?;
    let done =
        client::wait_for_service(&session, name).map_err(anyhow::Error::from).and_then(|()| send_all(&session, name, &pulses));
    bus::close(&session)?;
    done
}

fn send_all(session: &Session, name: &Name, pulses: &[ListedPulse]) -> anyhow::Result<ExitStatus> {
    let own = fresh_id();
    for ListedPulse { line, id, request } in pulses {
        let id = id.clone().unwrap_or_else(|| format!("{own}-{line}"));
        let message = wire::pulse_message(&id, request);
        // A retry under the same id is not applied again if only the reply was lost.
        let again = |_| client::pulse(session, name, &message);
        let reply = client::pulse(session, name, &message).or_else(again).or_else(again)?;
        let mut out = std::io::stdout();
        if !reply.accepted {
            writeln!(out, "line {line}: refused: {}", reply.reason)?;
            return Ok(ExitStatus::Refused);
        }
        let reason = if reply.reason.is_empty() { String::new() } else { format!(" ({})", reply.reason) };
        writeln!(
            out,
            "line {line}: takes effect in step {}, at t = {} s{reason}",
            reply.effective_step,
            shown_s(reply.effective_sim_time_s)
        )?;
    }
    Ok(ExitStatus::Success)
}

pub(super) fn control(args: ControlArgs) -> anyhow::Result<ExitStatus> {
    let action = match args.action {
        Action::Pause => control::Action::Pause(wire::Pause {}),
        Action::Resume => control::Action::Resume(wire::Resume {}),
        Action::Step { count } => control::Action::Step(wire::Steps { count }),
        Action::Reset => control::Action::Reset(wire::Reset {}),
        Action::Stop => control::Action::Stop(wire::Stop {}),
        Action::StartRecording { file } => {
            control::Action::StartRecording(wire::StartRecording { name: file.unwrap_or_default() })
        }
        Action::StopRecording => control::Action::StopRecording(wire::StopRecording {}),
        Action::Seek { time } => {
            return control_replay(&args.bus, &args.name, replay_control::Action::Seek(Seek { time_s: time }));
        }
        Action::Rate { factor } => return control_replay(&args.bus, &args.name, replay_control::Action::Rate(Rate { factor })),
        Action::Next { count } => return control_replay(&args.bus, &args.name, replay_control::Action::Next(Next { count })),
    };
    let message = Control { id: fresh_id(), action: Some(action) };
    send_and_print(&args.bus, &args.name, |session| client::control(session, &args.name, &message))
}

/// Sends a command that only a replay accepts.
fn control_replay(bus: &Bus, name: &Name, action: replay_control::Action) -> anyhow::Result<ExitStatus> {
    let message = ReplayControl { id: fresh_id(), action: Some(action) };
    let done = send_and_print(bus, name, |session| client::replay_control(session, name, &message));
    done.map_err(|error| match error.downcast_ref() {
        Some(BusError::NoReply(_)) => {
            error.context(format!("only a replay accepts seek, rate and next, and `{name}` may not be a replay"))
        }
        _ => error,
    })
}

/// Finds the service, sends one command, prints the reply.
fn send_and_print(
    bus: &Bus,
    name: &Name,
    say: impl FnOnce(&Session) -> Result<CommandReply, BusError>,
) -> anyhow::Result<ExitStatus> {
    let session = bus.options().open_client()?;
    let reply = client::wait_for_service(&session, name).and_then(|()| say(&session));
    bus::close(&session)?;
    let reply = reply?;
    writeln!(std::io::stdout(), "{}", format_reply(&reply))?;
    Ok(if reply.accepted { ExitStatus::Success } else { ExitStatus::Refused })
}

/// Formats a reply, with its command's id if it has one.
pub(super) fn format_reply(reply: &CommandReply) -> String {
    let CommandReply { id, accepted, reason, effective_step, effective_sim_time_s } = reply;
    if !accepted {
        return format!("refused: {reason}");
    }
    let reason = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
    let id = if id.is_empty() { String::new() } else { format!(" (id {id})") };
    // A replay has no steps.
    if *effective_step == 0 {
        return format!("accepted{reason}: at {effective_sim_time_s:.3} s of the recording{id}");
    }
    format!("accepted{reason}: takes effect in step {effective_step}, at t = {} s{id}", shown_s(*effective_sim_time_s))
}

/// A unique command id, from process id and time.
pub(super) fn fresh_id() -> String {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    format!("{:x}-{:x}", std::process::id(), since.as_nanos())
}
