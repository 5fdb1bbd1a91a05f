//! One way to compute a scene: model, integrator, discretization, step.

use std::f64::consts::PI;
use std::fmt;

use super::effort::RunEffort;
use crate::scene::{Chain, IntegratorKind, Link, ModelKind, Scene, System};

/// Everything but the step.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Family {
    /// The model.
    pub model: ModelKind,
    /// The integrator.
    pub integrator: IntegratorKind,
    /// Elements a flexible link, or modes of the one that vibrates most slowly, the others having those up to its highest
    /// frequency; 0 where the model has neither.
    pub resolution: usize,
    /// Whether each link is rigid.
    pub rigid: Vec<bool>,
    /// Whether `modal` lets each link stretch.
    pub axial: Vec<bool>,
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
pub(super) const OUTPUT_INTERVALS: usize = 2;

impl Family {
    /// The scene as this family computes it.
    pub fn scene(&self, scene: &Scene, step_s: f64) -> Scene {
        let mut scene = scene.clone();
        (scene.solver.model, scene.solver.integrator, scene.solver.step_s) = (self.model, self.integrator, step_s);
        if !scene.solver.iterates() {
            scene.solver.corrections = scene.solver.corrections.map(|_| 0);
        }
        if let System::Chain(chain) = &mut scene.system {
            let modes = self.modes(chain);
            for (((link, rigid), axial), modes) in chain.links.iter_mut().zip(&self.rigid).zip(&self.axial).zip(modes) {
                (link.rigid, link.axial) = (*rigid, *axial);
                link.elements = match self.model {
                    ModelKind::FiniteElement => self.resolution,
                    ModelKind::Incremental => 1,
                    _ => OUTPUT_INTERVALS,
                };
                if self.model == ModelKind::Modal {
                    link.modes = modes;
                }
            }
        }
        scene
    }

    /// Whether each of its links is rigid, whatever the model.
    pub(super) fn is_rigid(&self) -> bool {
        self.rigid.iter().all(|rigid| *rigid)
    }

    /// Whether both make the same of every link.
    pub(super) fn has_links_of(&self, other: &Family) -> bool {
        (&self.rigid, &self.axial) == (&other.rigid, &other.axial)
    }

    /// Modes of each link, up to one frequency for all, at least one: of pinned bars `ω_n = n² Ω`, `Ω = (π/l)² √(EJ/ρA)`. A
    /// frequency that pulse and step can follow on one link, they can follow on another.
    fn modes(&self, chain: &Chain) -> Vec<usize> {
        let frequencies = || chain.links.iter().zip(&self.rigid).map(|(link, rigid)| if *rigid { None } else { frequency(link) });
        let lowest = frequencies().flatten().fold(f64::INFINITY, f64::min);
        let up_to = |own: f64| (self.resolution as f64 * (lowest / own).sqrt() * (1.0 + 1e-12)).floor().max(1.0) as usize;
        frequencies().map(|own| own.map_or(1, up_to)).collect()
    }

    /// Microseconds a step takes on a usual machine, roughly: what is worth computing is decided by this, so that it is the same
    /// from run to run.
    ///
    /// Read off a study of the default scene, with one iteration a step.
    pub(super) fn nominal_step_us(&self) -> f64 {
        let flexible = self.rigid.iter().filter(|rigid| !**rigid).count() as f64;
        let size = self.resolution as f64;
        let once = match (self.model, self.integrator) {
            (ModelKind::Rigid, _) => 0.4,
            (ModelKind::Modal, IntegratorKind::RungeKutta) => 1.2 + flexible * size + self.stretching(),
            (ModelKind::Modal, _) => 0.6 + 0.5 * (flexible * size + self.stretching()),
            (ModelKind::FiniteElement, _) => 1.0 + 0.65 * flexible * size,
            (ModelKind::Incremental | ModelKind::MassSpring, _) => 0.7,
        };
        if self.integrator == IntegratorKind::Esdirk { 2.5 * once } else { once }
    }

    /// Microseconds of computing by counted work: residuals, factorizations and solutions cost as 1, 3.3 and 0.7 of a residual, and
    /// the rest of a step as 1.5. The count is the same on a busy machine, so choices between configurations use it.
    ///
    /// Fitted to the default scene, `ref-r2s` and the rigid crank on one shared core: within a third of the measured times, except
    /// for Runge–Kutta's rigid crank, which took half.
    pub(super) fn counted_us(&self, counts: &RunEffort, scene: &Scene) -> f64 {
        let bent = || self.rigid.iter().filter(|rigid| !**rigid).count() as f64;
        let residual_us = match self.model {
            ModelKind::Rigid => 0.05,
            ModelKind::Modal => scene.chain().map_or(0.1, |chain| 0.1 * self.modes_in_all(chain)),
            ModelKind::FiniteElement => 0.1 + 0.05 * bent() * self.resolution as f64,
            ModelKind::Incremental | ModelKind::MassSpring => 0.2,
        };
        let [residuals, factorizations, solutions, steps] =
            [counts.residuals, counts.factorizations, counts.newton_iterations, counts.steps].map(|count| count as f64);
        residual_us * (residuals + 3.3 * factorizations + 0.7 * solutions + 1.5 * steps)
    }

    /// Bending modes, and what stretching costs in them.
    fn modes_in_all(&self, chain: &Chain) -> f64 {
        let modes = self.modes(chain).into_iter().zip(&self.rigid);
        let bending = modes.map(|(modes, rigid)| if *rigid { 0.0 } else { modes as f64 }).sum::<f64>();
        (bending + self.stretching()).max(1.0)
    }

    /// Bending modes that cost as much as the links that stretch: half a mode for each. So measured on the default scene, with 1 to
    /// 4 modes a link and all integrators: steps take 1.2 to 1.4 times as long where both links stretch.
    fn stretching(&self) -> f64 {
        0.5 * self.stretching_links().count() as f64
    }

    /// The places of the flexible links that stretch in `modal`.
    fn stretching_links(&self) -> impl Iterator<Item = usize> {
        (0..).zip(self.rigid.iter().zip(&self.axial)).filter(|(_, (rigid, axial))| !**rigid && **axial).map(|(place, _)| place)
    }

    /// The discretization in a table.
    pub fn discretization(&self) -> String {
        let size = match self.model {
            ModelKind::FiniteElement if self.is_rigid() => return String::from("rigid links"),
            ModelKind::Modal => format!("{} {}", self.resolution, if self.resolution == 1 { "mode" } else { "modes" }),
            ModelKind::FiniteElement => format!("{} elements", self.resolution),
            _ => return String::from("–"),
        };
        let named = |place: Option<usize>, what: &str| match place {
            Some(place) if self.rigid.len() == 2 => format!(", {} {what}", ["crank", "rod"][place]),
            _ => String::new(),
        };
        let rigid = named(self.rigid.iter().position(|rigid| *rigid), "rigid");
        let axial = match self.stretching_links().count() {
            _ if self.model != ModelKind::Modal => String::new(),
            0 => String::new(),
            1 if self.axial.len() == 2 => named(self.stretching_links().next(), "axial"),
            _ => ", axial".to_owned(),
        };
        format!("{size}{rigid}{axial}")
    }
}

/// Whether each link is rigid; see [`is_rigid`].
pub(super) fn rigid_links(chain: &Chain) -> Vec<bool> {
    chain.links.iter().map(is_rigid).collect()
}

/// Whether a link is rigid in every model: as the scene asks, or for want of a stiffness, which a scene of `rigid` may leave out.
pub(super) fn is_rigid(link: &Link) -> bool {
    link.rigid || link.bar.is_none_or(|bar| bar.bending_stiffness_nm2() == 0.0)
}

/// The first natural frequency of a link between two pins, rad/s.
pub(super) fn frequency(link: &Link) -> Option<f64> {
    let bar = link.bar.as_ref()?;
    Some((PI / link.length_m).powi(2) * (bar.bending_stiffness_nm2() / bar.mass_per_length_kg_per_m()).sqrt())
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
        let Family { model, integrator, resolution, rigid, axial } = &self.family;
        let mut keys = vec![
            format!("solver.model=\"{}\"", model.as_str()),
            format!("solver.integrator=\"{}\"", integrator.as_str()),
            format!("solver.step_s={}", self.step_s),
        ];
        let corrections = self.scene(scene).solver.corrections;
        if corrections != scene.solver.corrections {
            keys.extend(corrections.map(|corrections| format!("solver.corrections={corrections}")));
        }
        let links = scene.chain().map_or(&[][..], |chain| &chain.links);
        let modes = scene.chain().map_or_else(Vec::new, |chain| self.family.modes(chain));
        for (((link, rigid), axial), modes) in links.iter().zip(rigid).zip(axial).zip(modes) {
            let name = link.name.as_str();
            match model {
                ModelKind::FiniteElement if !rigid => keys.push(format!("{name}.elements={resolution}")),
                ModelKind::Modal if !rigid => keys.push(format!("{name}.modes={modes}")),
                ModelKind::Incremental => keys.push(format!("{name}.elements=1")),
                _ => {}
            }
            if *model == ModelKind::Modal && !rigid && *axial != link.axial {
                keys.push(format!("{name}.axial={axial}"));
            }
            if *model != ModelKind::Rigid && *rigid != link.rigid {
                keys.push(format!("{name}.rigid={rigid}"));
            }
        }
        keys
    }
}

impl Configuration {
    /// A word for a level of detail: `modal-4-2ms`.
    pub(super) fn word(&self) -> String {
        let Family { model, integrator: _, resolution, rigid, axial: _ } = &self.family;
        let size = if *resolution > 0 && !self.family.is_rigid() { format!("-{resolution}") } else { String::new() };
        let part = match rigid[..] {
            [true, false] if *resolution > 0 => "-rigid-crank",
            [false, true] if *resolution > 0 => "-rigid-rod",
            _ => "",
        };
        // Seven digits: a product has rounding beyond them.
        let step_ms: f64 = format!("{:.6e}", 1e3 * self.step_s).parse().unwrap_or(1e3 * self.step_s);
        let stretch = match self.family.stretching_links().collect::<Vec<_>>()[..] {
            _ if *model != ModelKind::Modal => "",
            [] => "",
            [0] if rigid[..] == [false, false] => "-axial-crank",
            [1] if rigid[..] == [false, false] => "-axial-rod",
            _ => "-axial",
        };
        format!("{}{size}{part}{stretch}-{step_ms}ms", model.as_str())
    }
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, step {:e} s", self.family, self.step_s)
    }
}
