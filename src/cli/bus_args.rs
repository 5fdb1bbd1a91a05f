//! Network options, common to all commands that use the bus.

use std::path::PathBuf;

use crate::bus::{Address, BusOptions};

#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct BusArgs {
    /// Listen on this endpoint instead of a loopback port, e.g. tcp/0.0.0.0:7447. Anyone who reaches it can send commands.
    #[arg(long, global = true, value_name = "ENDPOINT")]
    listen: Vec<Address>,
    /// Connect to this endpoint, e.g. tcp/192.0.2.1:7447.
    #[arg(long, global = true, value_name = "ENDPOINT")]
    connect: Vec<Address>,
    /// Start from this zenoh configuration file.
    #[arg(long, global = true, value_name = "FILE")]
    zenoh_config: Option<PathBuf>,
}

impl BusArgs {
    pub(super) fn options(&self) -> BusOptions {
        BusOptions {
            listen: self.listen.iter().map(Address::to_string).collect(),
            connect: self.connect.iter().map(Address::to_string).collect(),
            config: self.zenoh_config.clone(),
            ..BusOptions::default()
        }
    }
}
