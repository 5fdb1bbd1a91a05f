//! Opening zenoh sessions: on loopback only, without multicast, unless the user says otherwise.

use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::time::Duration;

use zenoh::{Config, Session, Wait};

use super::BusError;

/// Loopback ports that services take, the first free one each; clients look at all of them.
const PORTS: std::ops::Range<u16> = 7447..7463;
/// How long a loopback port may take to say that it is open.
const KNOCK: Duration = Duration::from_millis(200);
/// Small kernel buffers on the link, so that a reader that falls behind is not fed stale samples for seconds.
const SOCKET_BUFFERS: &str = "#so_sndbuf=65536;so_rcvbuf=65536";

/// What the user says about the network.
#[derive(Debug, Clone, Default)]
pub struct BusOptions {
    /// Endpoints to listen on, instead of a loopback port.
    pub listen: Vec<String>,
    /// Endpoints to connect to.
    pub connect: Vec<String>,
    /// A zenoh configuration file to start from.
    pub config: Option<PathBuf>,
    /// Let this session see who subscribes, as [`audience`](super::audience) needs.
    pub sees_audience: bool,
}

impl BusOptions {
    fn base(&self) -> Result<Config, BusError> {
        if let Some(path) = &self.config {
            return Config::from_file(path).map_err(BusError::config);
        }
        let mut config = Config::default();
        set(&mut config, "scouting/multicast/enabled", "false")?;
        Ok(config)
    }

    /// Opens a session for a service, linked to its neighbours on this machine unless told otherwise.
    ///
    /// # Errors
    /// [`BusError`] when the configuration is bad or no endpoint can be taken.
    pub fn open_service(&self) -> Result<Session, BusError> {
        let mut config = self.base()?;
        if self.sees_audience {
            set(&mut config, "adminspace/enabled", "true")?;
        }
        if !self.listen.is_empty() {
            set(&mut config, "listen/endpoints", &list(&self.listen))?;
        } else if self.config.is_none() {
            set(&mut config, "listen/endpoints", &list(&[format!("tcp/{}{SOCKET_BUFFERS}", free_port()?)]))?;
        }
        if !self.connect.is_empty() {
            set(&mut config, "connect/endpoints", &list(&self.connect))?;
        } else if self.config.is_none() && self.listen.is_empty() {
            set(&mut config, "connect/endpoints", &list(&neighbours()))?;
        }
        zenoh::open(config).wait().map_err(BusError::open)
    }

    /// Opens a session for a client: to the endpoints given, or to every service on this machine.
    ///
    /// # Errors
    /// [`BusError::NobodyHere`] when no local port answers; [`BusError`] when the configuration is bad or nothing can be opened.
    pub fn open_client(&self) -> Result<Session, BusError> {
        let mut config = self.base()?;
        if self.config.is_none() {
            let listen = if self.listen.is_empty() { "[]".to_owned() } else { list(&self.listen) };
            set(&mut config, "listen/endpoints", &listen)?;
        }
        if !self.connect.is_empty() {
            set(&mut config, "connect/endpoints", &list(&self.connect))?;
        } else if self.config.is_none() && self.listen.is_empty() {
            let here = neighbours();
            if here.is_empty() {
                return Err(BusError::NobodyHere);
            }
            set(&mut config, "connect/endpoints", &list(&here))?;
        }
        zenoh::open(config).wait().map_err(BusError::open)
    }
}

fn set(config: &mut Config, key: &str, value: &str) -> Result<(), BusError> {
    config.insert_json5(key, value).map_err(BusError::config)
}

fn list(endpoints: &[String]) -> String {
    let quoted: Vec<String> = endpoints.iter().map(|endpoint| format!("{endpoint:?}")).collect();
    format!("[{}]", quoted.join(","))
}

fn loopback(port: u16) -> SocketAddr {
    (Ipv4Addr::LOCALHOST, port).into()
}

fn free_port() -> Result<SocketAddr, BusError> {
    PORTS.map(loopback).find(|address| TcpListener::bind(address).is_ok()).ok_or(BusError::NoPort)
}

/// Endpoints of the services on this machine.
fn neighbours() -> Vec<String> {
    PORTS.filter_map(answering).map(|address| format!("tcp/{address}")).collect()
}

fn answering(port: u16) -> Option<SocketAddr> {
    let address = loopback(port);
    TcpStream::connect_timeout(&address, KNOCK).ok().map(|_| address)
}
