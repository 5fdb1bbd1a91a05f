//! One way to compute a scene: model, integrator, discretization, step.

use std::fmt;

use crate::scene::{IntegratorKind, ModelKind, Scene, System};

/// Everything but the step.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Family {
    /// The model.
    pub model: ModelKind,
    /// The integrator.
    pub integrator: IntegratorKind,
    /// Elements or modes a flexible link; 0 where the model has neither.
    pub resolution: usize,
    /// Which links are rigid.
    pub rigid: Vec<bool>,
}

/// A family at one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Everything but the step.
    pub family: Family,
    /// The step, s.
    pub step_s: f64,
}

/// Intervals between the output nodes of models without a mesh: enough for a node in the middle.
const OUTPUT_INTERVALS: usize = 2;

impl Family {
    /// The scene as this family computes it.
    pub fn scene(&self, scene: &Scene, step_s: f64) -> Scene {
        let mut scene = scene.clone();
        (scene.solver.model, scene.solver.integrator, scene.solver.step_s) = (self.model, self.integrator, step_s);
        if let System::Chain(chain) = &mut scene.system {
            for (link, rigid) in chain.links.iter_mut().zip(&self.rigid) {
                link.rigid = *rigid;
                link.elements = match self.model {
                    ModelKind::FiniteElement => self.resolution,
                    ModelKind::Incremental => 1,
                    _ => OUTPUT_INTERVALS,
                };
                if self.model == ModelKind::Modal {
                    link.modes = self.resolution;
                }
            }
        }
        scene
    }

    /// Microseconds a step takes on a usual machine, roughly: what is worth computing is decided by this, so that it is the same
    /// from run to run.
    pub(super) fn nominal_step_us(&self) -> f64 {
        let flexible = self.rigid.iter().filter(|rigid| !**rigid).count() as f64;
        let size = self.resolution as f64;
        let once = match (self.model, self.integrator) {
            (ModelKind::Rigid, _) => 0.5,
            (ModelKind::Modal, IntegratorKind::RungeKutta) => 2.0 + 1.5 * flexible * size * size.sqrt(),
            (ModelKind::Modal, _) => 1.5 + flexible * size * size.sqrt(),
            (ModelKind::FiniteElement, _) => 1.0 + 0.65 * flexible * size,
            (ModelKind::Incremental | ModelKind::MassSpring, _) => 2.0,
        };
        if self.integrator == IntegratorKind::ComposedMidpoint { 5.0 * once } else { once }
    }

    /// What a table says of the discretization.
    pub fn discretization(&self) -> String {
        let size = match self.model {
            ModelKind::Modal => format!("{} {}", self.resolution, if self.resolution == 1 { "mode" } else { "modes" }),
            ModelKind::FiniteElement => format!("{} elements", self.resolution),
            _ => return String::from("–"),
        };
        match self.rigid.iter().position(|rigid| *rigid) {
            Some(place) if self.rigid.len() == 2 => format!("{size}, {} rigid", ["crank", "rod"][place]),
            _ => size,
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.model.as_str(), self.integrator.as_str())?;
        if self.resolution > 0 { write!(f, ", {}", self.discretization()) } else { Ok(()) }
    }
}

impl Configuration {
    /// The scene as this configuration computes it.
    pub fn scene(&self, scene: &Scene) -> Scene {
        self.family.scene(scene, self.step_s)
    }

    /// Scene keys and values that ask for this configuration.
    pub fn keys(&self, scene: &Scene) -> Vec<String> {
        let Family { model, integrator, resolution, rigid } = &self.family;
        let mut keys = vec![
            format!("solver.model=\"{}\"", model.as_str()),
            format!("solver.integrator=\"{}\"", integrator.as_str()),
            format!("solver.step_s={}", self.step_s),
        ];
        let links = scene.chain().map_or(&[][..], |chain| &chain.links);
        for (link, rigid) in links.iter().zip(rigid) {
            let name = link.name.as_str();
            match model {
                ModelKind::FiniteElement if !rigid => keys.push(format!("{name}.elements={resolution}")),
                ModelKind::Modal if !rigid => keys.push(format!("{name}.modes={resolution}")),
                ModelKind::Incremental => keys.push(format!("{name}.elements=1")),
                _ => {}
            }
            if *model != ModelKind::Rigid && *rigid != link.rigid {
                keys.push(format!("{name}.rigid={rigid}"));
            }
        }
        keys
    }
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, step {:e} s", self.family, self.step_s)
    }
}
