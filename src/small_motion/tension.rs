//! The work of tension. Where coordinates are places of nodes, the stiffness against stretching has it among it, in three parts:
//!
//! - A link under tension resists bending: that counts as bending.
//! - A link that turns by θ moves its nodes on straight lines, which would make it longer by `½ ∫ θ² ds`. The work of tension on that is
//!   the energy against the loads that pull the link, such as its weight, whose own is linear in those coordinates. No link is strained.
//! - A rigid link before it has an angle for its coordinate: as that turns by θ, the pin between them moves on a circle, and falls behind
//!   its tangent by `½ l θ²`, against the tension there. No link is strained either.

use nalgebra::Complex;

use super::parts::Part;
use super::shape::LinkShape;

/// Takes the work of a link's tension, by its elements' axial forces, out of the energy of stretching. What it does against bending
/// counts as bending, what it does as its chord or a rigid link `before` it turns as no strain.
pub(super) fn take_out_tension(energies: &mut [(Part, f64)], link: &LinkShape, before: Option<&LinkShape>, axial_n: &[f64]) {
    let place = |part: Part| energies.iter().position(|(other, _)| *other == part);
    let places = (place(Part::Bending(link.link)), place(Part::Stretching(link.link)));
    let (Some(bending), Some(stretching)) = places else { return };
    let rigid = before.filter(|before| place(Part::Bending(before.link)).is_none());
    let on_pin = rigid.zip(axial_n.first()).map_or(0.0, |(rigid, pull_n)| {
        pull_n * (link.chord_rad - rigid.chord_rad).cos() * rigid.length_m() * rigid.turn_of_chord().norm_sqr()
    });
    let [whole, beside_chord] = [Complex::default(), link.turn_of_chord()].map(|turn| link.work_of_tension(axial_n, turn));
    energies[stretching].1 -= (whole + on_pin).max(0.0).min(energies[stretching].1);
    // Pressure takes from the stiffness against bending, beyond Euler's load more than all of it: the link is strained nevertheless.
    energies[bending].1 += beside_chord.max(0.0);
}

impl LinkShape {
    /// Turn of the chord by the ends' displacements across it, rad.
    fn turn_of_chord(&self) -> Complex<f64> {
        let ends = self.displacement.first().zip(self.displacement.last());
        ends.map(|(first, last)| (last[1] - first[1]) / self.length_m().max(f64::MIN_POSITIVE)).unwrap_or_default()
    }

    /// `∫ N |w′ − θ|² ds` with w across each element, beside a turn θ. The elements of `mechanics::finite_element` have
    /// `d² + b²/12 + c²/10` for `∫ |w′|² ds/ℓ`, `d = (w₂ − w₁)/ℓ`, `b = w₂′ − w₁′`, `c = 2d − w₁′ − w₂′`.
    fn work_of_tension(&self, axial_n: &[f64], beside: Complex<f64>) -> f64 {
        let elements = self.at_m.windows(2).zip(self.displacement.windows(2)).zip(self.turn.windows(2)).zip(axial_n);
        let work = elements.map(|(((at, moved), turn), axial_n)| {
            let along = [0, 1].map(|c| at[1][c] - at[0][c]);
            let length_m = along[0].hypot(along[1]);
            let (sin, cos) = (along[1].atan2(along[0]) - self.chord_rad).sin_cos();
            let d = ((moved[1][1] - moved[0][1]) * cos - (moved[1][0] - moved[0][0]) * sin) / length_m;
            let (b, c) = (turn[1] - turn[0], d * 2.0 - turn[0] - turn[1]);
            axial_n * length_m * ((d - beside).norm_sqr() + b.norm_sqr() / 12.0 + c.norm_sqr() / 10.0)
        });
        work.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Crank, Kind, Mode, Part, Subject, Vibrations, modes};
    use crate::scene::SceneSource;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    /// Two bars that hang from a pivot, too stiff to bend as they swing.
    const HANGING: &str = r#"
[crank]
length_m = 0.4
section = { shape = "rectangle", width_m = 0.03, height_m = 0.01 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7e10
elements = 4

[rod]
length_m = 0.3
section = { shape = "rectangle", width_m = 0.03, height_m = 0.01 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7e10
elements = 4

[tip]
mass_kg = 0.1

[gravity]
y_m_per_s2 = -9.81

[solver]
step_s = 0.0005
"#;

    fn subject(scene: &str, overrides: &[&str], crank: Option<Crank>) -> Result<Subject, Box<dyn std::error::Error>> {
        let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
        Ok(Subject::new(&SceneSource::open(scene, &overrides)?.scene, crank)?)
    }

    fn first_part(mode: &Mode) -> Option<Part> {
        mode.shares.first().map(|share| share.part)
    }

    /// The crank-slider's rod stretches in a mode in which its nodes move across it, too.
    #[test]
    fn regress_a_mode_has_the_name_of_its_largest_share() -> Tested {
        let mesh = ["solver.model=finite-element", "solver.integrator=generalized-alpha", "crank.elements=2", "rod.elements=2"];
        for overrides in [&mesh[..0], &mesh[..]] {
            let subject = subject("crank-slider", overrides, None)?;
            for angle_deg in [0.0_f64, 10.0, 20.0, 57.0] {
                for mode in modes(&subject, &subject.at_rest(angle_deg.to_radians())?, 12)? {
                    if let Kind::Vibration(part) = mode.kind {
                        assert_eq!(first_part(&mode), Some(part), "{} at {angle_deg}°: {:?}", mode.name(), mode.shares);
                    }
                }
            }
        }
        let subject = subject("crank-slider", &[], None)?;
        let names: Vec<String> = modes(&subject, &subject.at_rest(20_f64.to_radians())?, 8)?.iter().map(Mode::name).collect();
        assert_eq!(names.last().map(String::as_str), Some("rod stretching 1"), "{names:?}");
        Ok(())
    }

    /// An arm with a rigid upper link, whose lower one hangs from a pin that moves on a circle: finite elements called its slow motions
    /// `rod stretching 1`, and `trade` said that they are lost.
    #[test]
    fn regress_a_link_that_hangs_from_a_rigid_one_is_not_stretched_as_both_swing() -> Tested {
        let crank = "[crank]\nlength_m = 0.4\nrigid = true\nmass_kg = 0.6\n";
        let rod = HANGING.split_once("[rod]").map_or("", |(_, rod)| rod);
        for (spring, angle_rad) in [("0.0", -1.57), ("0.0", -0.8), ("0.8", -1.57), ("0.8", -0.3), ("0.8", 1.2)] {
            let names = |model: &str| -> Result<Vec<String>, Box<dyn std::error::Error>> {
                let given = [format!("solver.model={model}"), format!("base.torsion_spring_nm_per_rad={spring}")];
                let scene = SceneSource::parse("arm.toml", &format!("{crank}[rod]{rod}[base]\n"), &given)?.scene;
                let subject = Subject::new(&scene, None)?;
                Ok(modes(&subject, &subject.at_rest(angle_rad)?, 4)?.iter().map(Mode::name).collect())
            };
            let [modal, finite] = [names("modal")?, names("finite-element")?];
            assert_eq!(modal, finite, "spring {spring} at {angle_rad}");
        }
        Ok(())
    }

    /// Rigid links have the same two swings; finite elements have the work of tension against weight.
    #[test]
    fn regress_both_swings_of_two_hanging_links_are_named_so_by_every_model() -> Tested {
        for angle_rad in [-1.57, -0.8] {
            let found = |model: &str| -> Result<(Vec<Mode>, Option<f64>), Box<dyn std::error::Error>> {
                let overrides = [format!("solver.model={model}"), format!("start.angle_rad={angle_rad}")];
                let scene = SceneSource::parse("hanging.toml", HANGING, &overrides)?.scene;
                let subject = Subject::new(&scene, None)?;
                let bending_hz = Vibrations::of_scene(&scene)?.and_then(|found| found.lowest_bending_hz);
                Ok((modes(&subject, &subject.at_rest(angle_rad)?, 2)?, bending_hz))
            };
            let (rigid, none) = found("rigid")?;
            assert_eq!(none, None);
            let mut lowest_hz = Vec::new();
            for model in ["modal", "finite-element"] {
                let (swings, bending_hz) = found(model)?;
                let names: Vec<String> = swings.iter().map(Mode::name).collect();
                assert_eq!(names, ["chain swing", "chain swing 2"], "{model} at {angle_rad}");
                for (swing, rigid) in swings.iter().zip(&rigid) {
                    let ratio = swing.frequency_hz() / rigid.frequency_hz();
                    assert!((ratio - 1.0).abs() < 1e-3, "{}, {model} at {angle_rad}: {ratio}", swing.name());
                }
                lowest_hz.push(bending_hz.ok_or("no link bends")?);
            }
            assert!(lowest_hz[0] > 100.0 && (lowest_hz[1] / lowest_hz[0] - 1.0).abs() < 0.01, "{lowest_hz:?}");
        }
        Ok(())
    }

    /// A beam that turns at 40 rad/s: all but a 500th of the stiffness as it swings on its base is the work of tension.
    #[test]
    fn regress_a_turning_beam_swings_on_the_spring_of_its_base_in_every_model() -> Tested {
        for model in ["solver.model=modal", "solver.model=finite-element"] {
            let beam = subject("thesis-beam", &[model, "solver.integrator=generalized-alpha", "pulse=[]"], None)?;
            let found = modes(&beam, &beam.turning(0.7, 40.0)?, 1)?;
            assert_eq!(found[0].name(), "beam torsion of the base", "{model}: {:?}", found[0].shares);
        }
        Ok(())
    }

    /// A rod under thrust: Euler's load is 768 N. Beyond it, finite elements called what buckles `chain rotation`, with the crank held.
    #[test]
    fn regress_a_link_that_buckles_is_bending_in_every_model() -> Tested {
        let rod = "[crank]\nlength_m = 0.5\nrigid = true\nmass_kg = 1.0\n[rod]\nlength_m = 1.5\n\
                   section = { shape = \"rectangle\", width_m = 0.01, height_m = 0.01 }\ndensity_kg_per_m3 = 7700.0\n\
                   youngs_modulus_pa = 2.1e11\nelements = 8\nmodes = 6\naxial = true\n[slider]\nmass_kg = 0.5\n";
        for model in ["modal", "finite-element"] {
            for thrust_n in [700.0, 760.0, 806.0, 1500.0] {
                let given = [format!("solver.model={model}"), format!("slider.resistance_n={thrust_n}")];
                let subject = Subject::new(&SceneSource::parse("rod.toml", rod, &given)?.scene, Some(Crank::Held))?;
                let found = modes(&subject, &subject.at_rest(0.0)?, 3)?;
                let names: Vec<String> = found.iter().map(Mode::name).collect();
                assert_eq!(names, ["rod bending 1", "rod bending 2", "rod bending 3"], "{model} under {thrust_n} N");
                // Euler: ω² = (π/L)⁴ EJ/ρA (1 − N/N_E), below 0 beyond N_E.
                let euler_n = std::f64::consts::PI.powi(2) * 2.1e11 * 1e-8 / 12.0 / 1.5_f64.powi(2);
                let square = euler_n * (1.0 - thrust_n / euler_n) * (std::f64::consts::PI / 1.5).powi(2) / 0.77;
                let off = (found[0].eigenvalue.norm_sqr() / square.abs() - 1.0).abs();
                assert!(off < 0.02 && (found[0].eigenvalue.im == 0.0) == (square < 0.0), "{model}, {thrust_n} N: {off}");
            }
        }
        Ok(())
    }

    /// Tension is most of what brings a slender beam back that turns at 40 rad/s; it does not stretch in that.
    #[test]
    fn val_tension_resists_bending() -> Tested {
        let slender = [
            "beam.area_m2=1e-4",
            "beam.second_moment_m4=8.333e-13",
            "beam.elements=16",
            "solver.model=finite-element",
            "solver.integrator=generalized-alpha",
            "pulse=[]",
            "base.torsion_spring_nm_per_rad=0.0",
            "solver.step_s=1e-3",
        ];
        let beam = subject("thesis-beam", &slender, Some(Crank::Held))?;
        for mode in modes(&beam, &beam.turning(0.7, 40.0)?, 5)? {
            assert!(matches!(mode.kind, Kind::Vibration(Part::Bending(_))), "{}: {:?}", mode.name(), mode.shares);
            assert!(mode.shares[0].share > 0.9, "{}: {:?}", mode.name(), mode.shares);
        }
        Ok(())
    }
}
