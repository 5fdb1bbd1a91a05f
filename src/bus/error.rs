//! Errors of the bus.

use std::path::PathBuf;

use super::keys::Name;
use super::zenoh_messages::message_of;
use crate::nearest::nearest;
use crate::shown::shown_sentence;

/// The bus could not be opened, or a request on it failed.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The configuration was refused.
    #[error("zenoh configuration: {0}")]
    Config(String),
    /// The configuration file is unreadable or invalid.
    #[error("--zenoh-config {}: {cause}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why it was refused.
        cause: String,
    },
    /// The session could not be opened.
    #[error("cannot open a zenoh session: {0}")]
    Open(String),
    /// The configuration needs TLS, and this build has none.
    #[error("this build has no TLS, which {0} needs: build it with `--features tls`")]
    NoTls(String),
    /// A port to listen on is in use.
    #[error("cannot listen on {0}: another program has the port; end it, or give another port, or port 0 for any free one")]
    InUse(String),
    /// No endpoint admitted the client.
    #[error("{0}: nothing listens there, or it does not admit this client; `flexcrank list` shows the services of this machine")]
    NotAdmitted(String),
    /// A declaration, publication or query failed.
    #[error("zenoh: {0}")]
    Failed(String),
    /// The system refused a thread.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
    /// A thread panicked.
    #[error("the thread `{0}` died")]
    Died(&'static str),
    /// All local ports are taken.
    #[error("no free port from 7447 to 7462 on 127.0.0.1: end a service, or give --listen tcp/127.0.0.1:PORT")]
    NoPort,
    /// No local port answers.
    #[error(
        "no service found at the usual ports of this machine: start one with `flexcrank run`, or give --connect tcp/HOST:PORT"
    )]
    NoLocalService,
    /// Something listens, and no service answers.
    #[error(
        "no service answers: start one with `flexcrank run`; one that was stopped (Ctrl-Z) goes on with `fg` or \
         `kill -CONT PID`, and one that hangs is to be ended"
    )]
    NoAnswer,
    /// A service of this machine has the name, and does not answer.
    #[error(
        "a service named `{0}` runs on this machine, but does not answer: one that was stopped (Ctrl-Z) goes on with `fg` or \
         `kill -CONT PID`, and one that hangs is to be ended"
    )]
    Silent(Name),
    /// No service has this name.
    #[error("no service named `{name}` answers{}", others(name, found))]
    NoSuchService {
        /// The requested name.
        name: Name,
        /// The services found.
        found: Vec<Name>,
    },
    /// Another service has this name.
    #[error("a service named `{0}` is running already: give another --name, or --force to use this one anyway")]
    Taken(Name),
    /// A query got no reply.
    #[error("no reply from `{0}`: absent, or not permitted")]
    NoReply(String),
    /// A query was refused.
    #[error("`{key}` refuses: {}", shown_sentence(why))]
    Refused {
        /// The key that was queried.
        key: String,
        /// The reason.
        why: String,
    },
    /// A torque pulse was sent to a replay.
    #[error("`{0}` is a replay, and replays accept no torque: send it to a running service")]
    Replay(Name),
    /// A reply could not be decoded.
    #[error("`{key}` answered something that is not a {expected}: {cause}")]
    Undecodable {
        /// The key that was queried.
        key: String,
        /// The expected type.
        expected: String,
        /// Why decoding failed.
        cause: String,
    },
}

/// The services found, and a way on: the one that was probably meant, or a start.
fn others(name: &Name, found: &[Name]) -> String {
    let found: Vec<String> = found.iter().map(Name::to_string).collect();
    let running = if found.is_empty() { String::new() } else { format!(" (running: {})", found.join(", ")) };
    match nearest(&name.to_string(), found.iter().map(String::as_str)) {
        Some(near) => format!("{running}; did you mean `{near}`? `flexcrank run --name {name}` starts another"),
        None => format!("{running}: start it with `flexcrank run --name {name}`"),
    }
}

impl BusError {
    pub(super) fn config(error: zenoh::Error) -> Self {
        BusError::Config(message_of(&error))
    }
    /// The configuration sets passwords, with this key, and this build has none.
    pub(super) fn no_passwords(key: &str) -> Self {
        BusError::Config(format!("this build has no passwords, which {key} needs: build it with `--features tls`"))
    }
    pub(super) fn open(error: zenoh::Error) -> Self {
        BusError::Open(message_of(&error))
    }
    /// zenoh reports absence and refusal alike, in terms of its own types.
    pub(super) fn not_admitted(error: zenoh::Error) -> Self {
        BusError::NotAdmitted(
            message_of(&error).replace("[Single(", "").replace(")]", "").trim_end_matches(['!', ' ']).to_owned(),
        )
    }
    pub(crate) fn failed(error: zenoh::Error) -> Self {
        BusError::Failed(message_of(&error))
    }
}
