//! From a scene to the engine that computes it, and the observation it fills.

use super::BuildError;
use super::drive::DriveLaw;
use super::engine::Engine;
use super::incremental::IncrementalEngine;
use super::integrated::Integrated;
use crate::integrate::{GeneralizedAlpha, Integrator, NewtonSettings, RungeKutta, TwoPoint};
use crate::mechanics::{FiniteElement, Incremental, LinkObservation, Mechanism, Modal, NodeObservation, Observation, Rigid};
use crate::scene::{End, IntegratorKind, ModelKind, Scene, Solver};

pub(super) fn engine(scene: &Scene, law: &DriveLaw) -> Result<Box<dyn Engine>, BuildError> {
    let refuse = |why| BuildError { model: scene.solver.model.as_str(), why };
    match scene.solver.model {
        ModelKind::Rigid => Ok(rigid(scene, law)),
        ModelKind::Incremental => {
            let model = Incremental::new(&scene.chain, scene.solver.weight)
                .ok_or_else(|| refuse("it needs a crank-slider of two flexible links"))?;
            Ok(Box::new(IncrementalEngine::new(model)))
        }
        ModelKind::Modal => Ok(integrated(Modal::new(scene), scene, law)),
        ModelKind::FiniteElement => Ok(integrated(FiniteElement::new(&scene.chain, law.is_motion()), scene, law)),
    }
}

/// Closed forms where the crank angle says it all; otherwise floating frames without any flexibility.
fn rigid(scene: &Scene, law: &DriveLaw) -> Box<dyn Engine> {
    if let (End::Free { .. }, [_, _]) = (&scene.chain.end, scene.chain.links.as_slice()) {
        let mut stiff = scene.clone();
        stiff.chain.links.iter_mut().for_each(|link| link.rigid = true);
        return integrated(Modal::new(&stiff), scene, law);
    }
    integrated(Rigid::new(&scene.chain, law.is_motion()), scene, law)
}

fn integrated<M: Mechanism + 'static>(mechanism: M, scene: &Scene, law: &DriveLaw) -> Box<dyn Engine> {
    let integrator = integrator(&scene.solver, mechanism.degrees_of_freedom());
    Box::new(Integrated::new(mechanism, integrator, law))
}

fn integrator(solver: &Solver, unknowns: usize) -> Integrator {
    let newton = NewtonSettings { tolerance: solver.tolerance, max_iterations: solver.max_iterations };
    match solver.integrator {
        IntegratorKind::TwoPoint => Integrator::TwoPoint(TwoPoint::new(unknowns, solver.weight, newton)),
        IntegratorKind::GeneralizedAlpha => {
            Integrator::GeneralizedAlpha(GeneralizedAlpha::new(unknowns, solver.rho_infinity, newton))
        }
        IntegratorKind::RungeKutta => Integrator::RungeKutta(RungeKutta::new(unknowns)),
    }
}

/// An empty observation with room for every node; internal forces where the model gives them.
pub(super) fn observation(scene: &Scene) -> Observation {
    let internal = scene.solver.model != ModelKind::Rigid;
    let link = |link: &crate::scene::Link| LinkObservation {
        nodes: vec![NodeObservation::default(); link.elements + 1],
        elements: vec![Default::default(); if internal { link.elements } else { 0 }],
        ..LinkObservation::default()
    };
    Observation { links: scene.chain.links.iter().map(link).collect(), ..Observation::default() }
}
