//! Sending commands to services, and printing their replies.

use std::cell::Cell;
use std::io::Write as _;
use std::time::SystemTime;

use serde::Serialize;

use super::client_args::ClientArgs;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::output::{output, print_json};
use super::signals::interruption_leaves;
use crate::bus::{self, Name, Session};
use crate::shown::{shown_name, shown_s, shown_sentence};
use crate::wire::CommandReply;

/// The answer of a service to a command. A failure that comes after it, as where standard output is full, is not the command's.
pub(super) struct Answer {
    what: String,
    accepted: Cell<Option<bool>>,
}

impl Answer {
    /// An answer to come, to `what`.
    pub(super) fn to(what: impl Into<String>) -> Self {
        Answer { what: what.into(), accepted: Cell::new(None) }
    }

    /// Notes the answer.
    pub(super) fn noted(&self, reply: Result<CommandReply, impl Into<Failure>>) -> CommandResult<CommandReply> {
        reply.inspect(|reply| self.accepted.set(Some(reply.accepted))).map_err(Into::into)
    }

    /// The end of the command; a failure tells the answer, if that has come.
    pub(super) fn told<T>(&self, ended: CommandResult<T>) -> CommandResult<T> {
        ended.map_err(|failure| match (failure, self.accepted.get()) {
            (Failure::Failed(why), Some(accepted)) => {
                Failure::Failed(format!("{why}; the {} was {}", self.what, if accepted { "accepted" } else { "refused" }))
            }
            (failure, _) => failure,
        })
    }
}

/// Finds the service, sends one command, prints the reply, as JSON if asked.
pub(super) fn send_and_print(
    client: &ClientArgs,
    name: &Name,
    json: bool,
    send: impl FnOnce(&Session) -> CommandResult<CommandReply>,
) -> CommandResult {
    send_over(&client.open(name)?, json, send)
}

/// Sends one command over a session, closes the session, prints the reply, as JSON if asked.
pub(super) fn send_over(
    session: &Session,
    json: bool,
    send: impl FnOnce(&Session) -> CommandResult<CommandReply>,
) -> CommandResult {
    interruption_leaves("the command was sent, and its reply not awaited".to_owned());
    let reply = send(session);
    bus::close(session)?;
    let reply = reply?;
    if json {
        print_json(&ReplyLine::new(&reply, None))?;
    } else {
        writeln!(output(), "{}", format_reply(&reply))?;
    }
    Ok(if reply.accepted { ExitStatus::Success } else { ExitStatus::Refused })
}

/// A reply as JSON.
#[derive(Serialize)]
pub(super) struct ReplyLine<'a> {
    /// Line of the file of pulses.
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<u64>,
    id: &'a str,
    accepted: bool,
    reason: &'a str,
    /// Step in which the command takes effect; absent if it was refused, and for a replay.
    effective_step: Option<u64>,
    /// Time at which it takes effect: simulated time, or that of the recording.
    effective_sim_time_s: Option<f64>,
    /// Energy that a change of the scene brought in.
    #[serde(skip_serializing_if = "Option::is_none")]
    changed_j: Option<f64>,
}

impl<'a> ReplyLine<'a> {
    pub(super) fn new(reply: &'a CommandReply, line: Option<u64>) -> Self {
        let CommandReply { id, accepted, reason, effective_step, effective_sim_time_s, changed_j } = reply;
        ReplyLine {
            line,
            id,
            accepted: *accepted,
            reason,
            effective_step: Some(*effective_step).filter(|step| *accepted && *step > 0),
            effective_sim_time_s: accepted.then_some(*effective_sim_time_s),
            changed_j: *changed_j,
        }
    }
}

/// Formats a reply, with its command's id if it has one.
pub(super) fn format_reply(reply: &CommandReply) -> String {
    let CommandReply { id, accepted, reason, effective_step, effective_sim_time_s, changed_j } = reply;
    if !accepted {
        return format!("refused: {}", shown_sentence(reason));
    }
    let reason = if reason.is_empty() { String::new() } else { format!(" ({})", shown_sentence(reason)) };
    let id = if id.is_empty() { String::new() } else { format!(" (id {})", shown_name(id)) };
    // A replay has no steps.
    if *effective_step == 0 {
        return format!("accepted{reason}: at {effective_sim_time_s:.3} s of the recording{id}");
    }
    let energy = changed_j.map_or(String::new(), |changed_j| format!("; it changed the energy by {changed_j:+.3e} J"));
    let time_s = shown_s(*effective_sim_time_s);
    format!("accepted{reason}: takes effect in step {effective_step}, at t = {time_s} s{energy}{id}")
}

/// A unique command id, from process id and time.
pub(super) fn fresh_id() -> String {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    format!("{:x}-{:x}", std::process::id(), since.as_nanos())
}
