//! Claims of service names on one machine.
//!
//! Two services that start at the same instant do not see each other on the bus yet. A claim decides at once which of them has the
//! name: it is an abstract socket, which the system removes with its process, and which is local to a network namespace, as the
//! loopback ports of services are.

use std::os::unix::net::UnixListener;
#[cfg(target_os = "linux")]
use std::os::{linux::net::SocketAddrExt as _, unix::net::SocketAddr};

use super::keys::{Name, ROOT};

/// A name that this process has claimed, until this value is dropped.
#[derive(Debug)]
pub struct NameClaim {
    /// Absent where the system has no abstract sockets: then only the bus shows which names are taken.
    _socket: Option<UnixListener>,
}

impl NameClaim {
    /// Claims a name; `None` if another service on this machine has claimed it.
    pub fn take(name: &Name) -> Option<Self> {
        match bind(name) {
            Ok(socket) => Some(NameClaim { _socket: Some(socket) }),
            Err(error) if error.kind() == std::io::ErrorKind::AddrInUse => None,
            Err(_) => Some(NameClaim { _socket: None }),
        }
    }
}

#[cfg(target_os = "linux")]
fn bind(name: &Name) -> std::io::Result<UnixListener> {
    UnixListener::bind_addr(&SocketAddr::from_abstract_name(format!("{ROOT}/{name}"))?)
}

#[cfg(not(target_os = "linux"))]
fn bind(_: &Name) -> std::io::Result<UnixListener> {
    Err(std::io::ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn prop_a_name_is_claimed_once_until_the_claim_is_dropped() -> Result<(), super::super::BadName> {
        let name: Name = format!("claimed-{}", std::process::id()).parse()?;
        let first = NameClaim::take(&name);
        assert!(first.is_some() && NameClaim::take(&name).is_none());
        drop(first);
        assert!(NameClaim::take(&name).is_some());
        let long: Name = "x".repeat(120).parse()?;
        assert!(NameClaim::take(&long).is_some(), "a name too long for a socket is left to the bus");
        Ok(())
    }
}
