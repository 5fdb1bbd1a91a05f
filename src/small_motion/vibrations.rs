//! The natural frequencies of a scene.

use std::f64::consts::TAU;

use super::linearised::Linearised;
use super::mode::{Identifier, Kind};
use super::parts::Part;
use super::spectrum::{Eigenpair, lowest};
use super::{NoModes, Subject};
use crate::scene::Scene;

/// Most unknowns for which all eigenvalues are computed; the effort grows with the third power.
const MOST_UNKNOWNS: usize = 250;
/// Eigenvalues among which the lowest frequency is looked for: beside the highest, it is lost in rounding.
const NEAR: usize = 8;
/// Eigenvalues that differ by no more than this factor may be of the same size.
const ALIKE: f64 = 1.0 + 1e-6;

/// Undamped vibrations about the scene's start, at rest there, bent by weight and constant loads. Each unknown has a pair of the
/// eigenvalues λ of `λ² M + K`: `±i ω` is a vibration of the natural frequency ω, 0 is free motion, a real pair `±λ` is a fall.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Vibrations {
    /// Lowest and highest natural frequency, Hz; `None` if nothing vibrates.
    pub frequencies_hz: Option<[f64; 2]>,
    /// Lowest natural frequency of a mode that is named after the bending of a link, Hz; `None` if no link bends. A chain that swings,
    /// or that a base spring holds, has lower ones.
    pub lowest_bending_hz: Option<f64>,
    /// Number of vibrations.
    pub count: usize,
    /// Number of unknowns that fall: once moved from rest, they go on, as a beam does that stands on its end.
    pub falling: usize,
}

impl Vibrations {
    /// The vibrations of a scene; `None` for too many unknowns to compute all.
    ///
    /// # Errors
    /// [`NoModes`] where the model has no tangent, or no state of rest is found.
    pub fn of_scene(scene: &Scene) -> Result<Option<Self>, NoModes> {
        let subject = Subject::new(scene, None)?;
        let point = subject.at_rest(subject.start_rad()?)?;
        let unknowns = point.q.len();
        if unknowns == 0 {
            return Ok(Some(Vibrations::default()));
        }
        if unknowns > MOST_UNKNOWNS {
            return Ok(None);
        }
        let mut identifier = Identifier::new(&subject, &point)?;
        let damping = &identifier.system.damping;
        let system = Linearised { damping: damping.combine(0.0, damping, 0.0), ..identifier.system.clone() };
        // Both eigenvalues of a fall are found, and one of any other pair.
        let mut pairs = lowest(&system, NEAR.min(2 * unknowns))?;
        // Rounding of the fastest makes a slow vibration or a fall of free motion, where all are sought at once: behind the first few
        // come the others. The last of the first may have others of the same size, and is taken from among all.
        let cut = pairs.iter().map(|pair| pair.value.norm()).fold(0.0, f64::max) / ALIKE;
        pairs.retain(|pair| pair.value.norm() < cut);
        pairs.extend(lowest(&system, 2 * unknowns)?.into_iter().filter(|pair| pair.value.norm() >= cut));
        let all = frequencies_hz(&pairs);
        let bending = pairs.iter().find(|pair| bends(&mut identifier, pair));
        Ok(Some(Vibrations {
            frequencies_hz: all.first().zip(all.last()).map(|(lowest_hz, highest_hz)| [*lowest_hz, *highest_hz]),
            lowest_bending_hz: bending.map(|pair| pair.value.im / TAU),
            count: all.len(),
            falling: pairs.iter().filter(|pair| pair.value.im == 0.0 && pair.value.re > 0.0).count(),
        }))
    }
}

/// Whether a pair is a vibration that bends a link, as [`super::Mode`] names it.
fn bends(identifier: &mut Identifier, pair: &Eigenpair) -> bool {
    pair.value.im > 0.0 && matches!(identifier.identify(pair.value, pair.vector.clone()).kind, Kind::Vibration(Part::Bending(_)))
}

/// Frequencies of the vibrations among the pairs, in their order: the lowest first.
fn frequencies_hz(pairs: &[Eigenpair]) -> Vec<f64> {
    pairs.iter().map(|pair| pair.value.im / TAU).filter(|hz| *hz > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{NormalMode, NormalModes};
    use super::*;
    use crate::scene::SceneSource;

    fn vibrations(scene: &str, overrides: &[&str]) -> Result<(Vibrations, usize), Box<dyn std::error::Error>> {
        let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
        let source = SceneSource::open(scene, &overrides)?;
        let unknowns = Subject::new(&source.scene, None)?.mechanism().degrees_of_freedom();
        Ok((Vibrations::of_scene(&source.scene)?.ok_or("too many unknowns")?, unknowns))
    }

    /// Twelve masses on equal springs: eight of them were counted.
    #[test]
    fn regress_vibrations_of_one_frequency_are_all_counted() -> Result<(), Box<dyn std::error::Error>> {
        let springs: Vec<String> = (1..=12).map(|mass| format!("[0, {mass}, 100.0]")).collect();
        let scene =
            format!("[oscillator]\nmasses_kg = {:?}\nsprings = [{}]\n[solver]\nstep_s = 0.01\n", [1.0; 12], springs.join(", "));
        let found = Vibrations::of_scene(&SceneSource::parse("masses.toml", &scene, &[])?.scene)?.ok_or("too many unknowns")?;
        assert_eq!((found.count, found.falling), (12, 0));
        Ok(())
    }

    /// A cantilever: β₁ L = 1.87510407 in f = (β₁ L)² √(E I / ρ A) / (2π L²).
    #[test]
    fn val_the_lowest_frequency_of_a_cantilever() -> Result<(), Box<dyn std::error::Error>> {
        let clamped = ["solver.model=finite-element", "solver.integrator=generalized-alpha", "beam.elements=8", "pulse=[]"];
        let clamped = [&clamped[..], &["drive.speed_rad_per_s=0"]].concat();
        let (found, _) = vibrations("thesis-beam", &clamped)?;
        let lowest_hz = found.frequencies_hz.ok_or("nothing vibrates")?[0];
        let exact_hz = 1.875_104_07_f64.powi(2) * f64::sqrt(2.1e11 * 1e-5 / (7700.0 * 0.01)) / (TAU * 0.25);
        assert!((lowest_hz / exact_hz - 1.0).abs() < 1e-5, "{lowest_hz} for {exact_hz}");
        Ok(())
    }

    /// A beam of the moment of inertia I about its hinge, on a spring of 10 N·m/rad: it turns at ω = √(k/I), and bends as one that
    /// is hinged at one end: β₁ L = 3.92660231.
    #[test]
    fn regress_the_lowest_bending_frequency_is_none_of_a_base_spring() -> Result<(), Box<dyn std::error::Error>> {
        let beam = ["solver.model=finite-element", "solver.integrator=generalized-alpha", "beam.elements=8", "pulse=[]"];
        let (found, _) = vibrations("thesis-beam", &beam)?;
        let turning_hz = f64::sqrt(10.0 / (7700.0 * 0.01 * 0.5_f64.powi(3) / 3.0)) / TAU;
        let bending_hz = 3.926_602_31_f64.powi(2) * f64::sqrt(2.1e11 * 1e-5 / (7700.0 * 0.01)) / (TAU * 0.25);
        let lowest_hz = found.frequencies_hz.ok_or("nothing vibrates")?[0];
        let found_hz = found.lowest_bending_hz.ok_or("nothing bends")?;
        assert!((lowest_hz / turning_hz - 1.0).abs() < 1e-4, "{lowest_hz} for {turning_hz}");
        assert!((found_hz / bending_hz - 1.0).abs() < 1e-4, "{found_hz} for {bending_hz}");
        assert_eq!(vibrations("crank-slider", &["solver.model=rigid"])?.0.lowest_bending_hz, None);
        Ok(())
    }

    /// Two masses on springs: x of the exact solution k − m ω² singular.
    #[test]
    fn val_the_frequencies_of_an_oscillator() -> Result<(), Box<dyn std::error::Error>> {
        let two = ["oscillator.masses_kg=[1.0,2.0]", "oscillator.springs=[[0,1,300.0],[1,2,200.0]]"];
        let (found, _) = vibrations("thesis-two-masses", &two)?;
        let Some([lowest_hz, highest_hz]) = found.frequencies_hz else { return Err("nothing vibrates".into()) };
        // det([500 − ω², −200; −200, 200 − 2 ω²]) = 2 ω⁴ − 1200 ω² + 60000
        let root = (1200.0_f64.powi(2) - 8.0 * 60000.0).sqrt();
        for (found_hz, square) in [(lowest_hz, (1200.0 - root) / 4.0), (highest_hz, (1200.0 + root) / 4.0)] {
            assert!((found_hz * TAU / square.sqrt() - 1.0).abs() < 1e-6, "{found_hz} for {square}");
        }
        assert_eq!(found.count, 2);
        Ok(())
    }

    /// The crank turns freely: all other unknowns vibrate, a rod as soft as rubber among them. Its frequencies are as the root of E.
    #[test]
    fn prop_free_motion_is_no_vibration_and_a_soft_link_is_none_either() -> Result<(), Box<dyn std::error::Error>> {
        let finite = ["solver.model=finite-element", "solver.integrator=generalized-alpha"];
        for model in [&[][..], &finite] {
            let (stiff, unknowns) = vibrations("crank-slider", model)?;
            let (soft, _) = vibrations("crank-slider", &[model, &["rod.youngs_modulus_pa=2.1e5"]].concat())?;
            assert_eq!([stiff.count + 1, soft.count + 1], [unknowns; 2], "{stiff:?} {soft:?}");
            let [stiff_hz, soft_hz] =
                [stiff, soft].map(|found| found.frequencies_hz.map_or(f64::NAN, |[lowest_hz, _]| lowest_hz));
            assert!((soft_hz * 1e3 / stiff_hz - 1.0).abs() < 0.01, "{soft_hz} for {stiff_hz}");
        }
        assert_eq!(vibrations("crank-slider", &["solver.model=rigid"])?.0.frequencies_hz, None);
        Ok(())
    }

    /// Above its balance a chain falls: one unknown, whose two eigenvalues are real. It must not hide the highest vibration.
    #[test]
    fn regress_standing_and_hanging_chains_have_the_vibrations_that_modes_finds() -> Result<(), Box<dyn std::error::Error>> {
        let beam = [
            "beam.area_m2=1e-4",
            "beam.second_moment_m4=8.333e-10",
            "beam.elements=4",
            "base.torsion_spring_nm_per_rad=0.0",
            "solver.integrator=generalized-alpha",
        ];
        let crank_slider = ["solver.integrator=generalized-alpha"];
        let fine = ["solver.integrator=generalized-alpha", "crank.elements=8", "rod.elements=8"];
        let cases = [
            ("thesis-beam", &beam[..], vec![1.5, -1.5]),
            ("crank-slider", &crank_slider[..], vec![0.7, 1.0, 2.5, -0.7, -1.0, -2.5]),
            ("crank-slider", &fine[..], vec![-1.3]),
        ];
        for (name, overrides, angles_rad) in cases {
            for angle_rad in angles_rad {
                for model in ["modal", "finite-element"] {
                    let own = [format!("solver.model={model}"), format!("start.angle_rad={angle_rad:?}")];
                    let given = [overrides, &own.each_ref().map(String::as_str), &["gravity.y_m_per_s2=-9.81"]].concat();
                    let (found, unknowns) = vibrations(name, &given)?;
                    let scene = SceneSource::open(name, &given.iter().map(|&given| given.to_owned()).collect::<Vec<_>>())?.scene;
                    let modes = |count: usize| -> Result<Vec<f64>, NoModes> {
                        let modes = NormalModes::new(&scene, angle_rad, count)?;
                        Ok(modes.modes().iter().map(NormalMode::frequency_hz).filter(|hz| *hz > 0.0).collect())
                    };
                    let (near, all) = (modes(NEAR)?, modes(2 * unknowns)?);
                    let said = format!("{name}, {model} at {angle_rad}: {found:?} of {unknowns}");
                    assert_eq!([found.count, found.falling], [all.len(), usize::from(angle_rad > 0.0)], "{said}");
                    assert_eq!(found.count + found.falling, unknowns, "{said}");
                    let [lowest_hz, highest_hz] = found.frequencies_hz.ok_or("nothing vibrates")?;
                    for (found_hz, hz) in [(lowest_hz, near.first()), (highest_hz, all.last())] {
                        assert!((found_hz / hz.ok_or("no mode")? - 1.0).abs() < 1e-6, "{said}: {found_hz} for {hz:?}");
                    }
                }
            }
        }
        Ok(())
    }

    /// A ruler on a stiff spring: nearly all of its points move to one side, as in a turn. That was called a swing, and its second bending
    /// the first.
    #[test]
    fn regress_the_first_bending_of_a_clamped_beam_is_no_swing() -> Result<(), Box<dyn std::error::Error>> {
        let ruler = "[beam]\nlength_m = 0.4\nsection = { shape = \"rectangle\", width_m = 0.025, height_m = 0.001 }\n\
                     density_kg_per_m3 = 7850\nyoungs_modulus_pa = 2.05e11\nelements = 8\nmodes = 3\n[base]\n";
        // (β₁ L)² √(E J/ρ A) / (2π L²)
        let clamped_hz = 1.875_104_07_f64.powi(2) * (2.05e11 * 1e-6 / 12.0 / 7850.0_f64).sqrt() / (TAU * 0.16);
        for model in ["modal", "finite-element"] {
            for (spring, within) in [("20.0", 0.15), ("200.0", 0.02), ("20000.0", 1e-3)] {
                let text = format!("{ruler}torsion_spring_nm_per_rad = {spring}\n[solver]\nmodel = \"{model}\"\n");
                let scene = SceneSource::parse("ruler.toml", &text, &[])?.scene;
                let modes = NormalModes::new(&scene, 0.0, 2)?;
                let names: Vec<String> = modes.modes().iter().map(|mode| mode.mode.name()).collect();
                assert_eq!(names, ["beam bending 1", "beam bending 2"], "{model} {spring}");
                let found_hz = Vibrations::of_scene(&scene)?.and_then(|found| found.lowest_bending_hz).ok_or("nothing bends")?;
                assert!((found_hz / clamped_hz - 1.0).abs() < within, "{model} {spring}: {found_hz} Hz, {clamped_hz} Hz clamped");
            }
        }
        Ok(())
    }
}
