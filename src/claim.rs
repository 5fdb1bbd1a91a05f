//! Claims that processes of one machine make of something that only one of them may have.
//!
//! A claim is an abstract socket: the system removes it with its process. It is local to a network namespace, as the loopback ports of
//! services are.

use std::os::unix::net::UnixListener;
#[cfg(target_os = "linux")]
use std::os::{linux::net::SocketAddrExt as _, unix::net::SocketAddr};

/// File in which Linux lists the sockets of this network namespace, a line each: it ends in the name, abstract ones after an `@`.
const SOCKETS: &str = "/proc/net/unix";

/// Something that this process has claimed, until this value is dropped.
#[derive(Debug)]
pub(crate) struct Claim {
    /// Absent where the system has no abstract sockets, or the key is too long for one: then anybody has it.
    _socket: Option<UnixListener>,
}

impl Claim {
    /// Claims a key; `None` if another claim on this machine has it.
    pub(crate) fn take(key: &str) -> Option<Self> {
        match bind(key) {
            Ok(socket) => Some(Claim { _socket: Some(socket) }),
            Err(error) if error.kind() == std::io::ErrorKind::AddrInUse => None,
            Err(_) => Some(Claim { _socket: None }),
        }
    }

    /// Whether a process of this machine has claimed a key; `false` where the system does not tell.
    pub(crate) fn is_taken(key: &str) -> bool {
        let sockets = std::fs::read(SOCKETS).unwrap_or_default();
        let ending = format!(" @{key}");
        String::from_utf8_lossy(&sockets).lines().any(|line| line.ends_with(&ending))
    }
}

#[cfg(target_os = "linux")]
fn bind(key: &str) -> std::io::Result<UnixListener> {
    UnixListener::bind_addr(&SocketAddr::from_abstract_name(key)?)
}

#[cfg(not(target_os = "linux"))]
fn bind(_: &str) -> std::io::Result<UnixListener> {
    Err(std::io::ErrorKind::Unsupported.into())
}
