//! Random damped scenes: no run ends as a good one with a wrong angle.

use std::fmt;

use flexcrank::scene::IntegratorKind;
use flexcrank::simulation::EnergyVerdict;

use crate::draw::Drawn;
use crate::{End, Run, apart_rad, run};

/// An angle off by more is wrong, rad.
const WRONG_RAD: f64 = 1e-2;
/// Largest factor by which the estimate of a wrong run may be too small.
const FACTOR: f64 = 3.0;
/// A solution whose step can be halved with no more effect is converged, rad.
const CONVERGED_RAD: f64 = 2e-3;
/// Most steps of a converged solution.
const MOST_STEPS: usize = 60_000;

/// How a scene ended.
#[derive(Debug, Clone, PartialEq)]
enum Judged {
    Refused,
    Diverged,
    Unbalanced,
    /// The angle is right.
    Right,
    /// The angle is wrong, and the run's own estimate showed it.
    Foretold,
    /// Two schemes at fine steps disagree, or none converges: the true angle is unknown.
    Chaotic,
    /// The angle is wrong without a warning.
    Offends {
        error_rad: f64,
        estimate_rad: f64,
    },
}

/// A converged solution by the integrator named, on the mesh of the scene.
fn converged(drawn: &Drawn, integrator: IntegratorKind, settings: &str) -> Option<Run> {
    let finer = |parts: usize| {
        let overrides = drawn.overrides(integrator, settings, drawn.step_s / parts as f64);
        run(&drawn.scene, &overrides, drawn.between * parts).ok()
    };
    let steps = drawn.between * crate::LOOKS;
    let mut parts = 4_usize.max((400 / steps).next_power_of_two());
    let mut coarse = finer(parts)?;
    while 2 * parts * steps <= MOST_STEPS {
        parts *= 2;
        let fine = finer(parts)?;
        if apart_rad(&coarse, &fine) < CONVERGED_RAD {
            return Some(fine);
        }
        coarse = fine;
    }
    None
}

/// Two other schemes than the one on trial.
fn others(integrator: IntegratorKind) -> [(IntegratorKind, &'static str); 2] {
    use IntegratorKind::{Esdirk, GeneralizedAlpha, TwoPoint};
    let alpha = (GeneralizedAlpha, "solver.rho_infinity=0.8");
    match integrator {
        Esdirk => [alpha, (TwoPoint, "solver.weight=0.5")],
        GeneralizedAlpha => [(Esdirk, "solver.rho_infinity=0.8"), (TwoPoint, "solver.weight=0.5")],
        _ => [(Esdirk, "solver.rho_infinity=0.8"), alpha],
    }
}

fn judge(drawn: &Drawn) -> Judged {
    let overrides = drawn.overrides(drawn.integrator, &drawn.settings, drawn.step_s);
    let found = match run(&drawn.scene, &overrides, drawn.between) {
        Err(End::Refused(_)) => return Judged::Refused,
        Err(End::Diverged(_)) => return Judged::Diverged,
        Ok(found) if found.verdict != EnergyVerdict::Balanced => return Judged::Unbalanced,
        Ok(found) => found,
    };
    let [first, second] = others(drawn.integrator);
    let Some(reference) = converged(drawn, first.0, first.1) else { return Judged::Chaotic };
    let (error_rad, estimate_rad) = (apart_rad(&found, &reference), found.estimate_rad);
    if error_rad <= WRONG_RAD {
        return Judged::Right;
    }
    if FACTOR * estimate_rad >= error_rad {
        return Judged::Foretold;
    }
    match converged(drawn, second.0, second.1) {
        Some(other) if apart_rad(&other, &reference) < 2.0 * CONVERGED_RAD => Judged::Offends { error_rad, estimate_rad },
        _ => Judged::Chaotic,
    }
}

/// Number of scenes by outcome.
#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    refused: usize,
    diverged: usize,
    unbalanced: usize,
    right: usize,
    foretold: usize,
    chaotic: usize,
    offending: usize,
}

impl Counts {
    fn add(&mut self, judged: &Judged) {
        *match judged {
            Judged::Refused => &mut self.refused,
            Judged::Diverged => &mut self.diverged,
            Judged::Unbalanced => &mut self.unbalanced,
            Judged::Right => &mut self.right,
            Judged::Foretold => &mut self.foretold,
            Judged::Chaotic => &mut self.chaotic,
            Judged::Offends { .. } => &mut self.offending,
        } += 1;
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Counts { refused, diverged, unbalanced, right, foretold, chaotic, offending } = self;
        write!(
            f,
            "{right} right, {foretold} wrong and foretold by their own estimate, {offending} wrong without a word; {diverged} diverged, \
             {unbalanced} unbalanced, {refused} refused; left out, as fine steps disagree: {chaotic}"
        )
    }
}

/// A number from the environment.
fn from_environment(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|_| panic!("{name}={text} is no number")))
}

/// `FLEXCRANK_SCENES` sets the number of scenes (60), `FLEXCRANK_SEED` the first seed (1).
#[test]
fn prop_no_random_damped_scene_is_wrong_without_a_word() {
    let (count, first) = (from_environment("FLEXCRANK_SCENES", 60), from_environment("FLEXCRANK_SEED", 1));
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get) as u64;
    let seeds = |thread: u64| (first..first + count).filter(move |seed| seed % threads == thread);
    let all: Vec<(u64, Judged)> = std::thread::scope(|scope| {
        let work = |thread| move || seeds(thread).map(|seed| (seed, judge(&Drawn::new(seed)))).collect::<Vec<_>>();
        let handles: Vec<_> = (0..threads).map(|thread| scope.spawn(work(thread))).collect();
        handles.into_iter().flat_map(|handle| handle.join().unwrap()).collect()
    });
    let mut counts = Counts::default();
    let mut offenders = Vec::new();
    for (seed, judged) in &all {
        counts.add(judged);
        if matches!(judged, Judged::Offends { .. }) {
            let drawn = Drawn::new(*seed);
            let overrides = drawn.overrides(drawn.integrator, &drawn.settings, drawn.step_s);
            offenders.push(format!(
                "{judged:?}, seed {seed}, {} steps: {overrides:?}\n{}",
                drawn.between * crate::LOOKS,
                drawn.scene
            ));
        }
    }
    println!("{count} scenes: {counts}");
    assert!(offenders.is_empty(), "{count} scenes: {counts}\n{}", offenders.join("\n"));
    assert!(2 * counts.right > all.len(), "most scenes can be run well: {counts}");
}
