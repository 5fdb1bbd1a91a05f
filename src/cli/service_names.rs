//! Names of the services of a run. A default name that is taken is numbered; a given one is refused.

use super::failure::CommandResult;
use crate::bus::{BadName, BusError, BusOptions, Name, NameClaim, Session, client};

/// Default name of a service.
pub(super) const NAME: &str = "crank";

/// The names that a run asks for.
pub(super) struct ServiceNames {
    /// The name that was given, or that of a resumed session; `None` is the default name.
    pub fixed: Option<Name>,
    /// Number of services.
    pub count: usize,
    /// Use names that other services have.
    pub force: bool,
}

/// Names with the claims that keep them.
type Taken = (Vec<Name>, Vec<NameClaim>);

impl ServiceNames {
    /// Takes the names, one per service.
    ///
    /// # Errors
    /// Fails if a given name is taken, or if zenoh fails.
    pub(super) fn take(&self, bus: &BusOptions, session: &Session) -> CommandResult<Taken> {
        let mut number = 1;
        loop {
            let names = self.numbered(number)?;
            match self.claim(&names, bus, session)? {
                Ok(claims) => return Ok((names, claims)),
                Err(taken) if self.fixed.is_some() => return Err(BusError::Taken(taken).into()),
                Err(_) => number += 1,
            }
        }
    }

    /// The names at the given attempt: `crank`, then `crank-2`; for several services `crank-001`, then `crank-2-001`.
    fn numbered(&self, attempt: u32) -> Result<Vec<Name>, BadName> {
        let base = match (&self.fixed, attempt) {
            (Some(fixed), _) => fixed.to_string(),
            (None, 1) => NAME.to_owned(),
            (None, attempt) => format!("{NAME}-{attempt}"),
        };
        match self.count {
            1 => Ok(vec![base.parse()?]),
            count => (1..=count).map(|member| format!("{base}-{member:03}").parse()).collect(),
        }
    }

    /// Claims the names, or returns one that is taken.
    fn claim(&self, names: &[Name], bus: &BusOptions, session: &Session) -> Result<Result<Vec<NameClaim>, Name>, BusError> {
        if self.force || bus.isolated {
            return Ok(Ok(Vec::new()));
        }
        let mut claims = Vec::new();
        // Services that listen elsewhere do not share a bus with those of this machine.
        for name in names.iter().filter(|_| bus.is_local()) {
            match NameClaim::take(name) {
                Some(claim) => claims.push(claim),
                None => return Ok(Err(name.clone())),
            }
        }
        let names: Vec<&Name> = names.iter().collect();
        let taken = bus.first_taken_through_endpoints(&names)?;
        let taken = if taken.is_some() { taken } else { client::first_taken(session, &names)? };
        Ok(taken.map_or(Ok(claims), Err))
    }
}

/// Where a service is on the bus: `on the bus as flexcrank/crank at tcp/127.0.0.1:7447`.
pub(super) fn on_the_bus(name: &Name, endpoints: &[String]) -> String {
    let at = if endpoints.is_empty() { String::new() } else { format!(" at {}", endpoints.join(", ")) };
    format!("on the bus as flexcrank/{name}{at}")
}
