//! Opening zenoh sessions: on loopback and without multicast, unless the options state otherwise.

use std::fs::File;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use zenoh::{Config, Session, Wait};

use super::address::is_encrypted;
use super::zenoh_messages::{config_error_text, message_of};
use super::{BusError, Name, client};

/// Loopback ports of services: each takes the first free one; clients try all.
const PORTS: std::ops::Range<u16> = 7447..7463;
/// Time for a loopback port to accept a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(200);
/// Time for a service's connections to be established.
const LINK_TIMEOUT: Duration = Duration::from_secs(2);
/// Time between two looks.
const POLL_PERIOD: Duration = Duration::from_millis(20);
/// Attempts to take another free port if one is lost to another service.
const PORT_RETRIES: u32 = 50;
/// Longest that a service of this machine may take to answer: a session does not close while it waits, and the program on the port may
/// be mute. Beyond this machine, zenoh's ten seconds stand.
const OPEN_TIMEOUT: (&str, &str) = ("transport/unicast/open_timeout", "2000");
const LISTEN: &str = "listen/endpoints";
const CONNECT: &str = "connect/endpoints";
const MULTICAST: &str = "scouting/multicast/enabled";
/// Passwords: the file with those of all who may connect, and the name under which this program connects.
const PASSWORDS: [&str; 2] = ["transport/auth/usrpwd/dictionary_file", "transport/auth/usrpwd/user"];
/// Small kernel buffers, so that a slow reader does not receive stale samples for seconds.
const SOCKET_BUFFERS: &str = "#so_sndbuf=65536;so_rcvbuf=65536";

/// Bounds of a service's messages, unless its configuration file sets them: a received message, and what a batch of messages may
/// hold (peers agree on the smaller limit), bytes. Commands have at most 4 KiB, but zenoh aborts the process for a declared key of
/// some 7,000 chunks: these would have 14 KiB. More batches in the queue make up for smaller ones.
const SERVICE_BOUNDS: [(&str, &str); 3] = [
    ("transport/link/rx/max_message_size", "8192"),
    ("transport/link/tx/batch_size", "8192"),
    ("transport/link/tx/queue/size/data", "16"),
];

/// Network options.
#[derive(Debug, Clone, Default)]
pub struct BusOptions {
    /// Endpoints to listen on, instead of a loopback port.
    pub listen: Vec<String>,
    /// Endpoints to connect to.
    pub connect: Vec<String>,
    /// A zenoh configuration file to start from. If it sets no listening endpoint, the session listens on loopback.
    pub config: Option<PathBuf>,
    /// Neither listens nor connects: a session without a bus.
    pub isolated: bool,
    /// With endpoints to connect to: announces this session there and links with the others there, as nodes of ROS 2 do.
    pub gossip: bool,
    /// Lets this session list subscriptions, as [`subscribed_sessions`](super::subscribed_sessions()) needs.
    pub sees_subscriptions: bool,
}

impl BusOptions {
    /// The configuration file, or defaults; multicast is off unless the file sets it.
    fn base_config(&self) -> Result<Config, BusError> {
        let mut config = match &self.config {
            Some(path) => read(path).map_err(|cause| BusError::File { path: path.clone(), cause })?,
            None => Config::default(),
        };
        if !is_set(&config, MULTICAST) {
            set(&mut config, MULTICAST, "false")?;
        }
        Ok(config)
    }

    /// Opens a session for a service, connected to the other services on this machine unless the options state otherwise. Waits
    /// briefly for its connections, so that a service of the same name is found.
    ///
    /// # Errors
    /// [`BusError`] if the configuration is invalid or no endpoint is free.
    pub fn open_service(&self) -> Result<Session, BusError> {
        self.open_listening().map(|(session, _)| session)
    }

    /// Opens a session as [`open_service`](BusOptions::open_service), and returns the endpoints on which it listens.
    ///
    /// # Errors
    /// [`BusError`] if the configuration is invalid or no endpoint is free.
    pub fn open_listening(&self) -> Result<(Session, Vec<String>), BusError> {
        let mut retries = PORT_RETRIES;
        let (config, session) = loop {
            let config = self.service_config()?;
            check_features(&config)?;
            match zenoh::open(config.clone()).wait() {
                Ok(session) => break (config, session),
                // Another service that starts at this instant may have taken the port that was free a moment ago.
                Err(_) if retries > 0 && self.chooses_port() => retries -= 1,
                Err(error) if message_of(&error).contains("Address already in use") => {
                    return Err(BusError::InUse(endpoints_of(&config).join(", ")));
                }
                Err(error) => return Err(BusError::open(error)),
            }
            std::thread::sleep(POLL_PERIOD);
        };
        for endpoint in open_endpoints(&config) {
            tracing::warn!(
                "everybody who reaches {endpoint} can command the mechanism: no passwords are set; see `flexcrank guide security`"
            );
        }
        let connects = is_set(&config, CONNECT) && (self.config.is_some() || !self.connect.is_empty());
        let endpoints = config.get_json(CONNECT).unwrap_or_default().replace(['[', ']', '"'], "").replace(',', ", ");
        if connects && !is_linked(&session) {
            tracing::warn!("no connection to {endpoints} yet: the service runs, and keeps trying");
        }
        Ok((session, endpoints_of(&config)))
    }

    /// Whether the session takes a free loopback port, among the services of this machine.
    pub fn is_local(&self) -> bool {
        self.listen.is_empty() && self.config.is_none() && !self.isolated
    }

    /// Whether the system chooses all ports that the session listens on.
    fn chooses_port(&self) -> bool {
        self.is_local() || !self.listen.is_empty() && self.listen.iter().all(|endpoint| open_port(endpoint).is_some())
    }

    fn service_config(&self) -> Result<Config, BusError> {
        let mut config = self.base_config()?;
        for (key, bound) in SERVICE_BOUNDS {
            if !is_set(&config, key) {
                set(&mut config, key, bound)?;
            }
        }
        if self.isolated {
            set(&mut config, LISTEN, "[]")?;
            return Ok(config);
        }
        if self.sees_subscriptions {
            set(&mut config, "adminspace/enabled", "true")?;
        }
        if !self.listen.is_empty() {
            let endpoints: Vec<String> = self.listen.iter().map(|endpoint| with_port(endpoint)).collect();
            set(&mut config, LISTEN, &list(&endpoints))?;
        } else if !is_set(&config, LISTEN) && !is_client(&config) {
            let port = free_port(&self.ports_to_connect_to(&config))?;
            set(&mut config, LISTEN, &list(&[format!("tcp/{port}{SOCKET_BUFFERS}")]))?;
        }
        if !self.connect.is_empty() {
            set(&mut config, CONNECT, &list(&self.connect))?;
            if !self.gossip {
                // Gossip would announce loopback endpoints of other machines, which are useless here.
                set(&mut config, "scouting/gossip/enabled", "false")?;
            }
        } else if self.config.is_none() && self.listen.is_empty() {
            set(&mut config, CONNECT, &list(&neighbours()))?;
            set(&mut config, OPEN_TIMEOUT.0, OPEN_TIMEOUT.1)?;
        }
        Ok(config)
    }

    /// Ports of this machine that the session is to connect to: a service that took one would wait for itself.
    fn ports_to_connect_to(&self, config: &Config) -> Vec<u16> {
        let of_config = config.get_json(CONNECT).unwrap_or_default();
        let endpoints = self.connect.iter().map(String::as_str).chain(of_config.split('"'));
        endpoints.filter_map(local_port).collect()
    }

    /// Opens a session for a client: to the given endpoints, or to every service on this machine.
    ///
    /// # Errors
    /// [`BusError::NoLocalService`] if no local port answers; [`BusError`] if the configuration is invalid or the session cannot
    /// be opened.
    pub fn open_client(&self) -> Result<Session, BusError> {
        let config = self.client_config()?;
        check_features(&config)?;
        let refused = if is_client(&config) { BusError::not_admitted } else { BusError::open };
        zenoh::open(config).wait().map_err(refused)
    }

    /// Number of sessions that a client of these options is linked with in the end: one per endpoint, or per local service.
    pub fn expected_links(&self) -> usize {
        if self.connect.is_empty() { neighbours().len() } else { self.connect.len() }
    }

    /// Returns the first of `names` that is taken beyond the endpoints to connect to: a service behind a router does not see the
    /// others itself. An endpoint that cannot be reached counts as empty.
    ///
    /// # Errors
    /// [`BusError`] if zenoh fails.
    pub fn first_taken_through_endpoints(&self, names: &[&Name]) -> Result<Option<Name>, BusError> {
        for endpoint in &self.connect {
            let there = BusOptions { connect: vec![endpoint.clone()], ..BusOptions::default() };
            let Ok(session) = there.open_client() else { continue };
            let taken = client::first_taken(&session, names);
            session.close().wait().map_err(BusError::failed)?;
            if let Some(taken) = taken? {
                return Ok(Some(taken));
            }
        }
        Ok(None)
    }

    fn client_config(&self) -> Result<Config, BusError> {
        let mut config = self.base_config()?;
        if !self.listen.is_empty() {
            set(&mut config, LISTEN, &list(&self.listen))?;
        } else if !is_set(&config, LISTEN) {
            set(&mut config, LISTEN, "[]")?;
        }
        if !self.connect.is_empty() {
            set(&mut config, CONNECT, &list(&self.connect))?;
            // Routers forward nothing between peers.
            if self.connect.len() == 1 && self.config.is_none() && self.listen.is_empty() {
                set(&mut config, "mode", "\"client\"")?;
            }
        } else if self.config.is_none() && self.listen.is_empty() {
            let here = neighbours();
            if here.is_empty() {
                return Err(BusError::NoLocalService);
            }
            set(&mut config, CONNECT, &list(&here))?;
            set(&mut config, OPEN_TIMEOUT.0, OPEN_TIMEOUT.1)?;
        }
        Ok(config)
    }
}

/// Largest file of a configuration, bytes.
const LONGEST_CONFIG: usize = 1024 * 1024;

fn read(path: &Path) -> Result<Config, String> {
    let file = File::open(path).and_then(|file| file.metadata()).map_err(|error| error.to_string())?;
    // A pipe is read to its end; a device may have none.
    if file.file_type().is_char_device() {
        return Err("is a device, not a file".to_owned());
    }
    if file.len() > LONGEST_CONFIG as u64 {
        return Err(crate::text_file::too_large(LONGEST_CONFIG).to_string());
    }
    Config::from_file(path).map_err(|error| config_error_text(&message_of(&error)))
}

/// Whether a configuration differs from zenoh's default at `key`.
fn is_set(config: &Config, key: &str) -> bool {
    config.get_json(key).ok() != Config::default().get_json(key).ok()
}

fn is_client(config: &Config) -> bool {
    config.get_json("mode").is_ok_and(|mode| mode == "\"client\"")
}

/// Waits for a router or peer, at most two seconds; returns whether there is one.
fn is_linked(session: &Session) -> bool {
    let begun = Instant::now();
    loop {
        let info = session.info();
        if info.routers_zid().wait().next().is_some() || info.peers_zid().wait().next().is_some() {
            return true;
        }
        if begun.elapsed() > LINK_TIMEOUT {
            return false;
        }
        std::thread::sleep(POLL_PERIOD);
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

/// The first free loopback port that is not one of `spared`.
fn free_port(spared: &[u16]) -> Result<SocketAddr, BusError> {
    let mut others = PORTS.filter(|port| !spared.contains(port)).map(loopback);
    others.find(|address| TcpListener::bind(address).is_ok()).ok_or(BusError::NoPort)
}

/// The port of an endpoint on loopback; `None` for any other.
fn local_port(endpoint: &str) -> Option<u16> {
    let (_, host) = bare(endpoint).split_once('/')?;
    let (_, port) = host.rsplit_once(':').filter(|_| is_loopback(host))?;
    port.parse().ok()
}

/// Refuses encrypted endpoints and passwords in a build without them, before zenoh reports the former as absent and ignores the
/// latter. Warns of the fault that links `tls/…` of zenoh 1.10 have: <https://github.com/eclipse-zenoh/zenoh/issues/2557>.
fn check_features(config: &Config) -> Result<(), BusError> {
    let endpoints = [LISTEN, CONNECT].map(|key| config.get_json(key).unwrap_or_default()).concat();
    let protocols = endpoints.split('"').filter_map(|endpoint| Some((endpoint, endpoint.split_once('/')?.0)));
    for (endpoint, protocol) in protocols {
        if is_encrypted(protocol) && !cfg!(feature = "tls") {
            return Err(BusError::NoTls(endpoint.to_owned()));
        }
        if protocol == "tls" {
            tracing::warn!(endpoint, "links over tls/ break now and then while both ends send (zenoh issue 2557): use quic/");
        }
    }
    match PASSWORDS.iter().find(|key| is_set(config, key)) {
        Some(key) if !cfg!(feature = "tls") => Err(BusError::no_passwords(key)),
        _ => Ok(()),
    }
}

/// Host and options of an endpoint that leaves the port to the system, port 0: the parts before and after the port.
fn open_port(endpoint: &str) -> Option<(&str, &str)> {
    let (address, options) = endpoint.split_at(endpoint.find(['?', '#']).unwrap_or(endpoint.len()));
    address.strip_suffix(":0").map(|host| (host, options))
}

/// The endpoint with a free port in place of port 0, so that the port is known.
fn with_port(endpoint: &str) -> String {
    let free = |host: &str| Some(TcpListener::bind(format!("{}:0", host.split_once('/')?.1)).ok()?.local_addr().ok()?.port());
    let chosen = open_port(endpoint).and_then(|(host, options)| Some(format!("{host}:{}{options}", free(host)?)));
    chosen.unwrap_or_else(|| endpoint.to_owned())
}

/// Listening endpoints of a configuration, without options: those of its mode if they differ by mode.
fn endpoints_of(config: &Config) -> Vec<String> {
    let value = |key| config.get_json(key).ok().and_then(|json| serde_json::from_str::<serde_json::Value>(&json).ok());
    let mode = value("mode").and_then(|mode| mode.as_str().map(str::to_owned)).unwrap_or_else(|| "peer".to_owned());
    let endpoints = value(LISTEN).unwrap_or_default();
    let endpoints = endpoints.get(&mode).unwrap_or(&endpoints).as_array().cloned().unwrap_or_default();
    endpoints.iter().filter_map(|endpoint| Some(bare(endpoint.as_str()?).to_owned())).collect()
}

/// An endpoint without its options.
fn bare(endpoint: &str) -> &str {
    endpoint.split(['?', '#']).next().unwrap_or(endpoint)
}

/// Whether `HOST:PORT` is a loopback address.
fn is_loopback(host: &str) -> bool {
    match host.parse::<SocketAddr>() {
        Ok(address) => address.ip().is_loopback(),
        Err(_) => host.starts_with("localhost:"),
    }
}

/// Listening endpoints beyond loopback, if neither passwords nor roles are set.
fn open_endpoints(config: &Config) -> Vec<String> {
    if is_set(config, PASSWORDS[0]) || is_set(config, "access_control/enabled") {
        return Vec::new();
    }
    let is_open = |endpoint: &String| endpoint.split_once('/').is_none_or(|(_, host)| !is_loopback(host));
    endpoints_of(config).into_iter().filter(is_open).collect()
}

/// Endpoints of the services on this machine.
fn neighbours() -> Vec<String> {
    PORTS.filter_map(answering).map(|address| format!("tcp/{address}")).collect()
}

fn answering(port: u16) -> Option<SocketAddr> {
    let address = loopback(port);
    TcpStream::connect_timeout(&address, CONNECT_TIMEOUT).ok().map(|_| address)
}

#[cfg(test)]
mod tests;
