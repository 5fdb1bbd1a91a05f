//! `pulse`: sends torque pulses to a service.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use clap_complete::engine::ArgValueCandidates;

use super::aligned_table::figure;
use super::client_args::ClientArgs;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::output::{output, print_json};
use super::replies::{Answer, ReplyLine, format_reply, fresh_id, send_and_print};
use super::sequence::{self, ListedPulse};
use super::signals::interruption_leaves;
use super::values::{GivenDuration, LONG_PULSE_S, pulse_delay, pulse_duration, torque};
use crate::bus::{self, Name, Session, client};
use crate::scene::PulseShape;
use crate::simulation::PulseRequest;
use crate::wire;

/// Both forms: a pulse needs torque and duration.
pub(super) const USAGE: &str = "\
flexcrank pulse [OPTIONS] --torque <NM> --duration <TIME> [NAME]
       flexcrank pulse [OPTIONS] --from <FILE> [NAME]";

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank pulse crank --torque 5 --duration 0.1
  flexcrank pulse crank --torque -2 --duration 0.5 --delay 1 --shape raised-cosine
  flexcrank pulse crank --from pulses.csv
  flexcrank pulse crank --torque 5 --duration 100ms --wait=10s --json

--from stops at the first pulse that is refused; those before it stay in effect.

--json prints line (with --from), id, accepted, reason, effective_step, effective_sim_time_s.";

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("pulses").args(["torque", "from"]).required(true))]
pub(super) struct Args {
    /// Name of the service.
    #[arg(default_value = "crank", add = ArgValueCandidates::new(completions::services))]
    pub name: Name,
    /// Mean torque, N·m, positive counter-clockwise. The scene's commands.torque_limit_nm limits it.
    #[arg(long, value_name = "NM", requires = "duration", value_parser = torque)]
    pub torque: Option<f64>,
    /// Duration.
    #[arg(long, value_name = "TIME", requires = "torque", value_parser = pulse_duration)]
    pub duration: Option<GivenDuration>,
    /// Send the pulses of a CSV file one after another; columns torque_nm, duration_s, and optionally delay_s, shape, id.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["duration", "delay", "shape", "id"])]
    pub from: Option<PathBuf>,
    /// Simulated time until the pulse begins.
    #[arg(long, value_name = "TIME", default_value = "0", value_parser = pulse_delay)]
    pub delay: f64,
    /// Shape of the pulse; both shapes have the impulse torque × duration: rectangular peaks at the torque, raised-cosine at
    /// twice that.
    #[arg(long, default_value = "rectangular")]
    pub shape: Shape,
    /// Id of the command; a retry under the same id is not applied again.
    #[arg(long)]
    pub id: Option<String>,
    /// Print each reply as one line of JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub client: ClientArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Shape {
    Rectangular,
    RaisedCosine,
}

impl From<Shape> for PulseShape {
    fn from(shape: Shape) -> Self {
        match shape {
            Shape::Rectangular => PulseShape::Rectangular,
            Shape::RaisedCosine => PulseShape::RaisedCosine,
        }
    }
}

pub(super) fn pulse(args: Args) -> CommandResult {
    if let Some(file) = &args.from {
        return sequence(&args, file);
    }
    args.duration.and_then(|given| given.suspect_pulse("--duration")).iter().for_each(|warning| say!("warning: {warning}"));
    let request = PulseRequest {
        torque_nm: args.torque.unwrap_or_default(),
        duration_s: args.duration.map_or(0.0, |given| given.duration_s),
        delay_s: args.delay,
        shape: args.shape.into(),
    };
    let message = wire::pulse_message(&args.id.clone().unwrap_or_else(fresh_id), &request);
    let answer = Answer::to("pulse");
    answer.told(send_and_print(&args.client, &args.name, args.json, |session| {
        answer.noted(client::pulse(session, &args.name, &message))
    }))
}

/// A warning of the first long pulse of a file, whose durations may be meant in ms.
fn suspect_file(file: &Path, pulses: &[ListedPulse]) -> Option<String> {
    let long = pulses.iter().find(|pulse| pulse.request.duration_s >= LONG_PULSE_S)?;
    let duration = figure(long.request.duration_s);
    Some(format!("{}:{}: duration_s = {duration}: that is {duration} s, unusually long for a pulse", file.display(), long.line))
}

/// Sends the pulses of a file in order; stops at the first refusal.
fn sequence(args: &Args, file: &Path) -> CommandResult {
    let pulses = sequence::read(file)?;
    suspect_file(file, &pulses).iter().for_each(|warning| say!("warning: {warning}"));
    let session = args.client.open(&args.name)?;
    let done = send_all(&session, args, &pulses);
    bus::close(&session)?;
    done
}

fn send_all(session: &Session, args: &Args, pulses: &[ListedPulse]) -> CommandResult {
    let own = fresh_id();
    for (before, ListedPulse { line, id, request }) in pulses.iter().enumerate() {
        interruption_leaves(format!("{} of {} pulses were sent, the last without a reply", before + 1, pulses.len()));
        let id = id.clone().unwrap_or_else(|| format!("{own}-{line}"));
        let message = wire::pulse_message(&id, request);
        // A retry under the same id is not applied again if only the reply was lost.
        let again = |_| client::pulse(session, &args.name, &message);
        let answer = Answer::to(format!("pulse of line {line}, the last that was sent,"));
        let reply = answer.noted(client::pulse(session, &args.name, &message).or_else(again).or_else(again))?;
        let printed = match args.json {
            true => print_json(&ReplyLine::new(&reply, Some(*line))),
            false => writeln!(output(), "line {line}: {}", format_reply(&reply)),
        };
        answer.told(printed.map_err(Failure::from))?;
        if !reply.accepted {
            return Ok(ExitStatus::Refused);
        }
    }
    Ok(ExitStatus::Success)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::CommandReply;

    /// A full standard output read as a refusal.
    #[test]
    fn regress_a_failure_after_the_reply_says_what_the_reply_was() {
        let ended = |accepted: Option<bool>| {
            let answer = Answer::to("pulse");
            let reply = accepted.map(|accepted| CommandReply { accepted, ..CommandReply::default() });
            assert_eq!(reply.is_some(), answer.noted(reply.ok_or(Failure::Failed("no reply".to_owned()))).is_ok());
            match answer.told::<()>(Err(Failure::Failed("standard output: full".to_owned()))) {
                Err(Failure::Failed(why)) => why,
                other => format!("{other:?}"),
            }
        };
        assert_eq!(ended(Some(true)), "standard output: full; the pulse was accepted");
        assert_eq!(ended(Some(false)), "standard output: full; the pulse was refused");
        assert_eq!(ended(None), "standard output: full");
    }

    #[test]
    fn regress_a_long_duration_without_a_unit_is_suspect() {
        let warning = |text: &str| pulse_duration(text).map(|given| given.suspect_pulse("--duration"));
        assert_eq!(warning("100"), Ok(Some("--duration 100 has no unit: that is 100 s".to_owned())));
        assert_eq!(warning("5m"), Ok(Some("--duration 5m is 5 min, 300 s; milliseconds are 5ms".to_owned())));
        for text in ["100s", "100ms", "0.1", "9.9", "2min"] {
            assert_eq!(warning(text), Ok(None), "{text}");
        }
        assert!(warning("7200").is_err());
    }

    #[test]
    fn regress_a_long_duration_in_a_file_is_suspect() {
        let of = |durations_s: [f64; 2]| {
            let listed = |line, duration_s| {
                let request = PulseRequest { torque_nm: 1.0, duration_s, delay_s: 0.0, shape: PulseShape::Rectangular };
                ListedPulse { line, id: None, request }
            };
            suspect_file(Path::new("p.csv"), &[listed(2, durations_s[0]), listed(3, durations_s[1])])
        };
        assert_eq!(of([0.1, 100.0]).as_deref(), Some("p.csv:3: duration_s = 100: that is 100 s, unusually long for a pulse"));
        assert_eq!(of([0.1, 9.9]), None);
    }
}
