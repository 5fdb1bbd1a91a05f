//! The error of a scene's time step, seen by a run with half of it, or by an oscillator's exact solution.

use std::f64::consts::TAU;
use std::fmt;
use std::time::Instant;

use super::aligned_table::figure;
use super::trial_run::{Look, RunLength, Trial};
use crate::scene::{Chain, Drive, Link, ModelKind, Scene, System};
use crate::simulation::Simulation;
use crate::small_motion::Vibrations;
use crate::study::trade::STRAIGHT;

/// Largest step error of a step that is suggested: in rad, or over the peak of a deflection.
const LARGEST: f64 = 1e-2;

/// An error of the time step with which the motion of a run is lost, in rad of the first link's angle.
const LOST_RAD: f64 = 1.0;
/// The same of a deflection, over its peak.
const LOST_OF_PEAK: f64 = 0.5;

/// A deflection of less than this part of a link's length is rounding: the link is straight. So is the motion of a mass beside the
/// furthest place of any.
pub(super) const ROUNDING: f64 = 1e-13;

/// The largest differences of two runs, with the scene's step and with half of it; or of a run and the exact solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StepError {
    /// That of the first link's angle, rad; `None` where it is prescribed.
    pub(super) angle_rad: Option<f64>,
    /// That of the deflection in the middle of a link, where the angle is prescribed; the largest over the link's own peak.
    pub(super) deflection: Option<DeflectionError>,
    /// That of an oscillator's mass, from the exact solution; the largest over the mass's own peak.
    pub(super) mass: Option<MassError>,
    /// Why there is no such deflection.
    uncompared: Uncompared,
    /// Simulated time over which they were compared, s.
    until_s: f64,
    /// Simulated time at which the run with half the step diverged, s.
    pub(super) half_diverged_s: Option<f64>,
}

/// Why no deflection is compared where the angle is prescribed, or no mass of an oscillator.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Uncompared {
    /// No link bends.
    Straight,
    /// The exact solution of the slowest vibration is rounding beside the fastest.
    Stiff,
    /// These links bend, and have nodes at their ends alone.
    WithoutNode([Option<&'static str>; 2]),
}

impl Uncompared {
    /// The reason for a chain none of whose links is seen to bend.
    fn of(chain: &Chain, model: ModelKind) -> Self {
        let is_unseen = |link: &&Link| model != ModelKind::Rigid && !link.rigid && link.elements < 2;
        let mut names = chain.links.iter().filter(is_unseen).map(|link| link.name.as_str());
        match [names.next(), names.next()] {
            [None, _] => Uncompared::Straight,
            names => Uncompared::WithoutNode(names),
        }
    }
}

/// The difference of the deflections in the middle of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DeflectionError {
    link: &'static str,
    /// m.
    largest_m: f64,
    /// Over the largest deflection in either run.
    pub(super) of_peak: f64,
}

/// The difference of a mass's place from the exact solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MassError {
    /// Its number, from 1.
    mass: usize,
    /// m.
    largest_m: f64,
    /// Over the largest displacement from the start in the exact solution.
    pub(super) of_peak: f64,
}

impl MassError {
    /// The largest over its mass's peak, in the looks of a run, of masses that move beside the one that moves most; `None` if none moves
    /// by more than rounding.
    fn of(looks: &[Look], start_m: &[f64]) -> Option<Self> {
        let places_of = |mass: usize| looks.iter().filter_map(move |look| look.masses_m.get(mass));
        let error = |(mass, start_m): (usize, &f64)| {
            let most = |[error_m, peak_m]: [f64; 2], [own_m, exact_m]: &[f64; 2]| {
                [error_m.max((own_m - exact_m).abs()), peak_m.max((exact_m - start_m).abs())]
            };
            let [largest_m, peak_m] = places_of(mass).fold([0.0, 0.0], most);
            (peak_m, MassError { mass: mass + 1, largest_m, of_peak: largest_m / peak_m })
        };
        let errors: Vec<(f64, Self)> = start_m.iter().enumerate().map(error).collect();
        let furthest_m = looks.iter().flat_map(|look| &look.masses_m).map(|[_, exact_m]| exact_m.abs()).fold(0.0, f64::max);
        let most_m = errors.iter().map(|(peak_m, _)| *peak_m).fold(0.0, f64::max);
        let least_m = f64::max(ROUNDING * furthest_m, STRAIGHT * most_m);
        let moving = errors.into_iter().filter(|(peak_m, _)| *peak_m > least_m).map(|(_, error)| error);
        moving.max_by(|one, other| one.of_peak.total_cmp(&other.of_peak))
    }
}

/// A step error that is too large for a step that is suggested.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LargeError {
    size: f64,
    unit: String,
}

impl LargeError {
    /// The largest step error of a step that is suggested, with its unit.
    pub(super) fn limit(&self) -> String {
        format!("{LARGEST} {}", self.unit)
    }
}

impl fmt::Display for LargeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1e} {}", self.size, self.unit)
    }
}

impl StepError {
    /// Compares a run of the scene with one of half the step, as far as that comes in twice the computing time; that of an oscillator with
    /// the exact solution. `None` if there is nothing to compare.
    ///
    /// A method of order p errs by `2ᵖ/(2ᵖ − 1)` times the difference, 4/3 times for p = 2, where the step is short enough.
    pub(super) fn of(scene: &Scene, own: &Trial, length: RunLength) -> Option<Self> {
        let Some(chain) = scene.chain() else { return Self::of_oscillator(scene, own) };
        let mut halved = scene.clone();
        halved.solver.step_s *= 0.5;
        let (begun, mut run) = (Instant::now(), Simulation::new(&halved).ok()?);
        let (mut angle_rad, mut steps, mut until_s, mut half_diverged_s) = (0.0_f64, 0, None, None);
        let mut deflections = vec![[0.0_f64; 2]; chain.links.len()];
        'looks: for look in &own.looks {
            while steps < 2 * look.step {
                if begun.elapsed() > 2 * length.longest {
                    break 'looks;
                }
                if run.step().is_err() {
                    half_diverged_s = Some(run.time_s());
                    break 'looks;
                }
                steps += 1;
            }
            let Some(other) = run.observe().ok().and_then(|seen| Look::at(steps, seen)) else { break };
            angle_rad = angle_rad.max((look.angle_rad - other.angle_rad).abs());
            for (found, (own_m, other_m)) in deflections.iter_mut().zip(look.deflections_m.iter().zip(&other.deflections_m)) {
                *found = [found[0].max((own_m - other_m).abs()), found[1].max(own_m.abs()).max(other_m.abs())];
            }
            until_s = Some(run.time_s());
        }
        let until_s = until_s.or(half_diverged_s)?;
        let uncompared = Uncompared::of(chain, scene.solver.model);
        let Drive::Motion(_) = scene.drive else {
            return Some(StepError {
                angle_rad: Some(angle_rad),
                deflection: None,
                mass: None,
                uncompared,
                until_s,
                half_diverged_s,
            });
        };
        let bent = chain.links.iter().zip(deflections).filter(|(link, [_, peak_m])| *peak_m > ROUNDING * link.length_m);
        let errors = bent.map(|(link, [largest_m, peak_m])| {
            let (link, of_peak) = (link.name.as_str(), largest_m / peak_m);
            DeflectionError { link, largest_m, of_peak }
        });
        let deflection = errors.max_by(|one, other| one.of_peak.total_cmp(&other.of_peak));
        Some(StepError { angle_rad: None, deflection, mass: None, uncompared, until_s, half_diverged_s })
    }

    /// The error of an oscillator, whose exact solution is known. `None` if nothing moves, or it diverges.
    fn of_oscillator(scene: &Scene, own: &Trial) -> Option<Self> {
        let System::Oscillator(oscillator) = &scene.system else { return None };
        let last = own.looks.last().filter(|_| own.verdict.is_ok() && !own.stands_still)?;
        let until_s = f64::from(last.step) * scene.solver.step_s;
        let mass = Some(MassError::of(&own.looks, &oscillator.start_m)?).filter(|_| is_exact_known(scene, until_s));
        Some(StepError { angle_rad: None, deflection: None, mass, uncompared: Uncompared::Stiff, until_s, half_diverged_s: None })
    }

    /// The error, if it is known and too large for a step that is suggested.
    pub(super) fn too_large(self) -> Option<LargeError> {
        let angle = self.angle_rad.map(|angle_rad| (angle_rad, "rad".to_owned()));
        let of_peak = |found: DeflectionError| (found.of_peak, format!("of the {}'s peak deflection", found.link));
        let of_mass = |found: MassError| (found.of_peak, format!("of the peak displacement of mass {}", found.mass));
        let (size, unit) = angle.or_else(|| self.deflection.map(of_peak)).or_else(|| self.mass.map(of_mass))?;
        (size > LARGEST).then_some(LargeError { size, unit })
    }

    /// A sentence on an error with which the motion is lost.
    pub(super) fn lost(self) -> Option<String> {
        let shorter = "in this run: a shorter step mends that, unless";
        match self {
            StepError { half_diverged_s: Some(_), .. } => None,
            StepError { angle_rad: Some(angle_rad), .. } => (angle_rad > LOST_RAD).then(|| {
                format!("with half the step, the first link's angle differs by up to {angle_rad:.1e} rad {shorter} the motion is chaotic")
            }),
            StepError { deflection: Some(DeflectionError { link, of_peak, .. }), .. } => (of_peak > LOST_OF_PEAK).then(|| {
                let differs = format!("with half the step, the {link}'s deflection differs by up to {:.0} % of its peak", 100.0 * of_peak);
                format!("{differs} {shorter} the motion is chaotic")
            }),
            StepError { mass: Some(MassError { mass, of_peak, .. }), .. } => (of_peak > LOST_OF_PEAK).then(|| {
                format!("mass {mass} errs by up to {:.0} % of its peak in this run: a shorter step mends that", 100.0 * of_peak)
            }),
            StepError { .. } => None,
        }
    }
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let until = figure(self.until_s);
        match *self {
            StepError { half_diverged_s: Some(time_s), .. } => {
                write!(f, "not known: the run with half the step diverges at t = {} s", figure(time_s))
            }
            StepError { angle_rad: Some(angle_rad), .. } => {
                write!(f, "{angle_rad:.1e} rad in the first link's angle, until {until} s")
            }
            StepError { deflection: Some(DeflectionError { link, largest_m, of_peak }), .. } => {
                write!(f, "{largest_m:.1e} m in the {link}'s deflection, {of_peak:.1e} of its peak, until {until} s")
            }
            StepError { mass: Some(MassError { mass, largest_m, of_peak }), .. } => {
                write!(f, "{largest_m:.1e} m of mass {mass} from the exact solution, {of_peak:.1e} of its peak, until {until} s")
            }
            StepError { uncompared: Uncompared::Stiff, .. } => {
                write!(f, "not known: the springs are so stiff beside the others that the exact solution is not")
            }
            StepError { uncompared: Uncompared::Straight, .. } => write!(f, "none: the motion is prescribed, and no link bends"),
            StepError { uncompared: Uncompared::WithoutNode(links), .. } => {
                let keys: Vec<String> = links.iter().flatten().map(|link| format!("{link}.elements")).collect();
                let keys = keys.join(" and ");
                write!(f, "not known: the angle is prescribed, and no link has a node in its middle: set {keys} to 4")
            }
        }
    }
}

/// Whether the exact solution of an oscillator is known until this time to a tenth of [`LARGEST`]. The square of a frequency has an error
/// of ε of the largest square. The phase of the slowest vibration is therefore wrong by up to `ε (ω_max/ω_min)² ω_min t / 2`.
fn is_exact_known(scene: &Scene, until_s: f64) -> bool {
    let frequencies_hz = Vibrations::of_scene(scene).ok().flatten().and_then(|found| found.frequencies_hz);
    frequencies_hz.is_none_or(|[lowest_hz, highest_hz]| {
        let phase_rad = 0.5 * f64::EPSILON * (highest_hz / lowest_hz).powi(2) * TAU * lowest_hz * until_s;
        phase_rad <= 0.1 * LARGEST
    })
}
