//! The scene of a sweep, and its properties that the axes need.

use std::f64::consts::PI;

use crate::scene::{Chain, End, SceneSource};

/// The sweep needs another scene.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{origin}: the extremes are swept on a crank-slider with a [slider] whose links both have a section and a modulus, though one \
     may be rigid: give those instead of mass_kg, or judge the step of this scene by `flexcrank check`"
)]
pub struct NotSuited {
    origin: String,
}

/// The scene of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseScene {
    /// Name of the scene.
    pub origin: String,
    /// Its TOML.
    pub text: String,
    /// Length of crank and rod, m.
    pub lengths_m: [f64; 2],
    /// Mass of the rod, kg.
    pub rod_mass_kg: f64,
    /// First bending frequency of the rod between its pins, rad/s.
    pub rod_resonance_rad_per_s: f64,
    /// Whether crank and rod give a `section` (else `area_m2` and `second_moment_m4`).
    shaped: [bool; 2],
}

impl BaseScene {
    /// Prepares a scene for a sweep.
    ///
    /// # Errors
    /// [`NotSuited`] unless it is a crank-slider of two bars.
    pub fn new(source: &SceneSource) -> Result<Self, NotSuited> {
        let refused = || NotSuited { origin: source.origin.clone() };
        let chain = source.scene.chain().ok_or_else(refused)?;
        let Chain { links, end: End::Slider(_), .. } = chain else { return Err(refused()) };
        let [crank, rod] = links.as_slice() else { return Err(refused()) };
        let (Some(_), Some(bar)) = (crank.bar, rod.bar) else { return Err(refused()) };
        if links.iter().any(|link| link.bar.is_none_or(|bar| bar.bending_stiffness_nm2() == 0.0)) {
            return Err(refused());
        }
        let table: toml::Table = source.text.parse().map_err(|_| refused())?;
        let shaped = |link: &str| table.get(link).is_some_and(|link| link.get("section").is_some());
        // ω = (π/L)² sqrt(E J / (ρ A)) of a beam on two pins.
        let resonance = (PI / rod.length_m).powi(2) * (bar.bending_stiffness_nm2() / bar.mass_per_length_kg_per_m()).sqrt();
        Ok(BaseScene {
            origin: source.origin.clone(),
            text: source.text.clone(),
            lengths_m: [crank.length_m, rod.length_m],
            rod_mass_kg: rod.mass_kg,
            rod_resonance_rad_per_s: resonance,
            shaped: ["crank", "rod"].map(shaped),
        })
    }

    /// Overrides that give both links square sections, their sides the length over `slenderness`.
    pub(super) fn square_sections(&self, slenderness: f64) -> Vec<String> {
        let square = |(link, (length_m, shaped)): (&str, (f64, bool))| {
            let side_m = length_m / slenderness;
            if shaped {
                vec![format!("{link}.section={{ shape = \"rectangle\", width_m = {side_m:?}, height_m = {side_m:?} }}")]
            } else {
                let (area, moment) = (side_m * side_m, side_m.powi(4) / 12.0);
                vec![format!("{link}.area_m2={area:?}"), format!("{link}.second_moment_m4={moment:?}")]
            }
        };
        ["crank", "rod"].into_iter().zip(self.lengths_m.into_iter().zip(self.shaped)).flat_map(square).collect()
    }
}
