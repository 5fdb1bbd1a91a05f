//! The mechanism whose small motion is asked for.

use super::NoModes;
use super::linearised::torque_row;
use super::point::Point;
use crate::mechanics::{FiniteElement, Input, Mechanism, Modal, Oscillator, Rigid};
use crate::scene::{Chain, Drive, End, ModelKind, Scene, System};
use crate::simulation::drive_at_start;

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
    drive_at_start: Input,
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
        Ok(Subject { system, model, crank: crank.unwrap_or(driven), drive_at_start: drive_at_start(scene) })
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

    /// Whether masses oscillate.
    pub fn is_oscillator(&self) -> bool {
        self.chain().is_none()
    }

    /// The oscillating masses, if that is what moves.
    pub(super) fn masses(&self) -> Option<&crate::scene::Oscillator> {
        match &self.system {
            System::Chain(_) => None,
            System::Oscillator(oscillator) => Some(oscillator),
        }
    }

    /// Whether two links hang on the pivot with a free end.
    pub(super) fn has_free_second_link(&self) -> bool {
        self.chain().is_some_and(|chain| chain.links.len() > 1 && matches!(chain.end, End::Free { .. }))
    }

    /// Whether the crank is free, and a base spring holds it.
    pub(super) fn has_base_spring(&self) -> bool {
        !self.is_held() && self.chain().is_some_and(|chain| chain.base.torsion_spring_nm_per_rad > 0.0)
    }

    /// Whether it can turn steadily: one link alone, with nothing that depends on its angle. A base spring counts as one that turns along,
    /// as in a hub.
    pub fn turns_steadily(&self) -> bool {
        self.chain().is_some_and(|chain| {
            chain.links.len() == 1 && matches!(chain.end, End::Free { .. }) && chain.gravity_m_per_s2 == [0.0; 2]
        })
    }

    pub(super) fn model(&self) -> ModelKind {
        self.model
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

    /// Angle of the first link's tangent at the pivot as the scene starts, rad: `start.angle_rad`, or as its motion is prescribed, or
    /// where static equilibrium turns it. 0 for an oscillator.
    ///
    /// # Errors
    /// [`NoModes::NoEquilibrium`] where no equilibrium is found.
    pub fn start_rad(&self) -> Result<f64, NoModes> {
        let Some(chain) = self.chain() else { return Ok(0.0) };
        let angle_rad = self.drive_at_start.motion.map_or(chain.start.angle_rad, |[angle_rad, ..]| angle_rad);
        let balance_rad = if chain.start.static_equilibrium { self.balance_rad()? } else { None };
        Ok(balance_rad.unwrap_or(angle_rad))
    }

    /// Angle of that tangent, rad, at which a base spring balances weight and constant loads; `None` without a spring, or with
    /// prescribed motion.
    ///
    /// # Errors
    /// [`NoModes::NoEquilibrium`] where none is found from the start on.
    pub fn balance_rad(&self) -> Result<Option<f64>, NoModes> {
        let input = self.drive_at_start;
        let sprung = |chain: &&Chain| chain.base.torsion_spring_nm_per_rad > 0.0 && input.motion.is_none();
        let Some(angle_rad) = self.chain().filter(sprung).map(|chain| chain.start.angle_rad) else { return Ok(None) };
        let free = Subject { crank: Crank::Free, ..self.clone() };
        let mut mechanism = free.changed(|chain| chain.start.static_equilibrium = true);
        let n = mechanism.degrees_of_freedom();
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        let no_equilibrium = |_| NoModes::NoEquilibrium { angle_deg: angle_rad.to_degrees() };
        mechanism.start(&input, &mut q, &mut v).map_err(no_equilibrium)?;
        // The row of the torque is that of the tangent's angle in the coordinates.
        let point = Point { input, a: vec![0.0; n], v: vec![0.0; n], q, speed_rad_per_s: 0.0 };
        let row = torque_row(mechanism.as_mut(), &point);
        Ok(Some(row.iter().zip(&point.q).map(|(row, q)| row * q).sum()))
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

#[cfg(test)]
mod tests {
    use std::error::Error;

    use super::Subject;
    use crate::scene::SceneSource;
    use crate::simulation::Simulation;
    use crate::small_motion::examples::arm;
    use crate::small_motion::{Crank, modes};

    /// A scene on a base spring starts where that balances the loads. Modes were those at `start.angle_rad`, 0.69 Hz for 0.86 Hz.
    #[test]
    fn regress_a_scene_that_sags_is_at_rest_where_its_run_starts() -> Result<(), Box<dyn Error>> {
        let beam = ["torque.constant_nm=0.3", "pulse=[]", "base.torsion_spring_nm_per_rad=200", "beam.second_moment_m4=1e-8"];
        let crank_slider = ["torque.constant_nm=2", "base.torsion_spring_nm_per_rad=30", "start.angle_rad=0.4"];
        let common = ["start.static_equilibrium=true", "gravity.y_m_per_s2=-9.81", "solver.integrator=generalized-alpha"];
        for (name, own) in [("thesis-beam", &beam[..]), ("crank-slider", &crank_slider)] {
            for model in ["modal", "finite-element", "rigid"] {
                let mut given: Vec<String> = common.iter().chain(own).map(|&given| given.to_owned()).collect();
                given.push(format!("solver.model={model}"));
                let source = SceneSource::open(name, &given)?;
                let subject = Subject::new(&source.scene, None)?;
                let angle_rad = subject.start_rad()?;
                assert_eq!(Subject::new(&source.scene, Some(Crank::Held))?.start_rad()?, angle_rad);
                let (point, torque_nm) = (subject.at_rest(angle_rad)?, own[0].rsplit_once('=').map_or("", |given| given.1));
                let said = format!("{name}, {model} at {angle_rad}: {} N·m", point.input.torque_nm);
                assert!((point.input.torque_nm - torque_nm.parse::<f64>()?).abs() < 1e-6 && angle_rad.abs() > 0.01, "{said}");
                let run = Simulation::new(&source.scene)?.motion().ok_or("no motion")?;
                let off = point.q.iter().zip(&run.q).map(|(own, run)| (own - run).abs()).fold(0.0, f64::max);
                assert!(off < 1e-8 && point.q.len() == run.q.len(), "{said}, {off:.1e} from the run");
            }
        }
        Ok(())
    }

    /// The second link was at angle 0 without weight, and not in line with the first, as a run starts: 194 Hz for 218 Hz.
    #[test]
    fn regress_a_free_second_link_is_in_line_or_hangs() -> Result<(), Box<dyn Error>> {
        for (model, angle_rad) in [("rigid", 0.9), ("modal", 0.9), ("finite-element", 0.9), ("finite-element", -3.0)] {
            let keys =
                [format!("solver.model={model}"), format!("start.angle_rad={angle_rad}"), "solver.integrator=esdirk".to_owned()];
            let scene = arm(&keys.each_ref().map(String::as_str))?;
            let subject = Subject::new(&scene, None)?;
            let (point, run) = (subject.at_rest(subject.start_rad()?)?, Simulation::new(&scene)?.motion().ok_or("no motion")?);
            let off = point.q.iter().zip(&run.q).map(|(own, run)| (own - run).abs()).fold(0.0, f64::max);
            assert!(off < 1e-12 && point.q.len() == run.q.len(), "{model} at {angle_rad}: {off:.1e} from the run");
        }
        // Weight lets it hang, beneath an upright crank too.
        for model in ["rigid", "modal", "finite-element"] {
            let subject =
                Subject::new(&arm(&[&format!("solver.model={model}"), "gravity.y_m_per_s2=-9.81"])?, Some(Crank::Held))?;
            for angle_deg in [-200.0_f64, -90.0, 0.0, 57.0, 90.0, 270.0] {
                let swing = modes(&subject, &subject.at_rest(angle_deg.to_radians())?, 1)?[0].frequency_hz();
                assert!((0.9..1.1).contains(&swing), "{model} at {angle_deg}°: {swing} Hz");
            }
        }
        Ok(())
    }

    #[test]
    fn regress_a_prescribed_motion_starts_at_the_first_row_of_its_table() -> Result<(), Box<dyn Error>> {
        let table = "[beam]\nlength_m = 0.4\nrigid = true\nmass_kg = 1\n[drive]\ntable = [[0, 0.7], [1, 1.2]]\n";
        let scene = SceneSource::parse("mine.toml", table, &[])?.scene;
        assert!((Subject::new(&scene, None)?.start_rad()? - 0.7).abs() < 1e-12);
        Ok(())
    }
}
