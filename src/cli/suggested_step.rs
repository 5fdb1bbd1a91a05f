//! The step that `check` suggests.

use std::f64::consts::TAU;
use std::time::{Duration, Instant};

use super::aligned_table::figure;
use super::short_load::ShortLoad;
use super::step_error::{LargeError, StepError};
use super::trial_run::{RunLength, Trial};
use crate::scene::{Drive, IntegratorKind, ModelKind, Motion, Scene};
use crate::simulation::{BuildError, Diverged, EnergyVerdict, Simulation};
use crate::small_motion::Vibrations;

/// Fewer steps of a run show nothing of it.
const LEAST_STEPS_OF_RUN: f64 = 100.0;
/// Steps that are tried at least, if none suffices.
const LEAST_TRIES: u32 = 7;
/// Steps that are tried from the first one on that keeps the energy balance, if none has a small step error.
const TRIES_IN_BALANCE: u32 = 4;
/// Steps that are tried at most: the last is about a millionth of the first.
const MOST_TRIES: u32 = 20;

/// The scene's own run, and the error of its step.
#[derive(Clone, Copy)]
pub(super) struct OwnRun<'a> {
    pub(super) trial: &'a Trial,
    /// `None` if it is not known.
    pub(super) step_error: Option<StepError>,
}

/// Whether a step suffices.
enum Verdict {
    /// It is beyond the stability limit of an explicit integrator.
    Unstable,
    /// A run with it does not keep its energy balance.
    Unbalanced,
    /// A run with it keeps its energy balance, but has a large step error.
    Inexact(LargeError),
    /// A run with it is right but for a short load of the slider, which it may jump over: the longest step that shows it, s, and why.
    Coarse(f64, String),
    /// A run with it took too long to reach the time at which the scene's own diverged, s.
    Unknown { diverged_s: f64 },
    /// It suffices, until the time at which a run that took too long was ended, s.
    Sufficient { cut_off_s: Option<f64> },
}

/// A step, s, that resolves the scene's motion, keeps the energy balance and has a small step error, as far as there is one; and the
/// reason. `own` is the run of this length with the scene's own step.
pub(super) fn suggested_step(
    scene: &Scene,
    vibrations: Option<Vibrations>,
    own: OwnRun<'_>,
    length: RunLength,
) -> (Option<f64>, String) {
    let until_s = length.until_s;
    let (step_s, reason) = match suggestion(scene, slowest_bending(scene, vibrations)) {
        (Some(step_s), reason) if step_s * LEAST_STEPS_OF_RUN <= until_s => (step_s, reason),
        (None, reason) if scene.solver.model == ModelKind::Incremental => return (None, reason),
        _ => {
            let reason = format!("at least {LEAST_STEPS_OF_RUN} steps in a run of {} s", figure(until_s));
            (one_digit(until_s / LEAST_STEPS_OF_RUN), reason)
        }
    };
    sufficient_step(scene, own, length, step_s, reason)
}

/// The first step that suffices, of `first_s` and its halves as far as the time of a run allows, with the reason for `first_s` and
/// for halving it. If none suffices, it is the scene's own if that does, or else the longest one that keeps the energy balance.
fn sufficient_step(scene: &Scene, own: OwnRun<'_>, length: RunLength, first_s: f64, mut reason: String) -> (Option<f64>, String) {
    let (begun, mut step_s, mut tried_s) = (Instant::now(), first_s, None);
    let mut balanced: Option<(f64, LargeError)> = None;
    let mut enough = MOST_TRIES;
    let mut unknown = None;
    for tries in 1.. {
        let verdict = own.judge(scene, step_s, length);
        if let Verdict::Unknown { diverged_s } = verdict {
            let time = figure(diverged_s);
            unknown = Some(format!("a run with {step_s} s takes too long to reach {time} s, where the scene's own diverged"));
            break;
        }
        tried_s = Some(step_s);
        match verdict {
            Verdict::Sufficient { cut_off_s } => {
                if let Some((longer_s, error)) = balanced {
                    let does = if longer_s == first_s { "would suffice for that" } else { "keeps the balance" };
                    reason += &format!("; {longer_s} s {does}, but has a step error of {error}");
                }
                if step_s == first_s && is_unstable(scene, next_digit(step_s)) {
                    reason += "; runge-kutta also has a stability limit, which refuses longer steps";
                }
                if let Some(time_s) = cut_off_s {
                    reason += &format!("; only the first {} s of a run with it are judged", figure(time_s));
                }
                return (Some(step_s), reason);
            }
            Verdict::Inexact(error) => {
                if balanced.is_none() {
                    // The motion of an oscillator is never chaotic: some step is short enough.
                    enough = if scene.chain().is_some() { LEAST_TRIES.max(tries + TRIES_IN_BALANCE - 1) } else { MOST_TRIES };
                    balanced = Some((step_s, error));
                }
            }
            Verdict::Coarse(longest_s, why) => {
                (step_s, reason) = (one_digit(longest_s), why);
                if tries < MOST_TRIES {
                    continue;
                }
            }
            Verdict::Unstable if step_s == first_s => {
                reason += &format!("; {first_s} s would suffice for that, but is beyond the stability limit of runge-kutta");
            }
            Verdict::Unbalanced if step_s == first_s => {
                reason += &format!("; {first_s} s would suffice for that, but diverges or does not keep the energy balance");
            }
            Verdict::Unstable | Verdict::Unbalanced | Verdict::Unknown { .. } => {}
        }
        if tries >= enough || begun.elapsed() >= length.longest {
            break;
        }
        step_s = one_digit(0.5 * step_s);
    }
    let (from_s, quality) = match &balanced {
        Some((longest_s, error)) => (*longest_s, format!("has a step error of at most {}", error.limit())),
        None => (first_s, "keeps the energy balance".to_owned()),
    };
    let no_step = tried_s.map(|tried_s| {
        let from = if tried_s < from_s { format!("from {from_s} s ") } else { String::new() };
        format!("no step {from}down to {tried_s} s {quality}")
    });
    let none = no_step.into_iter().chain(unknown).collect::<Vec<_>>().join("; ");
    match (own.verdict(scene), balanced) {
        (Verdict::Sufficient { cut_off_s: None }, _) | (Verdict::Inexact(_) | Verdict::Coarse(..), None) => {
            (Some(scene.solver.step_s), format!("the scene's own: {none}"))
        }
        (Verdict::Sufficient { cut_off_s: Some(time_s) }, _) => {
            let judged = format!("only the first {} s of a run with it are judged", figure(time_s));
            (Some(scene.solver.step_s), format!("the scene's own: {none}; {judged}"))
        }
        // The scene's own keeps the balance, too, and a longer one errs by more.
        (Verdict::Inexact(_), Some((longest_s, _))) if scene.solver.step_s < longest_s => {
            (Some(scene.solver.step_s), format!("the scene's own: {none}"))
        }
        (_, Some((longest_s, _))) => (Some(longest_s), format!("{reason}; {none}")),
        (Verdict::Unstable | Verdict::Unbalanced | Verdict::Unknown { .. }, None) => (None, none),
    }
}

impl OwnRun<'_> {
    /// The verdict on the scene's own step.
    fn verdict(&self, scene: &Scene) -> Verdict {
        verdict(scene, self.trial, self.step_error)
    }

    /// The verdict on a step. A shorter one than the scene's own, with a small error, has a small one too.
    fn judge(&self, scene: &Scene, step_s: f64, length: RunLength) -> Verdict {
        if step_s == scene.solver.step_s {
            return self.verdict(scene);
        }
        let other = with_step(scene, step_s);
        let mut run = match Simulation::new(&other) {
            Ok(run) => run,
            Err(refused) if is_of_step(&refused) => return Verdict::Unstable,
            Err(_) => return Verdict::Unbalanced,
        };
        let trial = Trial::of(&mut run, length, Duration::ZERO);
        let is_exact = step_s < scene.solver.step_s
            && self.trial.verdict.is_ok()
            && self.trial.cut_off_s.is_none()
            && self.step_error.is_some_and(|error| error.too_large().is_none() && error.half_diverged_s.is_none());
        if let (Err(own), Some(cut_off_s)) = (&self.trial.verdict, trial.cut_off_s)
            && is_kept(&trial.verdict)
            && cut_off_s <= own.sim_time_s
        {
            return Verdict::Unknown { diverged_s: own.sim_time_s };
        }
        let step_error = if is_kept(&trial.verdict) && !is_exact { StepError::of(&other, &trial, length) } else { None };
        verdict(&other, &trial, step_error)
    }
}

/// The verdict on the step of a run.
fn verdict(scene: &Scene, trial: &Trial, step_error: Option<StepError>) -> Verdict {
    let step_s = scene.solver.step_s;
    let short_load = ShortLoad::on(scene, &trial.ways(step_s)).map(ShortLoad::longest_step_s);
    match (step_error.and_then(StepError::too_large), short_load) {
        _ if !is_kept(&trial.verdict) => Verdict::Unbalanced,
        // What half the step does not reproduce is not to be suggested.
        _ if step_error.is_some_and(|error| error.half_diverged_s.is_some()) => Verdict::Unbalanced,
        (Some(error), _) => Verdict::Inexact(error),
        (None, Some((longest_s, why))) if longest_s < step_s => Verdict::Coarse(longest_s, why),
        (None, _) => Verdict::Sufficient { cut_off_s: trial.cut_off_s },
    }
}

/// Whether a run kept its energy balance, or is not judged by it.
fn is_kept(verdict: &Result<EnergyVerdict, Diverged>) -> bool {
    matches!(verdict, Ok(EnergyVerdict::Balanced | EnergyVerdict::NotJudged))
}

/// The scene with this step, s.
fn with_step(scene: &Scene, step_s: f64) -> Scene {
    let mut other = scene.clone();
    other.solver.step_s = step_s;
    other
}

/// Whether a simulation is refused for its step alone, which is beyond the stability limit of an explicit integrator.
fn is_of_step(refused: &BuildError) -> bool {
    refused.key == "solver.step_s"
}

/// Whether a step, s, is beyond the stability limit of the scene's integrator.
fn is_unstable(scene: &Scene, step_s: f64) -> bool {
    let explicit = scene.solver.integrator == IntegratorKind::RungeKutta;
    explicit && Simulation::new(&with_step(scene, step_s)).is_err_and(|refused| is_of_step(&refused))
}

/// A step for about 0.1 % of error in a period, s, with its reason.
///
/// A method of second order with a step h stretches the period of a vibration by about (ω h)²/12: 0.1 % at 2π/(ω h) = 57 steps. A
/// method of fourth order errs by about (ω h)⁴/120 and less: 0.1 % at 11 steps. Both are rounded up, to 60 and 12.
fn suggestion(scene: &Scene, slowest: Option<(f64, &str)>) -> (Option<f64>, String) {
    if scene.solver.model == ModelKind::Incremental {
        return (
            None,
            "the error of the incremental model falls with the step, and grows again with very short ones: `trade` measures it"
                .to_owned(),
        );
    }
    let steps = if scene.solver.integrator.order() >= 4 { 12.0 } else { 60.0 };
    let Some((period_s, what)) = slowest else {
        return (None, "nothing is known to vibrate or turn at the start".to_owned());
    };
    (Some(one_digit(period_s / steps)), format!("at least {steps} steps per {what} ({} s)", figure(period_s)))
}

/// Period of the lowest frequency, or of a turn if that is shorter, s, with its name.
fn slowest_motion(scene: &Scene, vibrations: Option<Vibrations>) -> Option<(f64, &'static str)> {
    let lowest = vibrations.and_then(|found| found.frequencies_hz);
    let vibration = lowest.map(|[lowest_hz, _]| (1.0 / lowest_hz, "period of the lowest frequency"));
    or_turn(scene, vibration)
}

/// The same of the lowest frequency at which a link bends. A chain that swings, or that a base spring holds, has a lower one: a step
/// for that does not resolve deflections.
pub(super) fn slowest_bending(scene: &Scene, vibrations: Option<Vibrations>) -> Option<(f64, &'static str)> {
    match vibrations {
        Some(Vibrations { frequencies_hz: Some([lowest_hz, _]), lowest_bending_hz: Some(bending_hz), .. })
            if bending_hz > lowest_hz =>
        {
            or_turn(scene, Some((1.0 / bending_hz, "period of the lowest bending frequency")))
        }
        _ => slowest_motion(scene, vibrations),
    }
}

/// The shorter of a vibration's period and a turn, s, with its name.
fn or_turn(scene: &Scene, vibration: Option<(f64, &'static str)>) -> Option<(f64, &'static str)> {
    let turn = Some(speed_rad_per_s(scene)).filter(|speed| *speed > 0.0).map(|speed| (TAU / speed, "turn"));
    vibration.into_iter().chain(turn).min_by(|one, other| one.0.total_cmp(&other.0))
}

/// The largest angular speed that the scene prescribes or starts with, rad/s.
pub(super) fn speed_rad_per_s(scene: &Scene) -> f64 {
    let start = scene.chain().map_or(0.0, |chain| chain.start.rate_rad_per_s.abs());
    match &scene.drive {
        Drive::Motion(Motion::Speed(rad_per_s)) => start.max(rad_per_s.abs()),
        Drive::Motion(Motion::Ramp { to_rad_per_s, .. }) => start.max(to_rad_per_s.abs()),
        Drive::Motion(Motion::Table(_)) | Drive::Torque { .. } => start,
    }
}

/// The next smaller number with one digit: 0.0037 becomes 0.003.
pub(super) fn one_digit(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let text = format!("{:e}", (value / power).floor() * power);
    // Parsing back removes what the multiplication added.
    let (digit, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digit = digit.parse::<f64>().unwrap_or(1.0).round();
    format!("{digit}e{exponent}").parse().unwrap_or(value)
}

/// The next longer step with one digit, of such a step: 0.003 becomes 0.004.
fn next_digit(step_s: f64) -> f64 {
    step_s + 10.0_f64.powf(step_s.log10().floor())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    /// Two tubes that hang from a pivot. They swing at 0.44 Hz; the rod bends at 31.7 Hz.
    const PENDULUM: &str = r#"
[crank]
length_m = 0.6
section = { shape = "tube", outer_m = 0.016, inner_m = 0.014 }
density_kg_per_m3 = 1600.0
youngs_modulus_pa = 1.2e11

[rod]
length_m = 0.9
section = { shape = "round", diameter_m = 0.006 }
density_kg_per_m3 = 1600.0
youngs_modulus_pa = 1.2e11

[tip]
mass_kg = 0.05

[gravity]
y_m_per_s2 = -9.81

[start]
angle_rad = -1.5707963267948966
"#;

    #[test]
    fn val_a_suggested_step_has_one_digit() {
        for (value, digit) in [(0.0037, 0.003), (9.99e-5, 9e-5), (0.001, 0.001), (2.5, 2.0)] {
            assert_eq!(one_digit(value), digit);
        }
    }

    #[test]
    fn regress_the_suggested_step_of_a_pendulum_resolves_the_bending_of_its_links() -> Tested {
        for (integrator, steps, step_s) in [("generalized-alpha", 60, 5e-4), ("esdirk", 12, 2e-3)] {
            let own = ["solver.model=modal".to_owned(), format!("solver.integrator={integrator}")];
            let scene = SceneSource::parse("pendulum", PENDULUM, &own)?.scene;
            let vibrations = Vibrations::of_scene(&scene)?;
            let (suggested_s, reason) = suggestion(&scene, slowest_bending(&scene, vibrations));
            let beginning = format!("at least {steps} steps per period of the lowest bending frequency (0.0315");
            assert!(suggested_s == Some(step_s) && reason.starts_with(&beginning), "{suggested_s:?}: {reason}");
            let (period_s, name) = slowest_motion(&scene, vibrations).ok_or("nothing swings")?;
            assert!((2.0..2.5).contains(&period_s) && name == "period of the lowest frequency", "{name}: {period_s}");
        }
        Ok(())
    }

    /// Rigid, the pendulum swings at 0.44 Hz and 1.63 Hz. The explicit scheme is stable on the imaginary axis up to hω = 2√2: to
    /// 0.28 s at the second frequency, which does not bound a step of 0.1 s. Frequencies grow with the root of the weight: at
    /// 33 m/s² the limit is 0.15 s, between that step and the next one, 0.2 s. With links that bend, it is 1.4e-4 s.
    #[test]
    fn regress_a_stability_limit_is_named_only_where_it_bounds_the_step() -> Tested {
        let limit = "; runge-kutta also has a stability limit, which refuses longer steps";
        let refused = "; 0.002 s would suffice for that, but is beyond the stability limit of runge-kutta";
        for (model, weight, own_s, until_s, suggested_s, remark) in [
            ("rigid", "-9.81", "0.01", 20.0, 0.1, ""),
            ("rigid", "-33.0", "0.01", 20.0, 0.1, limit),
            ("modal", "-9.81", "1e-4", 0.5, 1e-4, refused),
        ] {
            let own = [
                format!("solver.model={model}"),
                "solver.integrator=runge-kutta".to_owned(),
                format!("solver.step_s={own_s}"),
                format!("gravity.y_m_per_s2={weight}"),
            ];
            let scene = SceneSource::parse("pendulum", PENDULUM, &own)?.scene;
            let length = RunLength { until_s, longest: Duration::from_secs(20) };
            let trial = Trial::of(&mut Simulation::new(&scene)?, length, Duration::ZERO);
            let run = OwnRun { trial: &trial, step_error: StepError::of(&scene, &trial, length) };
            let (found_s, reason) = suggested_step(&scene, Vibrations::of_scene(&scene)?, run, length);
            assert_eq!(found_s, Some(suggested_s), "{reason}");
            assert!(reason.starts_with("at least 12 steps per ") && reason.ends_with(&format!(" s){remark}")), "{reason}");
        }
        Ok(())
    }

    /// A run that was cut off before the scene's own diverged counted as one that keeps its balance.
    #[test]
    fn regress_a_step_is_not_suggested_whose_run_does_not_reach_a_divergence() -> Tested {
        let soft = ["rod.youngs_modulus_pa=7e4", "rod.density_kg_per_m3=2.7"].map(str::to_owned);
        let scene = SceneSource::open("crank-slider", &soft)?.scene;
        let length = RunLength { until_s: 1.0, longest: Duration::from_secs(20) };
        let trial = Trial::of(&mut Simulation::new(&scene)?, length, Duration::ZERO);
        let own = OwnRun { trial: &trial, step_error: None };
        let none = "a run with 0.01 s takes too long to reach 0.562 s, where the scene's own diverged";
        // One step of each run.
        let length = RunLength { longest: Duration::ZERO, ..length };
        assert_eq!(suggested_step(&scene, None, own, length), (None, none.to_owned()));
        Ok(())
    }

    /// No frequency is lower than that of the rod's bending.
    #[test]
    fn prop_the_lowest_bending_frequency_has_no_other_name_where_it_is_the_lowest_of_all() -> Tested {
        let scene = SceneSource::open("crank-slider", &[])?.scene;
        let vibrations = Vibrations::of_scene(&scene)?;
        assert_eq!(slowest_bending(&scene, vibrations), slowest_motion(&scene, vibrations));
        Ok(())
    }
}
