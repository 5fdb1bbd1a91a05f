//! The vibrations that a configuration loses: by a model too coarse, or by a step too long.

use std::fmt;

use nalgebra::Complex;

use super::Study;
use super::configuration::{Configuration, Family};
use super::excitation::{BEYOND, Excitation, ExcitedMode, NoExcitation, on_nodes};
use crate::scene::Scene;
use crate::small_motion::scheme::Scheme;
use crate::small_motion::{Kind, LinkShape, ModalEquation, NoModes, NormalMode, NormalModes, SchemeStep, likeness};

/// A vibration whose eigenvalue is off by more than this part is lost.
const LOST: f64 = 0.1;
/// Least likeness of two shapes that are one mode.
const ALIKE: f64 = 0.5;

/// The vibrations of a scene and what each configuration of a study makes of them.
#[derive(Debug, Clone, PartialEq)]
pub struct LostModes {
    /// The vibrations.
    pub excitation: Excitation,
    /// A vibration that changes no output by more than this is not missed.
    pub tolerance: f64,
    /// For each row of the study, its errors in each vibration beyond that; `None` of a model without a linearisation.
    pub rows: Vec<Option<Vec<ModeError>>>,
}

/// Errors of a configuration in one vibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeError {
    /// Its place among the vibrations.
    pub mode: usize,
    /// Frequency over the true one, less 1; NaN where the model has no such vibration.
    pub frequency: f64,
    /// Damping ratio less the true one.
    pub damping: f64,
    /// Relative error of an output that it brings about, roughly: its part there times `|λ_h − λ| t`, at most 1, as
    /// `e^(λ_h t) − e^(λt)` says at the end of the run or when the vibration has decayed by e.
    pub expected: f64,
    /// The reason for which it is lost.
    pub lost: Option<Reason>,
}

/// The reason for which a vibration is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Mesh, number of modes, or rigid links.
    Model,
    /// The step of the integrator.
    Step,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Reason::Model => "model",
            Reason::Step => "step",
        })
    }
}

impl ExcitedMode {
    /// Whether its vibration changes an output that counts by more than a tolerance.
    pub fn vibrates(&self, tolerance: f64) -> bool {
        self.output_part > tolerance
    }

    /// Whether its displacement does only as it follows the load.
    pub fn follows(&self, tolerance: f64) -> bool {
        !self.vibrates(tolerance) && self.following_part > tolerance
    }
}

impl LostModes {
    /// The vibrations that the study's scene excites, and the errors of every configuration in those that change an output by more than
    /// `tolerance`.
    ///
    /// Modes are those at rest at the start's crank angle. A configuration's partner of a vibration is the mode of its model with the
    /// most similar shape; its step gives that the eigenvalue `λ_h`, see [`ModalEquation::eigenvalue_by`]. The vibration is lost
    ///
    /// - by the model, if it has no partner, or one with `|λ_model − λ| > 0.1 |λ|`;
    /// - by the step, if `|λ_h − λ_model| > 0.1 |λ_model|`, or its period has fewer than two steps.
    ///
    /// A deflection that only follows its load is lost by a model that has fewer modes of its kind: `rod bending 3` by a rod of one mode.
    ///
    /// # Errors
    /// [`NoExcitation`] where nothing vibrates.
    pub fn new(scene: &Scene, study: &Study, tolerance: f64) -> Result<Self, NoExcitation> {
        let excitation = Excitation::new(scene, &study.grid, &study.reference.scales, &study.outputs)?;
        let mut asked = Asked { scene, excitation: &excitation, tolerance, until_s: study.grid.until_s(), models: Vec::new() };
        let rows = study.rows.iter().map(|row| asked.errors(&row.configuration)).collect();
        Ok(LostModes { tolerance, rows, excitation })
    }

    /// Whether it is known which vibrations a row loses: not of a model without a linearisation.
    pub fn is_known(&self, row: usize) -> bool {
        self.rows.get(row).is_some_and(Option::is_some)
    }

    /// The vibrations that a row loses, in words: `rod bending 3 (step)`; none of a row of which they are not known.
    pub fn lost(&self, row: usize) -> Vec<String> {
        let lost = self.errors(row).iter().filter_map(|error| Some((error.mode, error.lost?)));
        lost.map(|(mode, reason)| format!("{} ({reason})", self.excitation.modes[mode].name)).collect()
    }

    /// The vibration whose error changes an output most.
    pub fn worst(&self, row: usize) -> Option<(&ExcitedMode, &ModeError)> {
        let worst = self.errors(row).iter().max_by(|one, other| one.expected.total_cmp(&other.expected))?;
        Some((&self.excitation.modes[worst.mode], worst))
    }

    fn errors(&self, row: usize) -> &[ModeError] {
        self.rows.get(row).and_then(Option::as_deref).unwrap_or_default()
    }
}

impl Excitation {
    /// The modes whose vibration changes an output by more than a tolerance; those whose deflection does so as it follows the load;
    /// and the others. The first of each change outputs most.
    pub fn beyond(&self, tolerance: f64) -> [Vec<&ExcitedMode>; 3] {
        let mut modes: Vec<&ExcitedMode> = self.modes.iter().collect();
        modes.sort_by(|one, other| other.output_part.total_cmp(&one.output_part));
        let (vibrate, others): (Vec<_>, Vec<_>) = modes.into_iter().partition(|mode| mode.vibrates(tolerance));
        let (follow, others) = others.into_iter().partition(|mode| mode.follows(tolerance));
        [vibrate, follow, others]
    }
}

/// The modes of one model, and the family that asked for them; none of a model without a linearisation.
type Known = (Family, Option<Vec<Own>>);

/// A mode of a configuration's model.
struct Own {
    kind: Kind,
    /// Its number among all modes of its kind, from 1.
    number: usize,
    equation: ModalEquation,
    links: Vec<LinkShape>,
}

/// The request for errors; keeps the modes of models that were asked before.
struct Asked<'a> {
    scene: &'a Scene,
    excitation: &'a Excitation,
    tolerance: f64,
    until_s: f64,
    models: Vec<Known>,
}

impl Asked<'_> {
    /// Errors of one configuration in the vibrations beyond the tolerance.
    fn errors(&mut self, configuration: &Configuration) -> Option<Vec<ModeError>> {
        let own = &configuration.family;
        let same = |(other, _): &Known| Family { integrator: own.integrator, ..other.clone() } == *own;
        let place = self.models.iter().position(same).unwrap_or_else(|| {
            self.models.push((own.clone(), modes_of(&configuration.scene(self.scene), self.excitation)));
            self.models.len() - 1
        });
        let modes = self.models.get(place)?.1.as_ref()?;
        let step = (Scheme::of(&configuration.scene(self.scene).solver), configuration.step_s);
        let mut errors = Vec::new();
        for ((place, mode), partner) in self.excitation.modes.iter().enumerate().zip(partners(&self.excitation.modes, modes)) {
            let partner = partner.and_then(|partner| modes.get(partner));
            let has_none = modes.iter().filter(|own| own.kind == mode.kind).all(|own| own.number < mode.number);
            match partner {
                Some(own) if mode.vibrates(self.tolerance) => {
                    errors.push(ModeError::new(place, mode, own.equation, step, self.until_s));
                }
                None if mode.vibrates(self.tolerance) => errors.push(ModeError::missing(place, mode)),
                _ if has_none && mode.follows(self.tolerance) => errors.push(ModeError::missing(place, mode)),
                _ => {}
            }
        }
        Some(errors)
    }
}

/// The modes of a configuration; no mode if nothing can move. `None` of a model without a linearisation.
fn modes_of(scene: &Scene, excitation: &Excitation) -> Option<Vec<Own>> {
    let own = |mode: &NormalMode| Own {
        kind: mode.mode.kind,
        number: mode.mode.number,
        equation: mode.equation,
        links: on_nodes(mode),
    };
    match NormalModes::new(scene, excitation.angle_rad, excitation.modes.len() + BEYOND) {
        Ok(modes) => Some(modes.modes().iter().filter(|mode| mode.is_vibration()).map(own).collect()),
        Err(NoModes::NothingMoves) => Some(Vec::new()),
        Err(_) => None,
    }
}

/// The partner of every vibration: pairs in the order of their likeness, each mode taken once.
fn partners(modes: &[ExcitedMode], own: &[Own]) -> Vec<Option<usize>> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, mode) in modes.iter().enumerate() {
        pairs.extend(own.iter().enumerate().map(|(j, own)| (likeness(&mode.links, &own.links), i, j)));
    }
    pairs.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut partners = vec![None; modes.len()];
    for (alike, i, j) in pairs {
        if alike >= ALIKE && partners[i].is_none() && !partners.contains(&Some(j)) {
            partners[i] = Some(j);
        }
    }
    partners
}

impl ModeError {
    /// The error of a vibration that the model does not have.
    fn missing(mode: usize, excited: &ExcitedMode) -> Self {
        let expected = excited.output_part.max(excited.following_part);
        ModeError { mode, frequency: f64::NAN, damping: f64::NAN, expected, lost: Some(Reason::Model) }
    }

    /// The error of a vibration that the model has, with the equation given.
    fn new(mode: usize, excited: &ExcitedMode, own: ModalEquation, (scheme, step_s): SchemeStep, until_s: f64) -> Self {
        let (exact, by_model) = (excited.eigenvalue, own.eigenvalue());
        let computed = own.eigenvalue_by(scheme, step_s).unwrap_or(Complex::from(f64::INFINITY));
        let off = |one: Complex<f64>, other: Complex<f64>| (one - other).norm() / other.norm();
        let lost = if off(by_model, exact) > LOST {
            Some(Reason::Model)
        } else if off(computed, by_model) > LOST || own.is_beyond(step_s) {
            Some(Reason::Step)
        } else {
            None
        };
        let lasts_s = if exact.re < 0.0 { until_s.min(-exact.re.recip()) } else { until_s };
        let apart = (computed - exact).norm() * lasts_s;
        ModeError {
            mode,
            frequency: computed.im / exact.im - 1.0,
            damping: damping_ratio(computed) - damping_ratio(exact),
            expected: excited.output_part * apart.min(1.0),
            lost,
        }
    }
}

fn damping_ratio(eigenvalue: Complex<f64>) -> f64 {
    -eigenvalue.re / eigenvalue.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{IntegratorKind, ModelKind, SceneSource};
    use crate::study::trade::{CHANNELS, Grid, OutputGroup};

    type Tested = Result<(), Box<dyn std::error::Error>>;

    /// A slender rod of plastic on a crank of aluminium. The rod is damped so much that it stretches without a swing: with the damping
    /// time c of `damping_s`, `ω c/2` is 1.7 at 545 Hz.
    const LAB: &str = r#"
[crank]
length_m = 0.12
section = { shape = "rectangle", width_m = 0.02, height_m = 0.008 }
density_kg_per_m3 = 2700.0
youngs_modulus_pa = 7.0e10
damping_s = 2e-5

[rod]
length_m = 0.48
section = { shape = "round", diameter_m = 0.008 }
density_kg_per_m3 = 1410.0
youngs_modulus_pa = 2.9e9
damping_s = 1e-3

[slider]
mass_kg = 0.08
friction_n_s_per_m = 0.2

[base]
damper_nm_s_per_rad = 0.0005

[gravity]
y_m_per_s2 = -9.81

[start]
angle_rad = 0.7853981633974483
rate_rad_per_s = 6.0

[[pulse]]
start_s = 0.2
torque_nm = 0.25
duration_s = 0.1
shape = "raised-cosine"

[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.001
"#;
    /// Crank and rod in line. The slider presses the rod beyond its buckling load, 25 N. Its other modes are damped too much to swing.
    const BUCKLING: &str = r#"
[crank]
length_m = 0.12
rigid = true
mass_kg = 0.1

[rod]
length_m = 0.48
section = { shape = "round", diameter_m = 0.008 }
density_kg_per_m3 = 1410.0
youngs_modulus_pa = 2.9e9
damping_s = 1e-2

[slider]
mass_kg = 0.08
resistance_n = 27.0

[base]
torsion_spring_nm_per_rad = 50.0

[[pulse]]
start_s = 0.0
torque_nm = 1.0
duration_s = 0.02

[solver]
model = "modal"
integrator = "esdirk"
step_s = 0.001
"#;
    const UNTIL_S: f64 = 0.6;
    /// Stroke and peaks of a run; forces do not count.
    const SCALES: [f64; CHANNELS.len()] = [1.0, 0.24, 7.2e-6, 1.07e-2, 1.0, 1.0, 1.0];

    fn lab() -> Result<(Scene, Excitation), Box<dyn std::error::Error>> {
        excited(LAB, UNTIL_S, 4e-3)
    }

    /// A scene, and its vibrations in a run.
    fn excited(text: &str, until_s: f64, interval_s: f64) -> Result<(Scene, Excitation), Box<dyn std::error::Error>> {
        let scene = SceneSource::parse("scene.toml", text, &[])?.scene;
        let grid = Grid::new(until_s, Some([interval_s].as_slice()))?;
        let excitation = Excitation::new(&scene, &grid, &SCALES, &OutputGroup::DEFAULT)?;
        Ok((scene, excitation))
    }

    /// The vibrations beyond a tolerance that a model of some resolution loses.
    fn lost_by_model(
        (scene, excitation): (&Scene, &Excitation),
        (model, resolution): (ModelKind, usize),
        tolerance: f64,
    ) -> Result<Vec<String>, Box<dyn std::error::Error>> {
        let links = &scene.chain().ok_or("no links")?.links;
        let (rigid, axial) = (links.iter().map(|link| link.rigid).collect(), vec![false; links.len()]);
        let family = Family { model, integrator: IntegratorKind::Esdirk, resolution, rigid, axial };
        let mut asked = Asked { scene, excitation, tolerance, until_s: UNTIL_S, models: Vec::new() };
        let errors = asked.errors(&Configuration { family, step_s: 1e-3 }).ok_or("not known")?;
        let by_model = errors.iter().filter(|error| error.lost == Some(Reason::Model));
        Ok(by_model.map(|error| excitation.modes[error.mode].name.clone()).collect())
    }

    /// At some angles the rod stretches as it moves at others while the chain turns, whose ω is 0.
    #[test]
    fn regress_a_vibration_is_not_followed_into_the_turning_of_the_chain() -> Tested {
        let (_, excitation) = lab()?;
        for mode in &excitation.modes {
            let parts = [mode.energy_part, mode.moving_part, mode.output_part, mode.following_part];
            assert!(parts.iter().all(|part| part.is_finite()), "{}: {parts:?}", mode.name);
        }
        let stretching = excitation.modes.iter().find(|mode| mode.name == "rod stretching 1").ok_or("not listed")?;
        assert!(stretching.energy_part < 0.1 && stretching.moving_part < 0.1, "{stretching:?}");
        assert_eq!((stretching.eigenvalue.im, stretching.output_part), (0.0, 0.0));
        assert!(!stretching.vibrates(0.0) && stretching.follows(0.0), "{stretching:?}");
        Ok(())
    }

    /// The reference's rod stretches, and so does that of every mesh; `modal` leaves that out in this scene.
    #[test]
    fn regress_the_vibrations_are_those_of_links_that_stretch_as_the_reference_does() -> Tested {
        let (scene, excitation) = lab()?;
        let lost = |model: ModelKind, resolution: usize| lost_by_model((&scene, &excitation), (model, resolution), 1e-3);
        assert_eq!(lost(ModelKind::FiniteElement, 8)?, Vec::<String>::new());
        let without_stretching = lost(ModelKind::Modal, 4)?;
        assert!(without_stretching.contains(&"rod stretching 2".to_owned()), "{without_stretching:?}");
        Ok(())
    }

    /// The rod's buckling has the numbers 1 and 2 and is no vibration: a model with two modes vibrates in the one numbered 3.
    #[test]
    fn regress_a_model_that_buckles_has_the_modes_up_to_its_highest_number() -> Tested {
        let (scene, excitation) = excited(BUCKLING, 0.1, 1e-3)?;
        let lowest = excitation.modes.iter().find(|mode| mode.name.starts_with("rod bending")).ok_or("the rod does not bend")?;
        assert_eq!(lowest.name, "rod bending 3");
        for (modes, highest) in [(2, 3), (3, 4)] {
            let lost = lost_by_model((&scene, &excitation), (ModelKind::Modal, modes), 0.0)?;
            let is_lost = |number: usize| lost.contains(&format!("rod bending {number}"));
            assert_eq!([highest, highest + 1].map(is_lost), [false, true], "{modes} modes: {lost:?}");
        }
        Ok(())
    }
}
