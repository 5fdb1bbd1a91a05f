//! Network addresses to listen on and to connect to, as text.

use std::fmt;
use std::str::FromStr;

use zenoh::config::EndPoint;

/// Protocols that this build supports.
const PROTOCOLS: &[&str] = if cfg!(feature = "tls") { &["tcp", "quic", "tls"] } else { &["tcp"] };

/// An endpoint, `tcp/HOST:PORT`; zenoh's options may follow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address(String);

/// The text is not an endpoint.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BadAddress {
    /// The form is wrong.
    #[error("not of the form PROTOCOL/HOST:PORT, such as tcp/127.0.0.1:7447")]
    Form,
    /// This build does not support the protocol.
    #[error("the protocol {0} is not supported: use {known}, as in tcp/127.0.0.1:7447{tls}", known = PROTOCOLS.join(" or "), tls = only_built_in(.0))]
    Protocol(String),
    /// The port is not a number from 0 to 65535.
    #[error("{0} is not a port from 0 to 65535, as in tcp/127.0.0.1:7447")]
    Port(String),
}

/// Whether links of this protocol are encrypted.
pub(super) fn is_encrypted(protocol: &str) -> bool {
    ["quic", "tls"].contains(&protocol)
}

fn only_built_in(protocol: &str) -> &'static str {
    if is_encrypted(protocol) { "; encryption needs a build with --features tls" } else { "" }
}

impl FromStr for Address {
    type Err = BadAddress;

    fn from_str(text: &str) -> Result<Self, BadAddress> {
        let end: EndPoint = text.parse().map_err(|_| BadAddress::Form)?;
        let (host, port) = end.address().as_str().rsplit_once(':').ok_or(BadAddress::Form)?;
        if host.is_empty() {
            return Err(BadAddress::Form);
        }
        let protocol = end.protocol().as_str();
        if !PROTOCOLS.contains(&protocol) {
            return Err(BadAddress::Protocol(protocol.to_owned()));
        }
        port.parse::<u16>().map_err(|_| BadAddress::Port(port.to_owned()))?;
        Ok(Address(text.to_owned()))
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_an_address_is_kept_as_written_or_refused() {
        for text in ["tcp/127.0.0.1:0", "tcp/[::1]:7447", "tcp/router.example:7447", "tcp/0.0.0.0:7447#so_sndbuf=65536"] {
            assert_eq!(text.parse::<Address>().map(|address| address.to_string()), Ok(text.to_owned()));
        }
        for text in ["", "nonsense", "tcp/", "tcp/localhost", "tcp/:7447", "127.0.0.1:7447", "/127.0.0.1:7447"] {
            assert_eq!(text.parse::<Address>(), Err(BadAddress::Form), "{text}");
        }
        assert_eq!("tcp/127.0.0.1:99999".parse::<Address>(), Err(BadAddress::Port("99999".to_owned())));
        assert_eq!("carrier-pigeon/loft:1".parse::<Address>(), Err(BadAddress::Protocol("carrier-pigeon".to_owned())));
    }
}
