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
            let has_none = modes.iter().filter(|own| own.kind == mode.kind).count() < mode.number;
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
    let own = |mode: &NormalMode| Own { kind: mode.mode.kind, equation: mode.equation, links: on_nodes(mode) };
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
