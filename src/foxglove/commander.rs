//! The viewers' way to the command keys of the services: over the bus, if they may.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

use super::jobs::Jobs;
use crate::bus::{BusError, Name, Session, client};
use crate::wire::{CommandReply, Control, Setpoint, TorquePulse, control};

/// Receives the reply to a command, or why it was not sent.
pub(super) type Done = Box<dyn FnOnce(Result<CommandReply, String>) + Send>;

/// Sends commands of viewers, one after the other.
#[derive(Clone)]
pub(super) struct Commander {
    session: Session,
    jobs: Jobs,
    allowed: bool,
    ids: Arc<FreshIds>,
}

impl Commander {
    /// Sends commands only if they are `allowed`.
    pub fn new(session: Session, jobs: Jobs, allowed: bool) -> Self {
        Commander { session, jobs, allowed, ids: Arc::new(FreshIds::new()) }
    }

    /// The queue of the working thread.
    pub fn jobs(&self) -> &Jobs {
        &self.jobs
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Why nothing is sent to a key, if so.
    pub fn refusal(&self, key: &str) -> Option<String> {
        (!self.allowed).then(|| format!("`{key}` refuses: viewers send commands only with --foxglove-control"))
    }

    /// Sends a torque pulse.
    pub fn pulse(&self, name: &Name, pulse: TorquePulse, done: Done) {
        let pulse = TorquePulse { id: self.ids.unless(pulse.id), ..pulse };
        let name = name.clone();
        self.send(&name.torque(), move |session| client::pulse(session, &name, &pulse), done);
    }

    /// Sends a setpoint.
    pub fn setpoint(&self, name: &Name, setpoint: Setpoint, done: Done) {
        let setpoint = Setpoint { id: self.ids.unless(setpoint.id), ..setpoint };
        let name = name.clone();
        self.send(&name.setpoint(), move |session| client::setpoint(session, &name, &setpoint), done);
    }

    /// Sends a control command.
    pub fn control(&self, name: &Name, action: control::Action, done: Done) {
        let command = Control { id: self.ids.unless(String::new()), action: Some(action) };
        let name = name.clone();
        self.send(&name.control(), move |session| client::control(session, &name, &command), done);
    }

    fn send(&self, key: &str, send: impl FnOnce(&Session) -> Result<CommandReply, BusError> + Send + 'static, done: Done) {
        if let Some(why) = self.refusal(key) {
            return done(Err(why));
        }
        let (session, key) = (self.session.clone(), key.to_owned());
        self.jobs.submit(move |has_room| {
            done(match has_room {
                true => send(&session).map_err(|error| error.to_string()),
                false => Err(format!("`{key}` refuses: too many commands of viewers wait")),
            });
        });
    }
}

/// Ids of commands whose sender gave none.
struct FreshIds {
    begun: u128,
    count: AtomicU64,
}

impl FreshIds {
    fn new() -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        FreshIds { begun: since.as_nanos(), count: AtomicU64::new(0) }
    }

    /// The id that was given, or else a fresh one.
    fn unless(&self, given: String) -> String {
        if given.is_empty() { format!("foxglove-{:x}-{}", self.begun, self.count.fetch_add(1, Ordering::Relaxed)) } else { given }
    }
}
