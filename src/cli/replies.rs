//! Sending commands to services, and printing their replies.

use std::io::Write as _;
use std::time::SystemTime;

use super::bus_args::BusArgs;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::output::output;
use crate::bus::{self, Name, Session, client};
use crate::shown::shown_s;
use crate::wire::CommandReply;

/// Finds the service, sends one command, prints the reply.
pub(super) fn send_and_print(
    bus: &BusArgs,
    name: &Name,
    send: impl FnOnce(&Session) -> CommandResult<CommandReply>,
) -> CommandResult {
    let session = bus.options().open_client()?;
    let reply = client::wait_for_service(&session, name).map_err(Failure::from).and_then(|()| send(&session));
    bus::close(&session)?;
    let reply = reply?;
    writeln!(output(), "{}", format_reply(&reply))?;
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
