//! Slow motion whose stiffness is rounding beside that of single elements.

use nalgebra::{Complex, DVector};

use super::linearised::Linearised;

/// The stiffness that holds a motion is taken for rounding if it is below this many times the bound of that.
const ROUNDED: f64 = 4.0;

/// Whether what holds a motion, `φᴴ K φ = −λ (λ + φᴴ D φ)`, is rounding. The decay of free motion under a damper, `λ = −φᴴ D φ`, is none.
pub(super) fn is_rounding(system: &Linearised, value: Complex<f64>, vector: &DVector<Complex<f64>>) -> bool {
    let [one, other] = [value.norm(), (value + damping(system, vector)).norm()];
    one < 2.0 * other && one * other < ROUNDED * rounding(system, vector)
}

/// The part of an eigenvalue that changes with a small change of the stiffness `k = φᴴ K φ` that holds its motion. From
/// `λ² + λ d + k = 0` with `d = φᴴ D φ`,
///
/// ```text
/// δλ = −δk/(2λ + d)
/// ```
///
/// and where that has no root but a double one, `√δk`.
pub(super) fn part_by(system: &Linearised, value: Complex<f64>, vector: &DVector<Complex<f64>>, change: f64) -> f64 {
    let split = (2.0 * value + damping(system, vector)).norm();
    (change / split).min(change.sqrt()) / value.norm()
}

/// `φᴴ D φ`.
pub(super) fn damping(system: &Linearised, vector: &DVector<Complex<f64>>) -> Complex<f64> {
    system.damping.iter().map(|(i, j, entry)| vector[i].conj() * vector[j] * entry).sum()
}

/// A bound of the rounding of `φᴴ K φ`.
///
/// Beside the terms of that product, tension is rounded: where strain is by as much as one unit is, a stretched element has a part of its
/// stiffness across. So each coordinate counts with the largest stiffness of itself and the two beside it, too.
pub(super) fn rounding(system: &Linearised, vector: &DVector<Complex<f64>>) -> f64 {
    let size: Vec<f64> = vector.iter().map(|x| x.norm()).collect();
    let (mut terms, mut stiffness) = (0.0, vec![0.0; size.len()]);
    for (i, j, entry) in system.stiffness.iter() {
        terms += size[i] * size[j] * entry.abs();
        if i == j {
            stiffness[i] = entry.abs();
        }
    }
    for (i, size) in size.iter().enumerate() {
        let beside = &stiffness[i.saturating_sub(1)..(i + 2).min(stiffness.len())];
        terms += size.powi(2) * beside.iter().copied().fold(0.0, f64::max);
    }
    f64::EPSILON * terms
}

#[cfg(test)]
mod tests {
    use crate::scene::SceneSource;
    use crate::small_motion::{Subject, modes};

    /// Without loads, every free turning of the chain has the eigenvalue 0 twice, or 0 and that of its damper. Of few elements along the
    /// axes, rounding of tension was a growth of 4e-4 1/s or a swing.
    #[test]
    fn prop_unloaded_finite_elements_turn_freely() -> Result<(), Box<dyn std::error::Error>> {
        const LINK: &str = "section = { shape = \"rectangle\", width_m = 0.005, height_m = 0.005 }\ndensity_kg_per_m3 = 2700\n\
                            youngs_modulus_pa = 7e10\n";
        const FINITE: &str = "[solver]\nmodel = \"finite-element\"\n";
        let two = format!("[crank]\nlength_m = 0.3\n{LINK}[rod]\nlength_m = 0.9\n{LINK}");
        for (name, text, free) in [
            ("beam", format!("[beam]\nlength_m = 0.3\n{LINK}"), 1),
            ("crank-slider", format!("{two}[slider]\nmass_kg = 0.2\n"), 1),
            ("two links", two.clone(), 2),
            ("damped beam", format!("[beam]\nlength_m = 0.3\n{LINK}[base]\ndamper_nm_s_per_rad = 0.01\n"), 1),
        ] {
            let links = if name.contains("beam") { &["beam"][..] } else { &["crank", "rod"] };
            for angle_rad in [0.0, 0.7, 2.0] {
                for elements in [1, 2, 3, 4, 6, 8, 16, 32, 64] {
                    let mut keys: Vec<String> = links.iter().map(|link| format!("{link}.elements={elements}")).collect();
                    keys.push(format!("start.angle_rad={angle_rad}"));
                    let scene = SceneSource::parse("free.toml", &format!("{text}{FINITE}"), &keys)?.scene;
                    let subject = Subject::new(&scene, None)?;
                    let found = modes(&subject, &subject.at_rest(angle_rad)?, 4)?;
                    let at_rest = found.iter().take_while(|mode| mode.eigenvalue.norm() == 0.0).count();
                    let slow = found.iter().filter(|mode| mode.eigenvalue.norm() < 1.0).count();
                    assert_eq!(
                        [at_rest, slow],
                        [free; 2],
                        "{name}, {elements} elements, {angle_rad} rad: {:?}",
                        found[0].eigenvalue
                    );
                }
            }
        }
        Ok(())
    }
}
