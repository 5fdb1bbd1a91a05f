//! The work of tension: a link under tension resists bending. Where coordinates are places of nodes, the stiffness against
//! stretching has that among it.

use super::parts::Part;
use super::shape::LinkShape;

/// Counts as bending what the tension of a link, by its elements' axial forces, has among the energy of stretching.
pub(super) fn count_as_bending(energies: &mut [(Part, f64)], link: &LinkShape, axial_n: &[f64]) {
    let place = |part: Part| energies.iter().position(|(other, _)| *other == part);
    let places = (place(Part::Bending(link.link)), place(Part::Stretching(link.link)));
    let (Some(bending), Some(stretching)) = places else { return };
    let moved = link.work_of_tension(axial_n).clamp(-energies[bending].1, energies[stretching].1);
    energies[bending].1 += moved;
    energies[stretching].1 -= moved;
}

impl LinkShape {
    /// `∫ N |w′|² ds` with w across each element. The elements of `mechanics::finite_element` have `d² + b²/12 + c²/10` for
    /// `∫ |w′|² ds/ℓ`, `d = (w₂ − w₁)/ℓ`, `b = w₂′ − w₁′`, `c = 2d − w₁′ − w₂′`.
    fn work_of_tension(&self, axial_n: &[f64]) -> f64 {
        let elements = self.at_m.windows(2).zip(self.displacement.windows(2)).zip(self.turn.windows(2)).zip(axial_n);
        let work = elements.map(|(((at, moved), turn), axial_n)| {
            let along = [0, 1].map(|c| at[1][c] - at[0][c]);
            let length_m = along[0].hypot(along[1]);
            let (sin, cos) = (along[1].atan2(along[0]) - self.chord_rad).sin_cos();
            let d = ((moved[1][1] - moved[0][1]) * cos - (moved[1][0] - moved[0][0]) * sin) / length_m;
            let (b, c) = (turn[1] - turn[0], d * 2.0 - turn[0] - turn[1]);
            axial_n * length_m * (d.norm_sqr() + b.norm_sqr() / 12.0 + c.norm_sqr() / 10.0)
        });
        work.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Crank, Kind, Mode, Part, Subject, modes};
    use crate::scene::SceneSource;

    type Tested = Result<(), Box<dyn std::error::Error>>;

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
