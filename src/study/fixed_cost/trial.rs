//! A scene run with steps to the tolerance, with shorter ones, and with steps of fixed cost.

use super::error::NotRated;
use super::limits::MOST_LEFT;
use crate::mechanics::Observation;
use crate::scene::{Drive, Pulse, PulseShape, Scene};
use crate::simulation::{Diverged, PulseRequest, Simulation};
use crate::study::is_at_rest;

/// The most steps of a trial; the most steps times unknowns, for models of many unknowns; and the fewest steps.
const MOST_STEPS: usize = 5000;
const MOST_STEPS_TIMES_UNKNOWNS: usize = 200_000;
const LEAST_STEPS: usize = 200;
/// Instants at which motions are compared, about.
const INSTANTS: usize = 200;
/// Place of the test pulse in the window, and its duration where the scene has no pulse, as parts of the window.
const PULSE_AT: f64 = 0.4;
const PULSE_FOR: f64 = 0.1;
/// Parts of a step by which the test pulse begins and ends inside one.
const BEGINS_INSIDE: f64 = 0.37;
const ENDS_INSIDE: f64 = 0.41;

/// The steps of all trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    step_s: f64,
    steps: usize,
    /// Steps between two instants of comparison.
    every: usize,
}

impl Window {
    /// As long as the scene's usual run, or as its number of unknowns allows.
    pub(super) fn new(scene: &Scene, until_s: f64) -> Result<Self, NotRated> {
        let step_s = scene.solver.step_s;
        let unknowns = Simulation::new(scene)?.unknowns().unwrap_or(1).max(1);
        let most = (MOST_STEPS_TIMES_UNKNOWNS / unknowns).clamp(LEAST_STEPS, MOST_STEPS);
        let steps = ((until_s / step_s).ceil() as usize).clamp(1, most);
        Ok(Window { step_s, steps, every: steps.div_ceil(INSTANTS) })
    }

    pub(super) fn until_s(&self) -> f64 {
        self.step_s * self.steps as f64
    }
}

/// A rectangular pulse as strong and as long as the scene's strongest, or its constant torque, that begins and ends inside steps.
/// `None` if the scene has no torque.
pub(super) fn test_pulse(scene: &Scene, window: &Window) -> Option<PulseRequest> {
    let Drive::Torque { constant_nm, pulses } = &scene.drive else { return None };
    let usual =
        Pulse { start_s: 0.0, torque_nm: *constant_nm, duration_s: PULSE_FOR * window.until_s(), shape: PulseShape::Rectangular };
    let strongest = pulses.iter().chain([&usual]).max_by(|a, b| a.torque_nm.abs().total_cmp(&b.torque_nm.abs()))?;
    let whole = |time_s: f64| (time_s / window.step_s).floor();
    let limit_nm = scene.commands.torque_limit_nm;
    let request = PulseRequest {
        torque_nm: strongest.torque_nm.clamp(-limit_nm, limit_nm),
        duration_s: (whole(strongest.duration_s) + ENDS_INSIDE) * window.step_s,
        delay_s: (whole(PULSE_AT * window.until_s()) + BEGINS_INSIDE) * window.step_s,
        shape: PulseShape::Rectangular,
    };
    (request.torque_nm != 0.0 && scene.chain().is_some()).then_some(request)
}

/// A run, sampled from its start on: angles and relative deflections of all links, or the places of all masses.
type Samples = Vec<Vec<f64>>;

/// The motions that steps of fixed cost are compared with.
pub(super) struct Trial {
    window: Window,
    pulse: Option<PulseRequest>,
    /// With steps to the tolerance.
    converged: Samples,
    /// With as many corrections as are ever tried.
    settled: Samples,
    of_step: f64,
}

/// Errors of steps of fixed cost in one trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrialErrors {
    /// The test pulse, if there is one.
    pub pulse: Option<PulseRequest>,
    /// Error of the time step: the difference from steps half as long.
    pub of_step: f64,
    /// Added by corrections that are too few.
    pub by_iteration: f64,
    /// Added because loads that jump do not cut a step.
    pub by_loads: f64,
    /// Largest residual that a step left, relative to the forces at work.
    pub left_over: f64,
}

impl Trial {
    pub(super) fn new(scene: &Scene, window: Window, pulse: Option<PulseRequest>, most: usize) -> Result<Self, NotRated> {
        let run = |scene: &Scene, parts| samples(scene, window, pulse, parts);
        let (converged, _) = run(&with(scene, None, 1), 1)?;
        let (halved, _) = run(&with(scene, None, 2), 2)?;
        let settled = run(&with(scene, Some(most), 1), 1).map_err(|not| match not {
            NotRated::Diverged(_) => NotRated::TooSlow,
            other => other,
        })?;
        let of_step = difference(&converged, &halved);
        if settled.1 > MOST_LEFT && most > 0 {
            return Err(NotRated::TooSlow);
        }
        Ok(Trial { window, pulse, converged, settled: settled.0, of_step })
    }

    /// Whether anything moves by more than rounding, from the start on.
    pub(super) fn moves(&self) -> bool {
        let Some(first) = self.converged.first() else { return false };
        self.converged.iter().any(|sample| !is_at_rest(first, sample))
    }

    pub(super) fn errors(&self, scene: &Scene, corrections: usize) -> Result<TrialErrors, Diverged> {
        let (motion, left_over) = match samples(&with(scene, Some(corrections), 1), self.window, self.pulse, 1) {
            Ok(run) => run,
            Err(NotRated::Diverged(diverged)) => return Err(diverged),
            // The same scene was built before.
            Err(_) => (Vec::new(), f64::INFINITY),
        };
        Ok(TrialErrors {
            pulse: self.pulse,
            of_step: self.of_step,
            by_iteration: difference(&motion, &self.settled),
            by_loads: difference(&self.settled, &self.converged),
            left_over,
        })
    }
}

/// The scene with this number of corrections, and with its step divided into `parts`.
fn with(scene: &Scene, corrections: Option<usize>, parts: usize) -> Scene {
    let mut scene = scene.clone();
    scene.solver.corrections = corrections;
    scene.solver.step_s /= parts as f64;
    // The test pulse comes on top of the scene's own.
    scene.commands.pending_limit += 1;
    scene
}

/// Runs a scene whose steps are `parts` to one of the window, with `pulse`. Returns samples and the largest residual left.
fn samples(scene: &Scene, window: Window, pulse: Option<PulseRequest>, parts: usize) -> Result<(Samples, f64), NotRated> {
    let mut simulation = Simulation::new(scene)?;
    if let Some(pulse) = pulse {
        simulation.add_pulse(&pulse).map_err(NotRated::Pulse)?;
    }
    let (mut samples, mut left_over) = (vec![sample(scene, simulation.observation())], 0.0_f64);
    for step in 1..=window.steps {
        for _ in 0..parts {
            simulation.step()?;
            left_over = left_over.max(simulation.left_over());
        }
        if step % window.every == 0 || step == window.steps {
            samples.push(sample(scene, simulation.observe()?));
        }
    }
    Ok((samples, left_over))
}

fn sample(scene: &Scene, seen: &Observation) -> Vec<f64> {
    let Some(chain) = scene.chain() else {
        return seen.links.iter().flat_map(|link| link.nodes.iter().map(|node| node.position_m[0])).collect();
    };
    let links = seen.links.iter().zip(&chain.links);
    links
        .flat_map(|(seen, link)| {
            let middle = seen.nodes.get(seen.nodes.len() / 2).and_then(|node| node.deflection_m);
            [seen.chord_rad, middle.unwrap_or(0.0) / link.length_m]
        })
        .collect()
}

/// The largest difference of two runs.
fn difference(one: &Samples, other: &Samples) -> f64 {
    let pairs = one.iter().flatten().zip(other.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(if one.len() == other.len() { 0.0 } else { f64::INFINITY }, f64::max)
}
