//! The change of a recorded session that a what-if asks about.

/// A pulse added to a recorded session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AddedPulse {
    /// Start, simulated s since the session began.
    pub start_s: f64,
    /// Mean torque, N·m.
    pub torque_nm: f64,
    /// Duration, s.
    pub duration_s: f64,
}

/// Changes to a recorded session.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Change {
    /// Added pulses.
    pub pulses: Vec<AddedPulse>,
    /// `KEY=VALUE` overrides of the scene.
    pub overrides: Vec<String>,
    /// The command line, for the new recording.
    pub command_line: String,
}
