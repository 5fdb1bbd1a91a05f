//! Modes in plain numbers and words, for messages and tables.

use serde::{Deserialize, Serialize};

use super::beyond_shapes::BeyondShapes;
use super::mode::Mode;

/// One mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModeReport {
    /// Its name.
    pub name: String,
    /// Frequency of the vibration as it decays, Hz.
    pub frequency_hz: f64,
    /// `−Re λ/|λ|`.
    pub damping_ratio: f64,
    /// λ, 1/s: real and imaginary part.
    pub eigenvalue_per_s: [f64; 2],
    /// Part of the kinetic energy in turning of the chain as it is, 0 to 1.
    pub rigid_part: f64,
    /// Parts of the mechanism with their shares of the strain energy, the largest first.
    pub strain: Vec<(String, f64)>,
    /// The part of λ that rounding of the stiffness may change, 0 to 1.
    #[serde(default)]
    pub rounding: f64,
}

/// The modes of a running service at an instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LiveModes {
    /// Steps since the epoch began.
    pub step: u64,
    /// The epoch.
    pub epoch: u64,
    /// Simulated time since the epoch began, s.
    pub sim_time_s: f64,
    /// Rate of the first link, rad/s: of its tangent at the pivot where that is moved, else of its chord; 0 of an oscillator.
    pub crank_rate_rad_per_s: f64,
    /// Whether there are links, and no oscillator.
    #[serde(default = "has_crank")]
    pub has_crank: bool,
    /// Whether a prescribed motion moves the first link, or holds it.
    #[serde(default)]
    pub crank_is_moved: bool,
    /// The modes, lowest first.
    pub modes: Vec<ModeReport>,
    /// Those among them that stand for all higher ones.
    #[serde(default)]
    pub beyond_shapes: Vec<BeyondShapes>,
}

/// Services of earlier versions do not tell it.
fn has_crank() -> bool {
    true
}

impl From<&Mode> for ModeReport {
    fn from(mode: &Mode) -> Self {
        ModeReport {
            name: mode.name(),
            frequency_hz: mode.frequency_hz(),
            damping_ratio: mode.damping_ratio(),
            eigenvalue_per_s: [mode.eigenvalue.re, mode.eigenvalue.im],
            rigid_part: mode.rigid_part,
            strain: mode.shares.iter().map(|share| (share.part.to_string(), share.share)).collect(),
            rounding: mode.rounding,
        }
    }
}
