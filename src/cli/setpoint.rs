//! `setpoint`: sends a torque that holds until the next one.

use clap_complete::engine::ArgValueCandidates;

use super::client_args::ClientArgs;
use super::completions;
use super::failure::CommandResult;
use super::replies::{Answer, fresh_id, send_and_print};
use super::values::{hold, torque};
use crate::bus::{Name, client};
use crate::simulation::SetpointRequest;
use crate::wire;

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank setpoint crank --torque 2 --hold 200ms
  flexcrank setpoint crank --torque 0 --hold 1ms
  flexcrank setpoint crank --torque -1.5 --hold 10 --wait=10s --json

The next setpoint replaces this one. If none comes within --hold of simulated time, the torque is zero, and status warns.

--json prints id, accepted, reason, effective_step, effective_sim_time_s.";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Name of the service.
    #[arg(default_value = "crank", add = ArgValueCandidates::new(completions::services))]
    pub name: Name,
    /// Torque, N·m, positive counter-clockwise; the scene's commands.torque_limit_nm limits it. It adds to pulses and to the
    /// scene's constant torque.
    #[arg(long, value_name = "NM", value_parser = torque)]
    pub torque: f64,
    /// Longest simulated time that the torque holds, 1us to 60s.
    #[arg(long, value_name = "TIME", value_parser = hold)]
    pub hold: f64,
    /// Id of the command; a retry under the same id is not applied again.
    #[arg(long)]
    pub id: Option<String>,
    /// Print the reply as one line of JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub client: ClientArgs,
}

pub(super) fn setpoint(args: &Args) -> CommandResult {
    let request = SetpointRequest { torque_nm: args.torque, hold_s: args.hold };
    let message = wire::setpoint_message(&args.id.clone().unwrap_or_else(fresh_id), &request);
    let answer = Answer::to("setpoint");
    answer.told(send_and_print(&args.client, &args.name, args.json, |session| {
        answer.noted(client::setpoint(session, &args.name, &message))
    }))
}
