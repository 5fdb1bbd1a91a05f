//! The scene file as it is written: plain serde structs, nothing checked but names and types. No key is required here, so that a
//! misspelt one is not refused as missing, too: the validation refuses missing keys.

use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Scene {
    pub crank: Option<Link>,
    pub rod: Option<Link>,
    pub beam: Option<Link>,
    pub slider: Option<Slider>,
    #[serde(default)]
    pub base: Base,
    pub tip: Option<Tip>,
    #[serde(default)]
    pub gravity: Gravity,
    #[serde(default)]
    pub start: Start,
    pub drive: Option<Drive>,
    #[serde(default)]
    pub pulse: Vec<Pulse>,
    pub torque: Option<Torque>,
    #[serde(default)]
    pub commands: Commands,
    pub oscillator: Option<Oscillator>,
    #[serde(default)]
    pub solver: Solver,
    #[serde(default)]
    pub level: Vec<Level>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Level {
    pub name: Option<String>,
    #[serde(default)]
    pub changes: Vec<String>,
    pub error_rad: Option<f64>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Link {
    pub length_m: Option<f64>,
    pub area_m2: Option<f64>,
    pub second_moment_m4: Option<f64>,
    pub section: Option<Section>,
    pub density_kg_per_m3: Option<f64>,
    pub youngs_modulus_pa: Option<f64>,
    pub elements: Option<i64>,
    pub rigid: Option<bool>,
    pub mass_kg: Option<f64>,
    pub centre_of_mass_m: Option<f64>,
    pub inertia_kg_m2: Option<f64>,
    pub modes: Option<i64>,
    pub axial: Option<bool>,
    pub damping_s: Option<f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Section {
    pub shape: Option<SectionShape>,
    pub width_m: Option<f64>,
    pub height_m: Option<f64>,
    pub diameter_m: Option<f64>,
    pub outer_m: Option<f64>,
    pub inner_m: Option<f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum SectionShape {
    Rectangle,
    Round,
    Tube,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Oscillator {
    pub masses_kg: Option<Vec<f64>>,
    #[serde(default)]
    pub springs: Vec<Vec<f64>>,
    pub forces_n: Option<Vec<f64>>,
    pub start_m: Option<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Slider {
    pub mass_kg: Option<f64>,
    pub resistance_n: Option<f64>,
    pub friction_n_s_per_m: Option<f64>,
    pub resistance_table: Option<Vec<Vec<f64>>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Base {
    pub torsion_spring_nm_per_rad: Option<f64>,
    pub damper_nm_s_per_rad: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tip {
    pub mass_kg: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Gravity {
    pub x_m_per_s2: Option<f64>,
    pub y_m_per_s2: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Start {
    pub angle_rad: Option<f64>,
    pub rate_rad_per_s: Option<f64>,
    pub static_equilibrium: Option<bool>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Drive {
    pub speed_rad_per_s: Option<f64>,
    pub ramp: Option<Ramp>,
    pub table: Option<Vec<Vec<f64>>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ramp {
    pub to_rad_per_s: Option<f64>,
    pub over_s: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Pulse {
    pub start_s: Option<f64>,
    pub torque_nm: Option<f64>,
    pub duration_s: Option<f64>,
    pub shape: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Torque {
    pub constant_nm: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Commands {
    pub torque_limit_nm: Option<f64>,
    pub pending_limit: Option<i64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Solver {
    pub model: Option<String>,
    pub integrator: Option<String>,
    pub step_s: Option<f64>,
    pub weight: Option<f64>,
    pub rho_infinity: Option<f64>,
    pub tolerance: Option<f64>,
    pub balance_tolerance: Option<f64>,
    pub max_iterations: Option<i64>,
    pub corrections: Option<i64>,
}
