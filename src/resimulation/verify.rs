//! Verification: whether a recording is intact, physical, and equal to what its scene and commands compute.

use super::ResimulationError;
use super::finding::Finding;
use super::physics::PhysicsCheck;
use super::recheck::{Recomputed, recheck};
use super::recorded_session::RecordedSession;
use super::survey::{Survey, survey};
use crate::recording::Structure;

/// Result of a verification.
#[derive(Debug, Clone, PartialEq)]
pub struct Verification {
    /// Counts of the file.
    pub structure: Structure,
    /// Largest joint gap.
    pub physics: PhysicsCheck,
    /// Result of the re-simulation.
    pub recomputed: Recomputed,
    /// Simulated time from the first message to the last, s.
    pub span_s: f64,
    /// Everything wrong or lost.
    pub findings: Vec<Finding>,
    /// Number of further findings of single messages, which are not kept.
    pub unlisted: u64,
}

impl Verification {
    /// Whether anything is wrong, not only lost.
    pub fn is_wrong(&self) -> bool {
        self.unlisted > 0 || self.findings.iter().any(|finding| !finding.is_loss())
    }
}

/// Verifies a recording in two readings: the first checks the file, the second re-simulates it. `progress` is called with the
/// reading, 0 or 1, and the position in bytes.
///
/// # Errors
/// [`ResimulationError`] if the recording cannot be read, or its scene cannot be computed.
pub fn verify(source: &RecordedSession, progress: &dyn Fn(u8, u64)) -> Result<Verification, ResimulationError> {
    let survey = survey(source, &|position| progress(0, position))?;
    let (recomputed, differing) = recheck(source, &survey, &|position| progress(1, position))?;
    let Survey { structure, physics, mut findings, unlisted, span_ns, .. } = survey;
    findings.extend(differing);
    let span_s = span_ns.map_or(0.0, |[first, last]| (last - first) as f64 * 1e-9);
    Ok(Verification { structure, physics, recomputed, span_s, findings, unlisted })
}
