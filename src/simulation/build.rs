//! From a scene to the engine that computes it, and the observation it fills.

use super::drive::DriveLaw;
use super::engine::Engine;
use super::fading::fading_per_s;
use super::incremental::IncrementalEngine;
use super::integrated::Integrated;
use super::step_limit::{StepLimit, step_limit};
use super::{BuildError, PulseRefused, start_refusal};
use crate::integrate::{Esdirk, FixedCost, GeneralizedAlpha, Integrator, NewtonSettings, RungeKutta, TwoPoint};
use crate::mechanics::{
    ElementForces, FiniteElement, Incremental, LinkObservation, Mechanism, Modal, NoEquilibrium, NodeObservation, Observation,
    Oscillator, Rigid, RigidChain,
};
use crate::scene::{Chain, Drive, End, IntegratorKind, Link, ModelKind, Scene, Solver, System};

pub(super) fn engine(scene: &Scene, law: &DriveLaw) -> Result<Box<dyn Engine>, BuildError> {
    let refuse = |why: &'static str| BuildError { key: "solver.model", model: scene.solver.model.as_str(), why: why.into() };
    let chain = match &scene.system {
        System::Chain(chain) => chain,
        System::Oscillator(oscillator) => return integrated(Oscillator::new(oscillator), scene, law),
    };
    match scene.solver.model {
        ModelKind::Rigid => rigid(chain, scene, law),
        ModelKind::Incremental if law.is_motion() => {
            Err(refuse("a torque drives it, and [drive] prescribes a motion: use modal, finite-element or rigid"))
        }
        ModelKind::Incremental if chain.start.static_equilibrium => Err(BuildError {
            key: "start.static_equilibrium",
            ..refuse("it starts with straight links: use modal, finite-element or rigid")
        }),
        ModelKind::Incremental => {
            let model = Incremental::new(chain, scene.solver.weight)
                .ok_or_else(|| refuse("its links need a section: a rigid link has none"))?;
            Ok(Box::new(IncrementalEngine::new(model)))
        }
        ModelKind::Modal => integrated(Modal::new(chain, law.is_motion()), scene, law),
        ModelKind::MassSpring => Err(refuse("it needs an [oscillator]")),
        ModelKind::FiniteElement => integrated(FiniteElement::new(chain, law.is_motion()), scene, law),
    }
}

/// Closed forms where the crank angle says it all; otherwise floating frames without any flexibility.
fn rigid(chain: &Chain, scene: &Scene, law: &DriveLaw) -> Result<Box<dyn Engine>, BuildError> {
    if let (End::Free { .. }, [_, _]) = (&chain.end, chain.links.as_slice()) {
        let mut stiff = chain.clone();
        stiff.links.iter_mut().for_each(|link| link.rigid = true);
        return integrated(Modal::new(&stiff, law.is_motion()), scene, law);
    }
    integrated(Rigid::new(chain, law.is_motion()), scene, law)
}

fn integrated<M: Mechanism + 'static>(mut mechanism: M, scene: &Scene, law: &DriveLaw) -> Result<Box<dyn Engine>, BuildError> {
    let refuse = |key, why| BuildError { key, model: scene.solver.model.as_str(), why };
    let no_equilibrium = |NoEquilibrium| refuse("start.static_equilibrium", start_refusal::no_equilibrium(scene).into());
    if scene.solver.integrator == IntegratorKind::RungeKutta {
        let (input, n) = (law.input(0.0), mechanism.degrees_of_freedom());
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        mechanism.start(&input, &mut q, &mut v).map_err(no_equilibrium)?;
        if let Some(limit) = step_limit(&mut mechanism, &input, &q).filter(|limit| scene.solver.step_s > limit.longest_s) {
            return Err(refuse("solver.step_s", beyond(&limit, &scene.solver).into()));
        }
    }
    let integrator = integrator(&scene.solver, mechanism.degrees_of_freedom());
    let error = (as_rigid(scene, law), fading_per_s(scene, law));
    Ok(Box::new(Integrated::new(mechanism, integrator, error, (law, scene.solver.step_s)).map_err(no_equilibrium)?))
}

/// Part of the energy that a prescribed motion gives the masses below which nothing is divergence.
const SMALL_PART: f64 = 1e-3;

/// Energy, J, below which a step of a prescribed motion is no divergence: a thousandth of that of all masses at the crank pin's largest
/// speed, `m (l₁ ω)² / 2`. Where such a motion begins, as behind a dwell, a scheme's work of a step errs by as much as the little energy that
/// there is; what grows by itself passes this a few steps later. 0 under a torque.
pub(super) fn least_energy_j(scene: &Scene, law: &DriveLaw) -> f64 {
    let Some(chain) = scene.chain() else { return 0.0 };
    let end_kg = match &chain.end {
        End::Slider(slider) => slider.mass_kg,
        End::Free { tip_mass_kg } => *tip_mass_kg,
    };
    let mass_kg = end_kg + chain.links.iter().map(|link| link.mass_kg).sum::<f64>();
    let speed_m_per_s = chain.links.first().map_or(0.0, |link| link.length_m) * law.largest_rate_rad_per_s();
    SMALL_PART * 0.5 * mass_kg * speed_m_per_s.powi(2)
}

/// The scene's chain as if its links were rigid, if its motion is free.
fn as_rigid(scene: &Scene, law: &DriveLaw) -> Option<RigidChain> {
    scene.chain().filter(|_| !law.is_motion()).map(RigidChain::new)
}

/// Says that the step is too long for the explicit scheme, and which one is not: the next below 0.9 of the limit with one digit.
fn beyond(limit: &StepLimit, solver: &Solver) -> String {
    let StepLimit { longest_s, fastest_per_s } = limit;
    let digit = 10.0_f64.powf((0.9 * longest_s).log10().floor());
    let suggested_s = (0.9 * longest_s / digit).floor() * digit;
    format!(
        "solver.step_s = {} is beyond the stability limit of runge-kutta, {longest_s:.2e} s (its fastest motion at the start: \
         {fastest_per_s:.2e} rad/s); solver.step_s={suggested_s:.0e} is within it; or take an implicit integrator",
        solver.step_s
    )
}

fn integrator(solver: &Solver, unknowns: usize) -> Integrator {
    let newton = NewtonSettings { tolerance: solver.tolerance, max_iterations: solver.max_iterations };
    let integrator = match solver.integrator {
        IntegratorKind::TwoPoint => Integrator::TwoPoint(TwoPoint::new(unknowns, solver.weight, newton)),
        IntegratorKind::GeneralizedAlpha => {
            Integrator::GeneralizedAlpha(GeneralizedAlpha::new(unknowns, solver.rho_infinity, newton))
        }
        IntegratorKind::RungeKutta => Integrator::RungeKutta(RungeKutta::new(unknowns)),
        IntegratorKind::Esdirk => Integrator::Esdirk(Esdirk::new(unknowns, newton)),
    };
    integrator.with_fixed_cost(solver.corrections.map(|corrections| FixedCost { corrections }))
}

/// An empty observation with room for every node, and for internal forces of links whose distribution of mass is known.
pub(super) fn observation(scene: &Scene) -> Observation {
    let link = |link: &Link| LinkObservation {
        nodes: vec![NodeObservation::default(); link.elements + 1],
        elements: vec![ElementForces::default(); if link.bar.is_some() { link.elements } else { 0 }],
        ..LinkObservation::default()
    };
    let links = match &scene.system {
        System::Chain(chain) => chain.links.iter().map(link).collect(),
        System::Oscillator(oscillator) => {
            let count = oscillator.masses_kg.len();
            let nodes = vec![NodeObservation::default(); count];
            vec![LinkObservation { nodes, exact_x_m: vec![0.0; count], ..LinkObservation::default() }]
        }
    };
    Observation { links, ..Observation::default() }
}

/// Why torque has no effect on a scene, if so.
pub(super) fn refuses_torque(scene: &Scene) -> Option<PulseRefused> {
    match (&scene.system, &scene.drive) {
        (System::Oscillator(_), _) => Some(PulseRefused::NoPivot),
        (System::Chain(_), Drive::Motion(_)) => Some(PulseRefused::MotionPrescribed),
        (System::Chain(_), Drive::Torque { .. }) => None,
    }
}
