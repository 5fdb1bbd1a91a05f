//! Opening zenoh sessions: on loopback only, without multicast, unless the user says otherwise.

use std::fs::File;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use zenoh::{Config, Session, Wait};

use super::error::message_of;
use super::{BusError, Name, client};

/// Loopback ports that services take, the first free one each; clients look at all of them.
const PORTS: std::ops::Range<u16> = 7447..7463;
/// How long a loopback port may take to say that it is open.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(200);
/// How long those whom a service connects to may take to be there.
const LINK_TIMEOUT: Duration = Duration::from_secs(2);
/// Between two looks.
const POLL_PERIOD: Duration = Duration::from_millis(20);
const LISTEN: &str = "listen/endpoints";
const CONNECT: &str = "connect/endpoints";
const MULTICAST: &str = "scouting/multicast/enabled";
/// Small kernel buffers on the link, so that a reader that falls behind is not fed stale samples for seconds.
const SOCKET_BUFFERS: &str = "#so_sndbuf=65536;so_rcvbuf=65536";

/// What the user says about the network.
#[derive(Debug, Clone, Default)]
pub struct BusOptions {
    /// Endpoints to listen on, instead of a loopback port.
    pub listen: Vec<String>,
    /// Endpoints to connect to.
    pub connect: Vec<String>,
    /// A zenoh configuration file to start from. Where it does not say where to listen, that is on loopback.
    pub config: Option<PathBuf>,
    /// Let this session see who subscribes, as [`subscriptions`](super::subscriptions) needs.
    pub sees_subscriptions: bool,
}

impl BusOptions {
    /// What the file says, if there is one; what it does not say is safe: no multicast.
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

    /// Opens a session for a service, linked to its neighbours on this machine unless told otherwise. Waits a little for those
    /// whom it connects to, so that a service of the same name is seen.
    ///
    /// # Errors
    /// [`BusError`] when the configuration is bad or no endpoint can be taken.
    pub fn open_service(&self) -> Result<Session, BusError> {
        let config = self.service_config()?;
        let connects = is_set(&config, CONNECT) && (self.config.is_some() || !self.connect.is_empty());
        let whom = config.get_json(CONNECT).unwrap_or_default().replace(['[', ']', '"'], "").replace(',', ", ");
        let session = zenoh::open(config).wait().map_err(BusError::open)?;
        if connects && !is_linked(&session) {
            tracing::warn!("no link yet to {whom}: the service goes on alone, and keeps trying");
        }
        Ok(session)
    }

    fn service_config(&self) -> Result<Config, BusError> {
        let mut config = self.base_config()?;
        if self.sees_subscriptions {
            set(&mut config, "adminspace/enabled", "true")?;
        }
        if !self.listen.is_empty() {
            set(&mut config, LISTEN, &list(&self.listen))?;
        } else if !is_set(&config, LISTEN) && !is_client(&config) {
            set(&mut config, LISTEN, &list(&[format!("tcp/{}{SOCKET_BUFFERS}", free_port()?)]))?;
        }
        if !self.connect.is_empty() {
            set(&mut config, CONNECT, &list(&self.connect))?;
            // What listens on loopback elsewhere is told of, too, and is nothing to connect to here.
            set(&mut config, "scouting/gossip/enabled", "false")?;
        } else if self.config.is_none() && self.listen.is_empty() {
            set(&mut config, CONNECT, &list(&neighbours()))?;
        }
        Ok(config)
    }

    /// Opens a session for a client: to the endpoints given, or to every service on this machine.
    ///
    /// # Errors
    /// [`BusError::NoLocalService`] when no local port answers; [`BusError`] when the configuration is bad or nothing can be opened.
    pub fn open_client(&self) -> Result<Session, BusError> {
        let config = self.client_config()?;
        let refused = if is_client(&config) { BusError::not_admitted } else { BusError::open };
        zenoh::open(config).wait().map_err(refused)
    }

    /// The first of `names` that a service has which is to be seen from where this one is to connect to: behind a router, it is
    /// not seen by the service itself. Whoever cannot be reached is taken for empty.
    ///
    /// # Errors
    /// [`BusError`] when zenoh fails.
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
            // Routers hand on nothing between peers.
            if self.connect.len() == 1 && self.config.is_none() && self.listen.is_empty() {
                set(&mut config, "mode", "\"client\"")?;
            }
        } else if self.config.is_none() && self.listen.is_empty() {
            let here = neighbours();
            if here.is_empty() {
                return Err(BusError::NoLocalService);
            }
            set(&mut config, CONNECT, &list(&here))?;
        }
        Ok(config)
    }
}

fn read(path: &Path) -> Result<Config, String> {
    File::open(path).map_err(|error| error.to_string())?;
    Config::from_file(path).map_err(|error| config_error_text(&message_of(&error)))
}

/// What zenoh's reader of files says, which is `… { msg: "WORDS", location: Some(Location { line: 1, column: 3 }) }`.
fn config_error_text(said: &str) -> String {
    let parts = said.split_once("msg: ").and_then(|(_, rest)| rest.rsplit_once(", location: Some(Location { line: "));
    match parts.and_then(|(words, place)| Some((words, place.split_once(',')?.0))) {
        Some((words, line)) => format!("line {line}: {}", words.trim_matches('"')),
        None => said.to_owned(),
    }
}

/// Whether a configuration says something other than zenoh does by itself.
fn is_set(config: &Config, key: &str) -> bool {
    config.get_json(key).ok() != Config::default().get_json(key).ok()
}

fn is_client(config: &Config) -> bool {
    config.get_json("mode").is_ok_and(|mode| mode == "\"client\"")
}

/// Whether there is somebody at the other end, at the latest after two seconds.
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

fn free_port() -> Result<SocketAddr, BusError> {
    PORTS.map(loopback).find(|address| TcpListener::bind(address).is_ok()).ok_or(BusError::NoPort)
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
mod tests {
    use super::*;

    #[test]
    fn prop_a_file_opens_up_no_more_than_it_says() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("zenoh.json5");
        let options = BusOptions { config: Some(file.clone()), ..BusOptions::default() };
        let told = |config: Config, key: &str| config.get_json(key).unwrap_or_default();
        std::fs::write(
            &file,
            r#"{ transport: { link: { tx: { lease: 5000 } } }, connect: { endpoints: ["tcp/127.0.0.1:9"] } }"#,
        )?;
        let listens = told(options.service_config()?, LISTEN);
        assert!(listens.contains("tcp/127.0.0.1:") && !listens.contains("[::]"), "{listens}");
        assert_eq!(told(options.client_config()?, LISTEN), "[]");
        assert_eq!(told(options.service_config()?, MULTICAST), "false");
        assert!(told(options.service_config()?, CONNECT).contains("tcp/127.0.0.1:9"));
        std::fs::write(&file, r#"{ listen: { endpoints: ["tcp/127.0.0.2:0"] }, scouting: { multicast: { enabled: true } } }"#)?;
        for config in [options.service_config()?, options.client_config()?] {
            assert_eq!(told(config.clone(), MULTICAST), "true");
            assert!(told(config, LISTEN).contains("tcp/127.0.0.2:0"));
        }
        Ok(())
    }
}
