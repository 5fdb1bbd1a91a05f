//! `pulse`: sends torque pulses to a service.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::bus_args::BusArgs;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::output::output;
use super::replies::{fresh_id, send_and_print};
use super::sequence::{self, ListedPulse};
use crate::bus::{self, Name, Session, client};
use crate::scene::PulseShape;
use crate::shown::shown_s;
use crate::simulation::PulseRequest;
use crate::wire;

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank pulse crank --torque 5 --duration 0.1
  flexcrank pulse crank --torque -2 --duration 0.5 --delay 1 --shape raised-cosine
  flexcrank pulse crank --from pulses.csv";

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("pulses").args(["torque", "from"]).required(true))]
pub(super) struct Args {
    /// Name of the service.
    #[arg(default_value = "crank")]
    pub name: Name,
    /// Mean torque, N·m, positive counter-clockwise.
    #[arg(long, value_name = "NM", requires = "duration")]
    pub torque: Option<f64>,
    /// Duration, s.
    #[arg(long, value_name = "S", requires = "torque")]
    pub duration: Option<f64>,
    /// Send the pulses of a CSV file one after another; columns torque_nm, duration_s, and optionally delay_s, shape, id.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["duration", "delay", "shape", "id"])]
    pub from: Option<PathBuf>,
    /// Simulated time until the pulse begins, s.
    #[arg(long, value_name = "S", default_value = "0")]
    pub delay: f64,
    /// Shape of the pulse; both shapes have the impulse torque × duration.
    #[arg(long, default_value = "rectangular")]
    pub shape: Shape,
    /// Id of the command; a retry under the same id is not applied again.
    #[arg(long)]
    pub id: Option<String>,
    #[command(flatten)]
    pub bus: BusArgs,
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
        return sequence(&args.bus, &args.name, file);
    }
    let request = PulseRequest {
        torque_nm: args.torque.unwrap_or_default(),
        duration_s: args.duration.unwrap_or_default(),
        delay_s: args.delay,
        shape: args.shape.into(),
    };
    let message = wire::pulse_message(&args.id.unwrap_or_else(fresh_id), &request);
    send_and_print(&args.bus, &args.name, |session| Ok(client::pulse(session, &args.name, &message)?))
}

/// Sends the pulses of a file in order; stops at the first refusal.
fn sequence(bus: &BusArgs, name: &Name, file: &Path) -> CommandResult {
    let pulses = sequence::read(file)?;
    let session = bus.options().open_client()?;
    let done = client::wait_for_service(&session, name).map_err(Failure::from).and_then(|()| send_all(&session, name, &pulses));
    bus::close(&session)?;
    done
}

fn send_all(session: &Session, name: &Name, pulses: &[ListedPulse]) -> CommandResult {
    let own = fresh_id();
    for ListedPulse { line, id, request } in pulses {
        let id = id.clone().unwrap_or_else(|| format!("{own}-{line}"));
        let message = wire::pulse_message(&id, request);
        // A retry under the same id is not applied again if only the reply was lost.
        let again = |_| client::pulse(session, name, &message);
        let reply = client::pulse(session, name, &message).or_else(again).or_else(again)?;
        let mut out = output();
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
