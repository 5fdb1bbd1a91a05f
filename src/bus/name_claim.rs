//! Claims of service names on one machine.
//!
//! Two services that start at the same instant do not see each other on the bus yet. A claim decides at once which of them has the
//! name.

use super::keys::{Name, ROOT};
use crate::claim::Claim;

/// A name that this process has claimed, until this value is dropped.
#[derive(Debug)]
pub struct NameClaim(#[expect(dead_code, reason = "dropping it is what counts")] Claim);

impl NameClaim {
    /// Claims a name; `None` if another service on this machine has claimed it.
    pub fn take(name: &Name) -> Option<Self> {
        Claim::take(&key(name)).map(NameClaim)
    }

    /// Whether a service on this machine has claimed the name. Asking takes no claim, so that it disturbs no service that starts.
    pub fn is_taken(name: &Name) -> bool {
        Claim::is_taken(&key(name))
    }
}

fn key(name: &Name) -> String {
    format!("{ROOT}/{name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn prop_a_name_is_claimed_once_until_the_claim_is_dropped() -> Result<(), super::super::BadName> {
        let name: Name = format!("claimed-{}", std::process::id()).parse()?;
        assert!(!NameClaim::is_taken(&name));
        let first = NameClaim::take(&name);
        assert!(first.is_some() && NameClaim::take(&name).is_none() && NameClaim::is_taken(&name));
        // The beginning of a name is another name.
        assert!(!NameClaim::is_taken(&format!("claimed-{}", std::process::id() / 10).parse()?));
        drop(first);
        assert!(!NameClaim::is_taken(&name) && NameClaim::take(&name).is_some());
        let long: Name = "x".repeat(120).parse()?;
        assert!(NameClaim::take(&long).is_some(), "a name too long for a socket is left to the bus");
        Ok(())
    }
}
