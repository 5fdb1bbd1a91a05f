//! The mechanism whose small motion is asked for.

use super::NoModes;
use crate::mechanics::{FiniteElement, Mechanism, Modal, Oscillator, Rigid};
use crate::scene::{Chain, Drive, End, ModelKind, Scene, System};

/// Least number of intervals between nodes on which the shape of a model without a mesh is drawn.
const NODES: usize = 32;

/// Freedom of the first link's tangent at the pivot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crank {
    /// It turns freely, under a torque.
    Free,
    /// It is held, or moved as prescribed.
    Held,
}

/// A scene's mechanism, by its model, the crank free or held.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    system: System,
    model: ModelKind,
    crank: Crank,
}

impl Subject {
    /// The mechanism of a scene; without a word about the crank, as the scene drives it.
    ///
    /// # Errors
    /// [`NoModes::NotSuited`] for a model that has no tangent.
    pub fn new(scene: &Scene, crank: Option<Crank>) -> Result<Self, NoModes> {
        let model = scene.solver.model;
        if model == ModelKind::Incremental {
            return Err(NoModes::NotSuited(model.as_str()));
        }
        let driven = match scene.drive {
            Drive::Motion(_) => Crank::Held,
            Drive::Torque { .. } => Crank::Free,
        };
        let mut system = scene.system.clone();
        if let (System::Chain(chain), true) = (&mut system, model != ModelKind::FiniteElement) {
            chain.links.iter_mut().for_each(|link| link.elements = link.elements.max(NODES));
        }
        Ok(Subject { system, model, crank: crank.unwrap_or(driven) })
    }

    /// Whether the crank is held or moved as prescribed.
    pub fn is_held(&self) -> bool {
        self.crank == Crank::Held && self.chain().is_some()
    }

    /// The chain of links, if that is what moves.
    pub fn chain(&self) -> Option<&Chain> {
        match &self.system {
            System::Chain(chain) => Some(chain),
            System::Oscillator(_) => None,
        }
    }

    /// The oscillating masses, if that is what moves.
    pub fn is_oscillator(&self) -> bool {
        self.chain().is_none()
    }

    /// Whether two links hang on the pivot with a free end.
    pub(super) fn has_free_second_link(&self) -> bool {
        self.chain().is_some_and(|chain| chain.links.len() > 1 && matches!(chain.end, End::Free { .. }))
    }

    /// Whether it can turn steadily: one link alone, with nothing that depends on its angle.
    pub fn turns_steadily(&self) -> bool {
        self.chain().is_some_and(|chain| {
            chain.links.len() == 1 && matches!(chain.end, End::Free { .. }) && chain.gravity_m_per_s2 == [0.0; 2]
        })
    }

    /// Whether the model's stiffness against stretching has that of tension against bending among it.
    pub(super) fn stretching_has_tension(&self) -> bool {
        self.model == ModelKind::FiniteElement
    }

    /// The model.
    pub fn mechanism(&self) -> Box<dyn Mechanism> {
        match &self.system {
            System::Oscillator(oscillator) => Box::new(Oscillator::new(oscillator)),
            System::Chain(chain) => self.model_of(chain),
        }
    }

    /// The model of this chain with some of it changed; of an oscillator, as it is.
    pub(super) fn changed(&self, change: impl FnOnce(&mut Chain)) -> Box<dyn Mechanism> {
        let Some(chain) = self.chain() else { return self.mechanism() };
        let mut chain = chain.clone();
        change(&mut chain);
        self.model_of(&chain)
    }

    /// The model that starts in equilibrium at an angle, held there by its drive alone.
    pub(super) fn starting_at(&self, angle_rad: f64) -> Box<dyn Mechanism> {
        self.changed(|chain| {
            chain.base.torsion_spring_nm_per_rad = 0.0;
            chain.start.angle_rad = angle_rad;
            chain.start.rate_rad_per_s = 0.0;
            chain.start.static_equilibrium = true;
        })
    }

    fn model_of(&self, chain: &Chain) -> Box<dyn Mechanism> {
        let held = self.is_held();
        match self.model {
            ModelKind::FiniteElement => Box::new(FiniteElement::new(chain, held)),
            ModelKind::Rigid if chain.links.len() > 1 && matches!(chain.end, End::Free { .. }) => {
                let mut stiff = chain.clone();
                stiff.links.iter_mut().for_each(|link| link.rigid = true);
                Box::new(Modal::new(&stiff, held))
            }
            ModelKind::Rigid => Box::new(Rigid::new(chain, held)),
            _ => Box::new(Modal::new(chain, held)),
        }
    }
}
