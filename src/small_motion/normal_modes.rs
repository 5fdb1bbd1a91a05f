//! Undamped modes about a state at rest, and the parts that they have in a motion.

use std::f64::consts::TAU;

use nalgebra::{Complex, DVector};

use super::band::Band;
use super::linearised::Linearised;
use super::modal_equation::ModalEquation;
use super::mode::{Kind, Mode, modes};
use super::point::Point;
use super::shape::{Figure, JointForces};
use super::subject::Subject;
use super::{LinkShape, NoModes};
use crate::scene::{End, Scene, System};

/// The modes of `(K − ω² M) φ = 0` at rest, real and with `φᵀ M φ = 1`, each with the damping that it has in the scene.
///
/// Dampers couple such modes only where damping is not proportional to the stiffness; that coupling is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalModes {
    point: Point,
    mass: Band,
    modes: Vec<NormalMode>,
}

/// One of them.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalMode {
    /// Name and shape.
    pub mode: Mode,
    /// Its equation.
    pub equation: ModalEquation,
    /// Forces at the joints in its free vibration without damping, over its displacement, N/m.
    pub joint_forces: JointForces,
    shape: Vec<f64>,
}

/// A mode's part in a state of motion; the mode's mass is 1 kg.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Amplitude {
    /// x, m.
    pub displacement: f64,
    /// ẋ, m/s.
    pub velocity: f64,
    /// ẍ, m/s².
    pub acceleration: f64,
}

impl NormalModes {
    /// The `count` lowest of a scene at rest with the first link's tangent at `angle_rad`; the crank is free or held as the scene
    /// drives it.
    ///
    /// # Errors
    /// [`NoModes`] where nothing can move, the position is singular, or eigenvalues are not found.
    pub fn new(scene: &Scene, angle_rad: f64, count: usize) -> Result<Self, NoModes> {
        let (damped, undamped) = (Subject::new(scene, None)?, Subject::new(&without_dampers(scene), None)?);
        let point = undamped.at_rest(angle_rad)?;
        let found = modes(&undamped, &point, count)?;
        let Linearised { mass, damping, .. } = Linearised::new(damped.mechanism().as_mut(), &point);
        let (mut mechanism, mut figure) = (undamped.mechanism(), Figure::new(&undamped));
        let mut joint_forces = |shape: &[f64], square: f64| figure.joint_forces(mechanism.as_mut(), &point, shape, square);
        let modes = found.into_iter().map(|mode| NormalMode::new(mode, &mass, &damping, &mut joint_forces)).collect();
        Ok(NormalModes { point, mass, modes })
    }

    /// The modes, lowest first.
    pub fn modes(&self) -> &[NormalMode] {
        &self.modes
    }

    /// The state at rest.
    pub fn point(&self) -> &Point {
        &self.point
    }

    /// The modes' parts in a motion `q`, `v`, `a`: since they are orthogonal by the mass,
    ///
    /// ```text
    /// x = φᵀ M (q − q₀)      ẋ = φᵀ M v      ẍ = φᵀ M a
    /// ```
    ///
    /// with the state at rest `q₀`. Coordinates must measure deflections in the frames of the links, as those of `modal` do: then the
    /// turning of the chain is in its own mode alone.
    pub fn amplitudes(&self, [q, v, a]: [&[f64]; 3]) -> Vec<Amplitude> {
        let off: Vec<f64> = q.iter().zip(&self.point.q).map(|(q, still)| q - still).collect();
        let [off, v, a] = [&off, v, a].map(|x| self.mass.times(x));
        let along = |shape: &[f64], vector: &[f64]| shape.iter().zip(vector).map(|(shape, x)| shape * x).sum();
        let part = |NormalMode { shape, .. }: &NormalMode| Amplitude {
            displacement: along(shape, &off),
            velocity: along(shape, &v),
            acceleration: along(shape, &a),
        };
        self.modes.iter().map(part).collect()
    }
}

impl NormalMode {
    fn new(mode: Mode, mass: &Band, damping: &Band, joint_forces: &mut dyn FnMut(&[f64], f64) -> JointForces) -> Self {
        let real: Vec<f64> = mode.shape.iter().map(|x| x.re).collect();
        let product = |band: &Band, x: &[f64]| -> f64 { band.times(x).iter().zip(x).map(|(p, x)| p * x).sum() };
        let norm = product(mass, &real).sqrt();
        let shape: Vec<f64> = real.iter().map(|x| x / norm).collect();
        let equation = ModalEquation { stiffness: mode.eigenvalue.im.powi(2), damping: product(damping, &shape) };
        // The links' shapes go with the real part.
        let mut mode = mode;
        for node in mode.links.iter_mut().flat_map(|link| &mut link.displacement) {
            *node = node.map(|x| Complex::from(x.re / norm));
        }
        mode.links.iter_mut().flat_map(|link| &mut link.turn).for_each(|turn| *turn = Complex::from(turn.re / norm));
        mode.shape = DVector::from_iterator(shape.len(), shape.iter().map(|x| Complex::from(*x)));
        NormalMode { mode, equation, joint_forces: joint_forces(&shape, equation.stiffness), shape }
    }

    /// Whether it vibrates with links or base strained; otherwise the chain turns or swings as it is, or a link buckles.
    pub fn is_vibration(&self) -> bool {
        matches!(self.mode.kind, Kind::Vibration(_)) && self.equation.stiffness > 0.0
    }

    /// Whether it swings with its damping; beyond critical damping it only decays.
    pub fn swings(&self) -> bool {
        self.equation.eigenvalue().im > 0.0
    }

    /// ω/2π, Hz.
    pub fn frequency_hz(&self) -> f64 {
        self.equation.stiffness.sqrt() / TAU
    }

    /// `½ (ẋ² + ω² x²)`, J.
    pub fn energy_j(&self, amplitude: Amplitude) -> f64 {
        0.5 * (amplitude.velocity.powi(2) + self.equation.stiffness * amplitude.displacement.powi(2))
    }

    /// The part of the displacement that does not follow the load, `ẍ/ω²`: of `ẍ + ω² x = f` the displacement is `f/ω² − ẍ/ω²`, the first
    /// term that of a load at rest (mode-acceleration method; Craig & Kurdila, *Fundamentals of Structural Dynamics*).
    ///
    /// It is all of a free vibration, and `(Ω/ω)²` of a deflection under a load of the lower frequency Ω.
    pub fn vibrating(&self, amplitude: Amplitude) -> f64 {
        (amplitude.acceleration / self.equation.stiffness).abs()
    }
}

/// The scene without anything that dissipates.
fn without_dampers(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if let System::Chain(chain) = &mut scene.system {
        chain.links.iter_mut().for_each(|link| link.damping_s = 0.0);
        chain.base.damper_nm_s_per_rad = 0.0;
        if let End::Slider(slider) = &mut chain.end {
            slider.friction_n_s_per_m = 0.0;
        }
    }
    scene
}

impl LinkShape {
    /// The same shape on `nodes` evenly spaced nodes, so that shapes of models with different nodes can be compared: linear along the
    /// chord, and across it the cubic that has the displacements and turns of the two nodes beside (Hermite).
    #[must_use]
    pub fn on_nodes(&self, nodes: usize) -> LinkShape {
        let (Some(intervals), true) = (self.displacement.len().checked_sub(1).filter(|i| *i > 0), nodes > 1) else {
            return self.clone();
        };
        let length_m = self.length_m();
        let element_m = length_m / intervals as f64;
        let at = |node: usize| {
            let place = node as f64 / (nodes - 1) as f64 * intervals as f64;
            let first = (place.floor() as usize).min(intervals - 1);
            (first, place - first as f64)
        };
        let displacement = |node: usize| {
            let (first, s) = at(node);
            let ([a, b], [turn, next]) = (
                [self.displacement[first], self.displacement[first + 1]],
                [self.turn[first] * element_m, self.turn[first + 1] * element_m],
            );
            let (square, cube) = (s * s, s * s * s);
            let across = a[1] * (1.0 - 3.0 * square + 2.0 * cube)
                + turn * (s - 2.0 * square + cube)
                + b[1] * (3.0 * square - 2.0 * cube)
                + next * (cube - square);
            [a[0] * (1.0 - s) + b[0] * s, across]
        };
        let blend = |node: usize| {
            let (first, s) = at(node);
            let [a, b] = [self.at_m[first], self.at_m[first + 1]];
            ([0, 1].map(|c| a[c] + s * (b[c] - a[c])), self.turn[first] * (1.0 - s) + self.turn[first + 1] * s)
        };
        let (at_m, turn) = (0..nodes).map(blend).unzip();
        LinkShape { displacement: (0..nodes).map(displacement).collect(), at_m, turn, ..self.clone() }
    }

    /// Length of the chord, m.
    pub fn length_m(&self) -> f64 {
        let ends = self.at_m.first().zip(self.at_m.last());
        ends.map_or(0.0, |(first, last)| (last[0] - first[0]).hypot(last[1] - first[1]))
    }

    /// Displacement of the middle from the chord, across it; the number of nodes is odd.
    pub fn bow(&self) -> f64 {
        let node = |i: usize| self.displacement.get(i).map_or(0.0, |node| node[1].re);
        let last = self.displacement.len().saturating_sub(1);
        node(last / 2) - 0.5 * (node(0) + node(last))
    }

    /// Turn of the chord, rad.
    pub fn chord_turn(&self) -> f64 {
        let node = |i: usize| self.displacement.get(i).map_or(0.0, |node| node[1].re);
        (node(self.displacement.len().saturating_sub(1)) - node(0)) / self.length_m().max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::super::likeness;
    use super::super::periodic::{CrankDrive, DrivenMechanism};
    use super::super::scheme::Scheme;
    use super::super::variation::TIGHT;
    use super::*;
    use crate::integrate::State;
    use crate::mechanics::Input;
    use crate::scene::SceneSource;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    /// The eigenvalues 0 of two links that turn freely came with a shift that found the same again, for ever.
    #[test]
    fn regress_the_search_for_slow_modes_ends() -> Tested {
        for (model, elements) in [("rigid", "1"), ("modal", "4"), ("finite-element", "4"), ("finite-element", "16")] {
            let [model, crank, rod] =
                [format!("solver.model={model}"), format!("crank.elements={elements}"), format!("rod.elements={elements}")];
            let scene = super::super::examples::arm(&[&model, &crank, &rod, "base.damper_nm_s_per_rad=5e-4"])?;
            for count in 1..40 {
                for angle_rad in [0.0, 0.9] {
                    let found = NormalModes::new(&scene, angle_rad, count)
                        .map_err(|error| format!("{model}, {crank}, {count}: {error}"))?;
                    let free = found.modes().iter().filter(|mode| mode.mode.eigenvalue.norm() == 0.0).count();
                    assert_eq!(free, count.min(2), "{model}, {crank}, {count}, {angle_rad} rad");
                }
            }
        }
        Ok(())
    }

    const ANGLE: f64 = 0.7;

    fn scene(overrides: &[&str]) -> Result<Scene, Box<dyn std::error::Error>> {
        let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
        Ok(SceneSource::open("crank-slider", &overrides)?.scene)
    }

    /// Parts of the vibrations' energy, J, after `steps` from the second vibration's shape, while the chain turns.
    fn energies(scene: &Scene, rate_rad_per_s: f64, steps: usize) -> Result<(Vec<f64>, f64), Box<dyn std::error::Error>> {
        let modes = NormalModes::new(scene, ANGLE, 7)?;
        let place = modes.modes().iter().position(|mode| mode.mode.name() == "rod bending 2").ok_or("no such mode")?;
        let q: Vec<f64> = modes.point().q.iter().zip(&modes.modes()[place].shape).map(|(q, x)| q + 1e-3 * x).collect();
        let mut mechanism = Subject::new(scene, None)?.mechanism();
        let (mut v, mut a) = (q.clone(), q.clone());
        mechanism.rigid_motion(&Input::default(), rate_rad_per_s, &q, &mut v, &mut a);
        let strain_j = mechanism.energy(&Input::default(), &q, &vec![0.0; v.len()], &a).strain_j.ok_or("no strain")?;
        let (mut state, step_s) = (State::new(q, v), 5e-4);
        let mut integrator = Scheme::Esdirk.integrator(state.q.len(), TIGHT);
        let mut system = DrivenMechanism::new(mechanism.as_mut(), CrankDrive::Torque { torque_nm: 0.0 });
        for step in 0..steps {
            integrator.step(&mut system, step as f64 * step_s, step_s, &mut state)?;
        }
        let now = NormalModes::new(scene, state.q[0], 7)?;
        let amplitudes = now.amplitudes([&state.q, &state.v, &state.a]);
        let second = now.modes().iter().zip(&amplitudes).filter(|(mode, _)| mode.is_vibration());
        Ok((second.map(|(mode, amplitude)| mode.energy_j(*amplitude)).collect(), strain_j))
    }

    /// Motion that begins in the second mode stays in it, with the strain energy that the model computes.
    #[test]
    fn val_a_rod_started_in_its_second_mode_carries_all_in_that() -> Tested {
        let undamped = scene(&["crank.damping_s=0", "rod.damping_s=0"])?;
        for (rate_rad_per_s, steps, least) in [(0.0, 0, 1.0 - 1e-8), (0.0, 333, 1.0 - 1e-3), (1.0, 333, 0.98)] {
            let (energies, strain_j) = energies(&undamped, rate_rad_per_s, steps)?;
            let all_j: f64 = energies.iter().sum();
            assert!(energies[1] > least * all_j, "{rate_rad_per_s} rad/s, {steps}: {energies:?}");
            assert!((energies[1] / strain_j - 1.0).abs() < 5.0 * (1.0 - least) + 1e-5, "{energies:?} of {strain_j}");
        }
        Ok(())
    }

    /// A cantilever of the mass m in `φ = cosh βx − cos βx − σ (sinh βx − sin βx)`, scaled to `∫ φ² dm = 1`: the root bears
    /// `ω² ∫ φ dm = ω² 2 σ √m / (β L)` (Blevins, *Formulas for Natural Frequency and Mode Shape*).
    #[test]
    fn val_the_force_at_the_root_of_a_cantilever_that_vibrates() -> Tested {
        let mass_kg: f64 = 7700.0 * 0.01 * 0.5;
        let closed_forms = [(0.734_095_514, 1.875_104_07), (1.018_467_319, 4.694_091_13)];
        for model in [["solver.model=finite-element", "beam.elements=8"], ["solver.model=modal", "beam.modes=8"]] {
            let clamped = ["solver.integrator=generalized-alpha", "pulse=[]", "drive.speed_rad_per_s=0"];
            let overrides: Vec<String> = model.into_iter().chain(clamped).map(str::to_owned).collect();
            let modes = NormalModes::new(&SceneSource::open("thesis-beam", &overrides)?.scene, 0.0, 2)?;
            for (mode, (sigma, beta)) in modes.modes().iter().zip(closed_forms) {
                let exact = mode.equation.stiffness * 2.0 * sigma * mass_kg.sqrt() / beta;
                let [[x, y], others @ ..] = mode.joint_forces;
                assert!((x.hypot(y) / exact - 1.0).abs() < 1e-3, "{model:?}, {}: {x} {y} for {exact}", mode.mode.name());
                assert_eq!(others, [[0.0; 2]; 2]);
            }
        }
        Ok(())
    }

    /// Modes of both models are one, on nodes that are not the same.
    #[test]
    fn val_shapes_of_two_models_are_alike() -> Tested {
        let fine = NormalModes::new(&scene(&["crank.modes=4", "rod.modes=12"])?, ANGLE, 5)?;
        let mesh = ["solver.model=finite-element", "solver.integrator=generalized-alpha", "crank.elements=6", "rod.elements=6"];
        let mesh = NormalModes::new(&scene(&mesh)?, ANGLE, 5)?;
        for (one, other) in fine.modes().iter().zip(mesh.modes()).skip(1) {
            let shape = |mode: &NormalMode| mode.mode.links.iter().map(|link| link.on_nodes(17)).collect::<Vec<_>>();
            let (alike, ratio) = (likeness(&shape(one), &shape(other)), other.frequency_hz() / one.frequency_hz());
            assert!(alike > 0.999 && (ratio - 1.0).abs() < 0.01, "{}: {alike} {ratio}", one.mode.name());
            assert!((one.equation.damping / other.equation.damping - 1.0).abs() < 0.02, "{}", one.mode.name());
        }
        Ok(())
    }
}
