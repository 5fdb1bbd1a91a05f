//! The quantities that maps vary: name of the column, words and unit.

/// A quantity along an axis of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// Name in tables, with unit: `step_s`.
    pub name: &'static str,
    /// Name in words.
    pub words: &'static str,
    /// Unit; empty if it has none.
    pub unit: &'static str,
}

impl Quantity {
    /// Words and unit: `step (s)`.
    pub fn labelled(&self) -> String {
        if self.unit.is_empty() { self.words.to_owned() } else { format!("{} ({})", self.words, self.unit) }
    }
}

const fn of(name: &'static str, words: &'static str, unit: &'static str) -> Quantity {
    Quantity { name, words, unit }
}

pub(super) const STEP: Quantity = of("step_s", "step", "s");
pub(super) const YOUNGS_MODULUS: Quantity = of("youngs_modulus_pa", "Young's modulus", "Pa");
pub(super) const SPEED: Quantity = of("speed_over_resonance", "crank speed / first resonance of the rod", "");
pub(super) const SLENDERNESS: Quantity = of("length_over_depth", "length of the links / depth", "");
pub(super) const RATIO: Quantity = of("ratio", "crank-to-rod ratio λ", "");
pub(super) const SLIDER_MASS: Quantity = of("slider_over_rod_mass", "mass of the slider / mass of the rod", "");
pub(super) const ELEMENTS: Quantity = of("elements", "elements per link", "");
pub(super) const MODES: Quantity = of("modes", "modes per link", "");
pub(super) const WEIGHT: Quantity = of("weight", "weight ϑ", "");
pub(super) const RHO_INFINITY: Quantity = of("rho_infinity", "spectral radius ρ∞", "");
pub(super) const TORQUE: Quantity = of("torque_nm", "torque of a pulse", "N·m");
pub(super) const DURATION: Quantity = of("duration_over_step", "duration of a pulse / step", "");
pub(super) const START_ANGLE: Quantity = of("start_angle_rad", "start angle of the crank", "rad");
pub(super) const START_RATE: Quantity = of("rate_rad_per_s", "start rate of the crank", "rad/s");
pub(super) const STEPS_PER_TURN: Quantity = of("steps_per_revolution", "steps per revolution", "");
pub(super) const SWITCH_TIME: Quantity = of("switch_s", "time of the switch", "s");
pub(super) const DAMPING: Quantity = of("damping_s", "damping of the links", "s");
pub(super) const DAMPER: Quantity = of("damper_nm_s_per_rad", "damper at the base", "N·m·s/rad");
pub(super) const FRICTION: Quantity = of("friction_n_s_per_m", "friction of the slider", "N·s/m");
