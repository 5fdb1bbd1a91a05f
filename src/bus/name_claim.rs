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
        Claim::take(&format!("{ROOT}/{name}")).map(NameClaim)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn prop_a_name_is_claimed_once_until_the_claim_is_dropped() -> Result<(), super::super::BadName> {
        let name: Name = format!("claimed-{}", std::process::id()).parse()?;
        let first = NameClaim::take(&name);
        assert!(first.is_some() && NameClaim::take(&name).is_none());
        drop(first);
        assert!(NameClaim::take(&name).is_some());
        let long: Name = "x".repeat(120).parse()?;
        assert!(NameClaim::take(&long).is_some(), "a name too long for a socket is left to the bus");
        Ok(())
    }
}
