//! Errors of the server for Foxglove.

use std::io;
use std::net::SocketAddr;

use crate::bus::BusError;

/// The server could not start.
#[derive(Debug, thiserror::Error)]
pub enum FoxgloveError {
    /// The port is in use.
    #[error("--foxglove: another program listens on {0}: end it, or give another port, as in --foxglove=127.0.0.1:8766")]
    InUse(SocketAddr),
    /// The address cannot be listened on.
    #[error("--foxglove: cannot listen on {address}: {cause}")]
    Bind {
        /// The address.
        address: SocketAddr,
        /// Why not.
        cause: io::Error,
    },
    /// The server was refused for another reason.
    #[error("--foxglove: {0}")]
    Server(#[from] ::foxglove::FoxgloveError),
    /// A thread could not be started.
    #[error("--foxglove: cannot start a thread: {0}")]
    Thread(io::Error),
    /// The bus refused a subscription.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl FoxgloveError {
    /// The error of a server that could not start on `address`.
    pub(super) fn of_start(address: SocketAddr, error: ::foxglove::FoxgloveError) -> Self {
        match error {
            ::foxglove::FoxgloveError::Bind(cause) if cause.kind() == io::ErrorKind::AddrInUse => FoxgloveError::InUse(address),
            ::foxglove::FoxgloveError::Bind(cause) => FoxgloveError::Bind { address, cause },
            error => FoxgloveError::Server(error),
        }
    }
}
