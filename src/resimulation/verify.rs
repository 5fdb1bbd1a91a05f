//! Whether a recording is sound, physical, and what its scene and its commands give.

use super::ResimulationError;
use super::finding::Finding;
use super::physics::Physics;
use super::recheck::{Recomputed, recheck};
use super::recorded_session::RecordedSession;
use super::survey::{Survey, survey};
use crate::recording::Structure;

/// What a verification found.
#[derive(Debug, Clone, PartialEq)]
pub struct Verification {
    /// What the file is made of.
    pub structure: Structure,
    /// The worst that the laws allowed.
    pub physics: Physics,
    /// What was computed again.
    pub recomputed: Recomputed,
    /// From its first message to its last, simulated s.
    pub span_s: f64,
    /// All that is not as it should be.
    pub findings: Vec<Finding>,
}

impl Verification {
    /// Whether something is wrong, not only lost.
    pub fn is_wrong(&self) -> bool {
        self.findings.iter().any(|finding| !finding.is_loss())
    }
}

/// Reads a recording twice: for what the file says of itself, then computing it all again. `progress` is told which of the
/// readings it is, 0 or 1, and the byte reached.
///
/// # Errors
/// [`ResimulationError`] when it cannot be read, or its scene cannot be computed.
pub fn verify(source: &RecordedSession, progress: &dyn Fn(u8, u64)) -> Result<Verification, ResimulationError> {
    let survey = survey(source, &|position| progress(0, position))?;
    let (recomputed, differing) = recheck(source, &survey, &|position| progress(1, position))?;
    let Survey { structure, physics, mut findings, span_ns, .. } = survey;
    findings.extend(differing);
    let span_s = span_ns.map_or(0.0, |[first, last]| (last - first) as f64 * 1e-9);
    Ok(Verification { structure, physics, recomputed, span_s, findings })
}
