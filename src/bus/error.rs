//! What can go wrong on the bus.

use std::path::PathBuf;

use super::keys::Name;

/// The bus could not be opened, or nobody answered on it.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The configuration was refused.
    #[error("zenoh configuration: {0}")]
    Config(String),
    /// The file with the configuration is none, or says what cannot be.
    #[error("--zenoh-config {}: {cause}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        cause: String,
    },
    /// The session could not be opened.
    #[error("cannot open a zenoh session: {0}")]
    Open(String),
    /// A client found nobody who lets it in.
    #[error("{0}: absent, or not permitted")]
    NotAdmitted(String),
    /// Something could not be declared, sent or received.
    #[error("zenoh: {0}")]
    Failed(String),
    /// All local ports are taken.
    #[error("no free port from 7447 to 7462 on 127.0.0.1: end a service, or give --listen tcp/127.0.0.1:PORT")]
    NoPort,
    /// No local port answers.
    #[error("no service is running on this machine: start one with `flexcrank run`, or give --connect tcp/HOST:PORT")]
    NoLocalService,
    /// There are services, but none of this name.
    #[error("no service named `{name}` answers{}: start it with `flexcrank run --name {name}`", others(.found))]
    NoSuchService {
        /// Whom we asked for.
        name: Name,
        /// Who is there.
        found: Vec<Name>,
    },
    /// There is a service of this name already.
    #[error("a service named `{0}` is running already: give another --name, or --force to speak under this one all the same")]
    Taken(Name),
    /// A query was not answered.
    #[error("no reply from `{0}`: absent, or not permitted")]
    NoReply(String),
    /// A torque was sent to a replay.
    #[error("`{0}` is a replay, and what was recorded takes no torque: send it to a service that runs")]
    Replay(Name),
    /// An answer could not be decoded.
    #[error("`{key}` answered something that is not {expected}: {cause}")]
    Undecodable {
        /// Who answered.
        key: String,
        /// What was expected.
        expected: &'static str,
        /// What the decoder says.
        cause: String,
    },
}

fn others(found: &[Name]) -> String {
    match found {
        [] => String::new(),
        found => {
            let names: Vec<String> = found.iter().map(Name::to_string).collect();
            format!(" (running: {})", names.join(", "))
        }
    }
}

/// What zenoh says, without where in its sources it says so: ` at …/tcp.rs:61.` tells a user nothing.
pub(super) fn message_of(error: &zenoh::Error) -> String {
    let mut said = String::new();
    let text = error.to_string();
    for part in text.split(" at ") {
        let (place, rest) = part.split_at(part.find([' ', ']', ',', ';']).unwrap_or(part.len()));
        if !said.is_empty() && place.contains(".rs:") {
            said.push_str(rest);
        } else {
            said.push_str(if said.is_empty() { "" } else { " at " });
            said.push_str(part);
        }
    }
    said
}

impl BusError {
    pub(super) fn config(error: zenoh::Error) -> Self {
        BusError::Config(message_of(&error))
    }
    pub(super) fn open(error: zenoh::Error) -> Self {
        BusError::Open(message_of(&error))
    }
    /// Zenoh says the same whoever does not answer or says no, in the words of its own types.
    pub(super) fn not_admitted(error: zenoh::Error) -> Self {
        BusError::NotAdmitted(
            message_of(&error).replace("[Single(", "").replace(")]", "").trim_end_matches(['!', ' ']).to_owned(),
        )
    }
    pub(super) fn failed(error: zenoh::Error) -> Self {
        BusError::Failed(message_of(&error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_place_in_the_sources_is_left_out_and_nothing_else() {
        for (told, wanted) in [
            ("no key `a//b` at /x/zenoh-1.0/src/key.rs:777.", "no key `a//b`"),
            ("tcp: [refused (error 99) at /x/tcp.rs:61.] at /x/unicast.rs:338.", "tcp: [refused (error 99)]"),
            ("a lock held at noon at /x/a.rs:1., and at night", "a lock held at noon, and at night"),
            ("nothing", "nothing"),
        ] {
            assert_eq!(message_of(&told.into()), wanted);
        }
    }
}
