//! Tests of transfers between all models, and of the models as lines in motion.

mod line;
mod pairs;

use super::{CannotTransfer, Present, Transfer, dot};
use crate::mechanics::{ChainModel, FiniteElement, Input, Mechanism, Modal, Place, PlacePoint, Rigid};
use crate::scene::{Chain, End, ModelKind, Scene, SceneSource, System};
use crate::simulation::Simulation;

type Tested = Result<(), Box<dyn std::error::Error>>;

/// A model and its fineness.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Rigid,
    Modal(usize),
    Elements(usize),
}
use Kind::{Elements, Modal as Modes};

/// Step of the models that take over a state, s.
const STEP_S: f64 = 2e-3;

const ALL: [Kind; 15] = [
    Kind::Rigid,
    Modes(1),
    Modes(2),
    Modes(3),
    Modes(4),
    Modes(5),
    Modes(6),
    Modes(7),
    Modes(8),
    Elements(2),
    Elements(3),
    Elements(4),
    Elements(8),
    Elements(16),
    Elements(32),
];

/// A model with a state.
struct Moving {
    chain: Chain,
    mechanism: Box<dyn Mechanism>,
    input: Input,
    q: Vec<f64>,
    v: Vec<f64>,
}

fn scene(name: &str, overrides: &[&str]) -> Result<Scene, Box<dyn std::error::Error>> {
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    Ok(SceneSource::open(name, &overrides)?.scene)
}

/// The scene with another model.
fn with(scene: &Scene, kind: Kind) -> Scene {
    let mut scene = scene.clone();
    let System::Chain(chain) = &mut scene.system else { return scene };
    scene.solver.model = match kind {
        Kind::Rigid => ModelKind::Rigid,
        Modes(_) => ModelKind::Modal,
        Elements(_) => ModelKind::FiniteElement,
    };
    scene.solver.integrator = scene.solver.model.usual_integrator();
    for link in &mut chain.links {
        match kind {
            Kind::Rigid => {}
            Modes(n) => link.modes = n,
            Elements(n) => link.elements = n,
        }
    }
    scene
}

impl Moving {
    fn new(chain: &Chain, kind: Kind, prescribed: bool) -> Self {
        let free = matches!(chain.end, End::Free { .. }) && chain.links.len() == 2;
        let mut chain = chain.clone();
        let mechanism: Box<dyn Mechanism> = match kind {
            Kind::Rigid if free => {
                chain.links.iter_mut().for_each(|link| link.rigid = true);
                Box::new(Modal::new(&chain, prescribed))
            }
            Kind::Rigid => Box::new(Rigid::new(&chain, prescribed)),
            Modes(n) => {
                chain.links.iter_mut().for_each(|link| link.modes = n);
                Box::new(Modal::new(&chain, prescribed))
            }
            Elements(n) => {
                chain.links.iter_mut().for_each(|link| link.elements = n);
                Box::new(FiniteElement::new(&chain, prescribed))
            }
        };
        let n = mechanism.degrees_of_freedom();
        Self { chain, mechanism, input: Input::default(), q: vec![0.0; n], v: vec![0.0; n] }
    }

    /// The scene's motion after so many steps.
    fn after(steps: usize, scene: &Scene, kind: Kind) -> Result<Self, Box<dyn std::error::Error>> {
        let scene = with(scene, kind);
        let mut simulation = Simulation::new(&scene)?;
        for _ in 0..steps {
            simulation.step()?;
        }
        let motion = simulation.motion().ok_or("no motion")?;
        let chain = scene.chain().ok_or("no chain")?;
        let model = Self::new(chain, kind, motion.input.motion.is_some());
        Ok(Self { input: motion.input, q: motion.q, v: motion.v, ..model })
    }

    /// Its state in another model.
    fn to(&mut self, kind: Kind) -> Result<Self, CannotTransfer> {
        self.hand_to(Self::new(&self.chain, kind, self.input.motion.is_some()))
    }

    fn hand_to(&mut self, other: Self) -> Result<Self, CannotTransfer> {
        self.hand_in_steps_of(STEP_S, other)
    }

    fn hand_in_steps_of(&mut self, h_s: f64, mut other: Self) -> Result<Self, CannotTransfer> {
        other.input = self.input;
        let mut transfer = Transfer::new(&self.chain, &*self.mechanism, &other.chain, &*other.mechanism)?;
        let old = Present { input: &self.input, q: &self.q, v: &self.v };
        transfer.apply((&mut *self.mechanism, &old), (&mut *other.mechanism, h_s), &mut other.q, &mut other.v)?;
        Ok(other)
    }

    fn line(&mut self) -> &mut dyn ChainModel {
        self.mechanism.as_chain().expect("a chain")
    }

    fn points(&mut self, places: &[Place]) -> Vec<PlacePoint> {
        let mut points = vec![PlacePoint::default(); places.len()];
        let chain = self.mechanism.as_chain().expect("a chain");
        chain.points(&self.input, &self.q, &self.v, places, &mut points);
        points
    }

    /// Momenta of every rigid motion.
    fn momenta(&mut self) -> Vec<f64> {
        let n = self.q.len();
        let (mut turn, mut momentum) = (vec![0.0; n], vec![0.0; n]);
        let chain = self.mechanism.as_chain().expect("a chain");
        chain.momentum(&self.input, &self.q, &self.v, &mut momentum);
        let mut of = |link| chain.turn(&self.input, &self.q, link, &mut turn).then(|| dot(&turn, &momentum));
        (0..2).filter_map(&mut of).collect()
    }

    fn chords(&mut self) -> Vec<f64> {
        let mut angles = vec![0.0; self.chain.links.len()];
        let chain = self.mechanism.as_chain().expect("a chain");
        chain.chord_angles(&self.input, &self.q, &mut angles);
        angles
    }

    /// Kinetic and strain energy, J.
    fn energies(&mut self) -> [f64; 2] {
        let energy = self.mechanism.energy(&self.input, &self.q, &self.v, &vec![0.0; self.q.len()]);
        [energy.kinetic_j, energy.strain_j.unwrap_or(0.0)]
    }

    /// Largest distance between the ends of neighbours, and of a slider from its line.
    fn gap_m(&mut self) -> f64 {
        let links = self.chain.links.len();
        let ends: Vec<Place> = (0..links).flat_map(|link| [Place { link, xi: 0.0 }, Place { link, xi: 1.0 }]).collect();
        let points = self.points(&ends);
        let mut gap = points[0].position_m[0].hypot(points[0].position_m[1]);
        for pair in points[1..].chunks_exact(2) {
            let [one, other] = [pair[0].position_m, pair[1].position_m];
            gap = gap.max((one[0] - other[0]).hypot(one[1] - other[1]));
        }
        match self.chain.end {
            End::Slider(_) => gap.max(points[2 * links - 1].position_m[1].abs()),
            End::Free { .. } => gap,
        }
    }
}
