//! Scenes and drivers for the tests of `modal`.

mod balance;
mod laws;
mod linear;
mod references;
mod tangents;

use super::Modal;
use crate::integrate::{self, GeneralizedAlpha, NewtonSettings, RungeKutta, State, System, TwoPoint};
use crate::mechanics::mechanism::{Input, Mechanism, Weights};
use crate::mechanics::observation::Observation;
use crate::scene::*;
use std::f64::consts::{PI, TAU};

/// A mechanism under loads given as a function of time, for the integrators.
struct Driven {
    model: Modal,
    input: Box<dyn Fn(f64) -> Input>,
}

impl System for Driven {
    fn degrees_of_freedom(&self) -> usize {
        self.model.degrees_of_freedom()
    }
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.model.residual(&(self.input)(t_s), q, v, a, r);
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        self.model.residual_size(r)
    }
    fn factor(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: integrate::Weights) -> Result<(), integrate::Singular> {
        let w = Weights { acceleration: w.acceleration, velocity: w.velocity, position: w.position };
        self.model.factor(&(self.input)(t_s), q, v, a, w).map_err(|_| integrate::Singular)
    }
    fn solve(&mut self, x: &mut [f64]) {
        self.model.solve(x);
    }
}

impl Driven {
    fn new(scene: &Scene, input: impl Fn(f64) -> Input + 'static) -> (Self, State) {
        let mut model = Modal::new(scene);
        let n = model.degrees_of_freedom();
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        model.start(&input(0.0), &mut q, &mut v);
        (Self { model, input: Box::new(input) }, State::new(q, v))
    }

    /// All outputs at a state; its accelerations are solved for.
    fn look(&mut self, t_s: f64, state: &mut State) -> Observation {
        let mut scratch = state.q.clone();
        integrate::solve_acceleration(self, t_s, &state.q, &state.v, &mut state.a, &mut scratch).unwrap();
        let mut out = Observation::default();
        let input = (self.input)(t_s);
        self.model.observe(&input, &state.q, &state.v, &state.a, &mut out);
        out
    }
}

/// A scheme by name.
enum Scheme {
    RungeKutta(RungeKutta),
    GeneralizedAlpha(GeneralizedAlpha),
    Midpoint(TwoPoint),
}

impl Scheme {
    fn runge_kutta(n: usize) -> Self {
        Self::RungeKutta(RungeKutta::new(n))
    }
    fn generalized_alpha(n: usize) -> Self {
        Self::GeneralizedAlpha(GeneralizedAlpha::new(n, 0.9, NewtonSettings { tolerance: 1e-11, max_iterations: 12 }))
    }
    fn midpoint(n: usize) -> Self {
        Self::Midpoint(TwoPoint::new(n, 0.5, NewtonSettings { tolerance: 1e-11, max_iterations: 12 }))
    }
    fn step(&mut self, system: &mut Driven, t_s: f64, h_s: f64, state: &mut State) -> integrate::Effort {
        match self {
            Self::RungeKutta(scheme) => scheme.step(system, t_s, h_s, state),
            Self::GeneralizedAlpha(scheme) => scheme.step(system, t_s, h_s, state),
            Self::Midpoint(scheme) => scheme.step(system, t_s, h_s, state),
        }
        .unwrap()
    }
}

/// Runs from step `from` to step `to` of `h_s`.
fn advance(scheme: &mut Scheme, system: &mut Driven, h_s: f64, from: usize, to: usize, state: &mut State) -> u32 {
    (from..to).map(|step| scheme.step(system, step as f64 * h_s, h_s, state).newton_iterations).sum()
}

/// A uniform bar.
fn bar(name: LinkName, length_m: f64, area_m2: f64, second_moment_m4: f64, density: f64, youngs: f64) -> Link {
    let mass_kg = density * area_m2 * length_m;
    Link {
        name,
        length_m,
        mass_kg,
        centre_of_mass_m: 0.5 * length_m,
        inertia_kg_m2: mass_kg * length_m * length_m / 12.0,
        bar: Some(Bar { area_m2, second_moment_m4, density_kg_per_m3: density, youngs_modulus_pa: youngs }),
        rigid: false,
        elements: 8,
        modes: 2,
        axial: false,
        damping_s: 0.0,
    }
}

/// A slider with nothing but its mass.
fn slider(mass_kg: f64) -> End {
    End::Slider(Slider { mass_kg, resistance: Resistance::Constant(0.0), friction_n_s_per_m: 0.0 })
}

/// Crank 0.5 m and rod 1.5 m of steel with a massless slider.
fn crank_slider(second_moment_m4: f64) -> Scene {
    let link = |name, length| bar(name, length, 1e-4, second_moment_m4, 7700.0, 2.1e11);
    scene(vec![link(LinkName::Crank, 0.5), link(LinkName::Rod, 1.5)], slider(0.0))
}

/// The same with everything that a scene can ask for.
fn everything() -> Scene {
    let mut scene = crank_slider(8.333e-10);
    scene.chain.gravity_m_per_s2 = [1.3, -9.81];
    scene.chain.base = Base { torsion_spring_nm_per_rad: 30.0, damper_nm_s_per_rad: 0.2 };
    let resistance = Resistance::Table(vec![[0.5, 3.0], [2.0, 40.0], [5.0, -7.0]]);
    scene.chain.end = End::Slider(Slider { mass_kg: 0.4, resistance, friction_n_s_per_m: 3.0 });
    for link in &mut scene.chain.links {
        link.damping_s = 1e-5;
        link.axial = true;
    }
    scene.chain.start.angle_rad = 0.4;
    scene.chain.start.rate_rad_per_s = 3.0;
    scene
}

/// Every kind of chain: with slider, free, of one link, with a prescribed tangent, with one and with two rigid links.
fn every_chain() -> Vec<(&'static str, Scene)> {
    let slider = everything();
    let (mut inextensible, mut free, mut driven, mut mixed) = (slider.clone(), slider.clone(), slider.clone(), slider.clone());
    inextensible.chain.links.iter_mut().for_each(|link| link.axial = false);
    free.chain.end = End::Free { tip_mass_kg: 0.7 };
    let mut one = free.clone();
    one.chain.links.pop();
    driven.drive = Drive::Motion(Motion::Speed(0.0));
    mixed.chain.links[0].rigid = true;
    let mut rigid = mixed.clone();
    rigid.chain.links[1].rigid = true;
    let names = ["slider", "inextensible", "free", "one", "driven", "mixed", "rigid"];
    names.into_iter().zip([slider, inextensible, free, one, driven, mixed, rigid]).collect()
}

/// A scene without loads.
fn scene(links: Vec<Link>, end: End) -> Scene {
    Scene {
        chain: Chain { links, end, base: Base::default(), gravity_m_per_s2: [0.0; 2], start: Start::default() },
        drive: Drive::Torque { constant_nm: 0.0, pulses: Vec::new() },
        commands: Commands { torque_limit_nm: 1e4, pending_limit: 1024 },
        solver: Solver {
            model: ModelKind::Modal,
            integrator: IntegratorKind::RungeKutta,
            step_s: 1e-4,
            weight: 0.5,
            rho_infinity: 0.9,
            tolerance: 1e-10,
            max_iterations: 10,
        },
    }
}

/// Torque of a raised-cosine pulse of mean `torque_nm` over the first `duration_s`.
fn raised_cosine(torque_nm: f64, duration_s: f64) -> impl Fn(f64) -> Input {
    move |t| Input {
        torque_nm: if t < duration_s { torque_nm * (1.0 - (TAU * t / duration_s).cos()) } else { 0.0 },
        motion: None,
    }
}

/// Constant torque.
fn torque(torque_nm: f64) -> impl Fn(f64) -> Input {
    move |_| Input { torque_nm, motion: None }
}

/// Constant speed of the tangent at the pivot.
fn speed(rad_per_s: f64) -> impl Fn(f64) -> Input {
    move |t| Input { torque_nm: 0.0, motion: Some([rad_per_s * t, rad_per_s, 0.0]) }
}

/// Numbers between −1 and 1.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut x = seed.wrapping_mul(2).wrapping_add(1);
    move || {
        x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (x >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Rows of a reference file in `tests/data`.
fn reference(name: &str) -> Vec<Vec<f64>> {
    let path = format!("{}/tests/data/{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}
