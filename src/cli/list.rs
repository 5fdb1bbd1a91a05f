//! `list`: the services on the bus.

use std::io::Write as _;

use super::bus_args::BusArgs;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::output::output;
use crate::bus::{self, BusError, client};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank list
  flexcrank list --connect tcp/192.0.2.1:7447";

pub(super) fn list(args: &BusArgs) -> CommandResult {
    let session = args.options().open_client()?;
    let found = client::services(&session, client::DISCOVERY_TIMEOUT / 2, |_| false)?;
    bus::close(&session)?;
    for name in &found {
        writeln!(output(), "{name}")?;
    }
    if found.is_empty() { Err(BusError::NoLocalService.into()) } else { Ok(ExitStatus::Success) }
}
