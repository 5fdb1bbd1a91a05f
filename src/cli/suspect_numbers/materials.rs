//! Materials that look like mistakes: moduli in GPa, densities in g/cm³, damping ratios in place of times.

use std::f64::consts::PI;

use crate::scene::{Bar, Link};
use crate::shown::figure;

/// No material is softer, Pa: the softest foams have this modulus.
const SOFTEST_PA: f64 = 1e4;
/// Waves √(E/ρ) are not slower in solids that links are made of, m/s: rubber has 30 m/s and more, and steel 5000 m/s, which is
/// 5 m/s with the modulus in MPa.
const SLOWEST_WAVE_M_PER_S: f64 = 7.0;
/// Only foams and other cellular materials are lighter, kg/m³.
const LIGHTEST_SOLID_KG_PER_M3: f64 = 500.0;
/// No material is stiffer, Pa: diamond has 1.2e12.
const STIFFEST_PA: f64 = 1.3e12;
/// Only foams and other soft materials are lighter, kg/m³. The densest material has 22.6 g/cm³.
const LIGHTEST_KG_PER_M3: f64 = 25.0;
/// Waves √(E/ρ) are slower in foams, m/s. With the density in g/cm³, those of wood have 120 km/s and more, and those of soft
/// polyethylene 15 km/s.
const FASTEST_FOAM_WAVE_M_PER_S: f64 = 1e4;
/// Densities up to here, kg/m³, stand for none, in models of links without mass, and so does a density of 1. Without a shape of the
/// section, all up to 1 may: density and area then stand for a mass per length.
const NO_DENSITY_KG_PER_M3: f64 = 0.1;
const UNIT_DENSITY_KG_PER_M3: f64 = 1.0;
/// Damping ratios of a link's first bending mode are smaller, except in models of links that hardly vibrate.
const STRONG_DAMPING: f64 = 0.5;
/// Smaller numbers are rarely damping ratios.
const LEAST_DAMPING_RATIO: f64 = 1e-3;

/// A warning of a modulus below that of any material, or of any solid so dense, as with one in GPa or MPa.
pub(super) fn soft_material(link: &Link) -> Option<String> {
    let bar = link.bar.filter(|_| !link.rigid)?;
    let (unit, exponent, _) = meant_modulus(&bar)?;
    let (name, given) = (link.name.as_str(), figure(bar.youngs_modulus_pa));
    let softer = if bar.youngs_modulus_pa < SOFTEST_PA { "any material" } else { "rubber for its density" };
    Some(format!(
        "{name}.youngs_modulus_pa = {given} is softer than {softer}: moduli are in Pa, and {given} {unit} is {given}e{exponent}"
    ))
}

/// The unit that a modulus is probably in if links are not made of anything so soft, its power of ten, and the modulus in Pa. A
/// rigid link may have none, which is 0.
fn meant_modulus(bar: &Bar) -> Option<(&'static str, i32, f64)> {
    let (given_pa, density) = (bar.youngs_modulus_pa, bar.density_kg_per_m3);
    let in_unit = |(unit, exponent)| (unit, exponent, given_pa * 10.0_f64.powi(exponent));
    let is_slow = density >= LIGHTEST_SOLID_KG_PER_M3 && (given_pa / density).sqrt() < SLOWEST_WAVE_M_PER_S;
    let is_soft = given_pa > 0.0 && (given_pa < SOFTEST_PA || is_slow);
    [("GPa", 9), ("MPa", 6)].map(in_unit).into_iter().find(|(.., meant_pa)| is_soft && *meant_pa <= STIFFEST_PA)
}

/// A warning of a material that is as light as a foam and far stiffer, as with a density in g/cm³.
pub(super) fn light_material(link: &Link) -> Option<String> {
    let bar = link.bar?;
    let modulus_pa = meant_modulus(&bar).map_or(bar.youngs_modulus_pa, |(.., meant_pa)| meant_pa);
    let given = bar.density_kg_per_m3;
    let has_shape = bar.extreme_fibre_m.is_some();
    let none_kg_per_m3 = if has_shape { NO_DENSITY_KG_PER_M3 } else { UNIT_DENSITY_KG_PER_M3 };
    let is_none = given <= none_kg_per_m3 || given == UNIT_DENSITY_KG_PER_M3;
    let is_light = !is_none && given < LIGHTEST_KG_PER_M3;
    let is_stiff = (modulus_pa / given).sqrt() > FASTEST_FOAM_WAVE_M_PER_S;
    let warning = || {
        let [given, meant] = [given, 1e3 * given].map(figure);
        format!(
            "{}.density_kg_per_m3 = {given} is lighter than any stiff material: densities are in kg/m³, and {given} g/cm³ is \
             {meant}",
            link.name.as_str()
        )
    };
    (is_light && is_stiff).then(warning)
}

/// A warning of damping that the model `incremental` does not compute.
pub(super) fn left_out_damping(link: &Link) -> Option<String> {
    let (name, given) = (link.name.as_str(), figure(link.damping_s));
    let warning = || format!("{name}.damping_s = {given} is left out: incremental has no damping of links");
    (link.damping_s > 0.0).then(warning)
}

/// A warning of damping so strong that its time is probably meant as a damping ratio. The first bending mode between pins,
/// `ω = (π/l)² √(EJ/ρA)`, has the damping ratio `½ ω damping_s`.
pub(super) fn strong_damping(link: &Link) -> Option<String> {
    let bar = link.bar.filter(|_| !link.rigid)?;
    let stiffness_per_mass = bar.bending_stiffness_nm2() / bar.mass_per_length_kg_per_m();
    let between_pins_rad_per_s = (PI / link.length_m).powi(2) * stiffness_per_mass.sqrt();
    let ratio = 0.5 * between_pins_rad_per_s * link.damping_s;
    let warning = || {
        let hz = figure(between_pins_rad_per_s / (2.0 * PI));
        let (name, given, percent) = (link.name.as_str(), figure(link.damping_s), 100.0 * ratio);
        let strength = if ratio < 1.0 { format!("by some {percent:.0} % of critical") } else { "beyond critical".to_owned() };
        format!(
            "{name}.damping_s = {given} damps its first bending between two pins, of {hz} Hz, {strength}: it is a time in s, not a \
             damping ratio: see `flexcrank guide scenes`"
        )
    };
    (link.damping_s >= LEAST_DAMPING_RATIO && ratio >= STRONG_DAMPING).then(warning)
}
