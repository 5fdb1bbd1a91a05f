//! Rigid links: one degree of freedom, the crank angle θ, in closed form (thesis chapter 4, with `θ̈` kept).
//!
//! Every body's centre of mass `c(θ)` and angle `β(θ)` are known functions, so the kinetic energy is `½ M(θ) θ̇²` and
//! Lagrange's equation reads
//!
//! `M θ̈ + ½ M′ θ̇² = τ − k θ − d θ̇ + Σ m g·c′ − (F + b x_E′ θ̇) x_E′`
//!
//! with `M = Σ (m c′·c′ + I β′²)`, `½ M′ = Σ (m c′·c″ + I β′ β″)`, resistance `F` and viscous friction `b` on the slider.

mod corners;
mod course;
mod line;
mod rigid_chain;
mod small_turn;
mod tangent;
mod two_links;

use crate::mechanics::crank_slider::{Path, Turn, along, crank_turn, moving, rod_turn};
use crate::mechanics::equilibrium::{Pivot, settle};
use crate::mechanics::joints;
use crate::mechanics::mechanism::{
    ChainModel, Coordinate, Input, Measure, Mechanism, NoEquilibrium, ROTATIONS, Singular, Weights,
};
use crate::mechanics::observation::{Energy, NodeObservation, Observation};
use crate::mechanics::resistance::resistance_n;
use crate::mechanics::rigid_bar::RigidBar;
use crate::scene::{Base, Chain, End, Resistance};

pub use course::{Course, Passage};
pub use rigid_chain::RigidChain;
pub use small_turn::{Block, CarriedTurn};
pub use two_links::TwoLinks;

/// A body of the chain at one crank angle.
#[derive(Debug, Clone, Copy)]
struct Body<const D: usize = 3> {
    mass_kg: f64,
    inertia_kg_m2: f64,
    centre: Path<D>,
    turn: Turn,
}

/// The rigid chain: a crank-slider, or one link with a free end.
#[derive(Debug, Clone)]
pub struct Rigid {
    chain: Chain,
    prescribed: bool,
    /// The last state and its terms: integrators ask for residual and tangent of the same state.
    last: Evaluated,
    tangent: f64,
    scale_nm: f64,
}

/// A crank angle and rate, and what belongs to them.
#[derive(Debug, Clone, Copy)]
struct Evaluated {
    theta_rad: f64,
    rate_rad_per_s: f64,
    pose: Pose,
    equation: Equation,
}

impl Evaluated {
    /// Equal to no state.
    const NONE: Self = Self {
        theta_rad: f64::NAN,
        rate_rad_per_s: f64::NAN,
        pose: Pose::NONE,
        equation: Equation { mass: 0.0, rest: 0.0, scale: 0.0 },
    };
}

/// Everything that depends on the crank angle alone: links, then what hangs on the end.
#[derive(Debug, Clone, Copy)]
struct Pose<const D: usize = 3> {
    bodies: [Body<D>; 3],
    links: usize,
    end: Path<D>,
}

impl<const D: usize> Pose<D> {
    const NONE: Self = Self {
        bodies: [Body { mass_kg: 0.0, inertia_kg_m2: 0.0, centre: [[0.0; 2]; D], turn: Turn::STILL }; 3],
        links: 0,
        end: [[0.0; 2]; D],
    };
}

/// Coefficients of the equation of motion at one state.
#[derive(Debug, Clone, Copy)]
struct Equation {
    mass: f64,
    /// `½ M′ θ̇²` minus all generalised forces but the torque.
    rest: f64,
    /// Sum of the magnitudes of its terms.
    scale: f64,
}

impl Rigid {
    /// One link, or a crank-slider; `prescribed` when the scene prescribes the motion of the pivot.
    pub fn new(chain: &Chain, prescribed: bool) -> Self {
        Rigid { chain: chain.clone(), prescribed, last: Evaluated::NONE, tangent: 1.0, scale_nm: 0.0 }
    }

    /// `M(θ)`, the inertia of everything as the crank feels it, kg·m².
    pub fn inertia_kg_m2(&self, theta_rad: f64) -> f64 {
        self.equation(&self.pose::<3>(theta_rad), theta_rad, 0.0).mass
    }

    /// Mass of all bodies, kg, and the path of their common centre: digest 4.28–4.29, its derivatives 4.33–4.43 (the thesis
    /// loses brackets in 4.42).
    pub fn centre_of_mass(&self, theta_rad: f64) -> (f64, Path) {
        let bodies = self.pose::<3>(theta_rad).bodies;
        let mass_kg: f64 = bodies.iter().map(|body| body.mass_kg).sum();
        let mut centre = [[0.0; 2]; 3];
        for body in &bodies {
            for (sum, at) in centre.iter_mut().flatten().zip(body.centre.iter().flatten()) {
                *sum += body.mass_kg / mass_kg * at;
            }
        }
        (mass_kg, centre)
    }

    /// The path of the chain's end: of a crank-slider, the slider pin.
    pub fn end(&self, theta_rad: f64) -> Path {
        self.pose(theta_rad).end
    }

    fn state(&self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 3] {
        match (q, v, a) {
            ([q], [v], [a]) => [*q, *v, *a],
            _ => input.motion.unwrap_or_default(),
        }
    }

    /// Pose and equation at an angle and rate, evaluated once.
    fn evaluate(&mut self, theta_rad: f64, rate_rad_per_s: f64) -> &Evaluated {
        if self.last.theta_rad != theta_rad || self.last.rate_rad_per_s != rate_rad_per_s {
            set_pose(&self.chain, theta_rad, &mut self.last.pose);
            self.last.equation = self.equation(&self.last.pose, theta_rad, rate_rad_per_s);
            (self.last.theta_rad, self.last.rate_rad_per_s) = (theta_rad, rate_rad_per_s);
        }
        &self.last
    }

    fn pose<const D: usize>(&self, theta_rad: f64) -> Pose<D> {
        let mut pose = Pose::NONE;
        set_pose(&self.chain, theta_rad, &mut pose);
        pose
    }

    /// Whether anything but torque and weight does work.
    fn is_loaded(&self) -> bool {
        let free = match &self.chain.end {
            End::Free { .. } => true,
            End::Slider(slider) => slider.resistance == Resistance::Constant(0.0) && slider.friction_n_s_per_m == 0.0,
        };
        self.chain.base.damper_nm_s_per_rad != 0.0 || !free
    }

    fn equation<const D: usize>(&self, pose: &Pose<D>, theta_rad: f64, rate: f64) -> Equation {
        let [mut mass, mut half_slope, mut weight] = [0.0; 3];
        let gravity = self.chain.gravity_m_per_s2;
        for body in &pose.bodies {
            let (c1, c2) = (&body.centre[1], &body.centre[2]);
            let [b1, b2, _] = body.turn.slopes;
            mass += body.mass_kg * dot(c1, c1) + body.inertia_kg_m2 * b1 * b1;
            half_slope += body.mass_kg * dot(c1, c2) + body.inertia_kg_m2 * b1 * b2;
            weight += body.mass_kg * dot(&gravity, c1);
        }
        let base = &self.chain.base;
        let spring = base.torsion_spring_nm_per_rad * theta_rad;
        let damper = base.damper_nm_s_per_rad * rate;
        let slide = pose.end[1][0];
        let resisted = self.resistance_and_friction_n(theta_rad, slide * rate) * slide;
        let inertia = half_slope * rate * rate;
        Equation {
            mass,
            rest: inertia + spring + damper + resisted - weight,
            scale: inertia.abs() + spring.abs() + damper.abs() + resisted.abs() + weight.abs(),
        }
    }

    fn resistance_and_friction_n(&self, theta_rad: f64, speed_m_per_s: f64) -> f64 {
        match &self.chain.end {
            End::Free { .. } => 0.0,
            End::Slider(slider) => resistance_n(&slider.resistance, theta_rad) + slider.friction_n_s_per_m * speed_m_per_s,
        }
    }

    /// Internal forces, where `out` has room for them.
    fn fill_bars(&self, pose: &Pose, [theta, rate, acceleration]: [f64; 3], torque_nm: f64, out: &mut Observation) {
        let Base { torsion_spring_nm_per_rad, damper_nm_s_per_rad } = self.chain.base;
        let root_nm = torque_nm - torsion_spring_nm_per_rad * theta - damper_nm_s_per_rad * rate;
        let firsts = [(out.pivot_n, root_nm), (out.crank_pin_n, 0.0)];
        let gravity = self.chain.gravity_m_per_s2;
        let mut at: Path = [[0.0; 2]; 3];
        for (i, (seen, (force, moment_nm))) in out.links.iter_mut().zip(firsts).enumerate() {
            let (link, turn) = (&self.chain.links[i], &pose.bodies[i].turn);
            let [angle_rad, rate_rad_per_s, acceleration_rad_per_s2] = turning(i, turn, [theta, rate, acceleration]);
            let bar = RigidBar {
                length_m: link.length_m,
                mass_kg: link.mass_kg,
                angle_rad,
                rate_rad_per_s,
                acceleration_rad_per_s2,
                first_m_per_s2: [0, 1].map(|k| at[2][k] * rate * rate + at[1][k] * acceleration - gravity[k]),
                force_n: force.unwrap_or_default(),
                moment_nm,
            };
            bar.fill(&mut seen.elements);
            at = along(&at, turn, link.length_m);
        }
    }

    fn energies(&self, pose: &Pose, theta_rad: f64, rate: f64, mass: f64) -> Energy {
        let base = self.chain.base.torsion_spring_nm_per_rad;
        let gravity = self.chain.gravity_m_per_s2;
        let height: f64 = pose.bodies.iter().map(|body| body.mass_kg * dot(&gravity, &body.centre[0])).sum();
        Energy {
            kinetic_j: 0.5 * mass * rate * rate,
            strain_j: (base != 0.0).then_some(0.5 * base * theta_rad * theta_rad),
            potential_j: (gravity != [0.0; 2]).then_some(-height),
        }
    }
}

impl Mechanism for Rigid {
    fn degrees_of_freedom(&self) -> usize {
        usize::from(!self.prescribed)
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        let free = self.chain.links.first().filter(|_| !self.prescribed);
        free.map(|link| Coordinate::turn(format!("{}_angle_rad", link.name.as_str()))).into_iter().collect()
    }

    fn start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) -> Result<(), NoEquilibrium> {
        q.fill(self.chain.start.angle_rad);
        v.fill(self.chain.start.rate_rad_per_s);
        let free = Pivot::of(&self.chain, input) == Pivot::Free;
        if !(self.chain.start.static_equilibrium && free) {
            return Ok(());
        }
        settle(self, input, q, |_, x| x.iter().map(|x| x.abs()).sum())
    }

    fn residual(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let [theta, rate, acceleration] = self.state(input, q, v, a);
        let equation = self.evaluate(theta, rate).equation;
        self.scale_nm = equation.scale + (equation.mass * acceleration).abs() + input.torque_nm.abs();
        r.fill(equation.mass * acceleration + equation.rest - input.torque_nm);
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        r.iter().map(|r| if *r == 0.0 { 0.0 } else { r.abs() / self.scale_nm }).fold(0.0, f64::max)
    }

    fn factor(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        let [theta, rate, acceleration] = self.state(input, q, v, a);
        self.tangent = self.tangent_at([theta, rate, acceleration], w);
        if self.tangent == 0.0 || !self.tangent.is_finite() { Err(Singular) } else { Ok(()) }
    }

    fn tangent(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        if !q.is_empty() {
            let state = self.state(input, q, v, a);
            entry(0, 0, self.tangent_at(state, w));
        }
    }

    fn rigid_motion(&mut self, _input: &Input, rate_rad_per_s: f64, _q: &[f64], v: &mut [f64], a: &mut [f64]) {
        v.fill(rate_rad_per_s);
        a.fill(0.0);
    }

    fn solve(&mut self, x: &mut [f64]) {
        for x in x {
            *x /= self.tangent;
        }
    }

    fn observe(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], out: &mut Observation) {
        let [theta, rate, acceleration] = self.state(input, q, v, a);
        let Evaluated { pose, equation, .. } = *self.evaluate(theta, rate);
        let mut at: Path = [[0.0; 2]; 3];
        let mut dynamics = pose.bodies.map(|body| joints::Body {
            mass_kg: body.mass_kg,
            inertia_kg_m2: body.inertia_kg_m2,
            acceleration_m_per_s2: moving(&body.centre, rate, acceleration)[2],
            ..joints::Body::default()
        });
        for (i, (link, seen)) in self.chain.links.iter().zip(&mut out.links).enumerate() {
            let turn = &pose.bodies[i].turn;
            let [angle, own_rate, own_acceleration] = turning(i, turn, [theta, rate, acceleration]);
            (dynamics[i].angle_rad, dynamics[i].angular_acceleration_rad_per_s2) = (angle, own_acceleration);
            seen.chord_rad = angle;
            seen.rate_rad_per_s = own_rate;
            seen.acceleration_rad_per_s2 = Some(own_acceleration);
            let steps = seen.nodes.len().saturating_sub(1).max(1) as f64;
            for (index, node) in seen.nodes.iter_mut().enumerate() {
                let point = along(&at, turn, link.length_m * index as f64 / steps);
                *node = NodeObservation {
                    position_m: point[0],
                    velocity_m_per_s: [point[1][0] * rate, point[1][1] * rate],
                    rotation_rad: Some(angle),
                    deflection_m: None,
                };
            }
            at = along(&at, turn, link.length_m);
        }
        let end_force_n = self.resistance_and_friction_n(theta, pose.end[1][0] * rate);
        joints::fill(&self.chain, &dynamics[..=pose.links], end_force_n, out);
        let torque_nm = if self.prescribed { equation.mass * acceleration + equation.rest } else { input.torque_nm };
        self.fill_bars(&pose, [theta, rate, acceleration], torque_nm, out);
        if let End::Slider(slider) = &self.chain.end {
            out.resistance_n = Some(resistance_n(&slider.resistance, theta));
        }
        out.motion_torque_nm = self.prescribed.then_some(torque_nm);
        out.energy = self.energies(&pose, theta, rate, equation.mass);
    }

    fn energy(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> Energy {
        let [theta, rate, _] = self.state(input, q, v, a);
        let Evaluated { pose, equation, .. } = *self.evaluate(theta, rate);
        self.energies(&pose, theta, rate, equation.mass)
    }

    fn measure(&self, _q: &[f64], dq: &[f64]) -> Option<Measure> {
        Some(Measure { angle_rad: dq.first().copied().unwrap_or(0.0), ..Measure::default() })
    }

    fn chords(&self, q: &[f64], v: &[f64]) -> [[f64; 2]; ROTATIONS] {
        [[q, v].map(|of| of.first().copied().unwrap_or(0.0)), [0.0; 2]]
    }

    fn turn_part(&mut self, _input: &Input, _q: &[f64], _v: &[f64], _a: &[f64], link: usize, part: &mut [f64]) -> bool {
        part.fill(1.0);
        link == 0 && !part.is_empty()
    }

    fn power(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 2] {
        let [theta, rate, acceleration] = self.state(input, q, v, a);
        if !self.prescribed && !self.is_loaded() {
            return [input.torque_nm * rate, 0.0];
        }
        let Evaluated { pose, equation, .. } = self.evaluate(theta, rate);
        let (motion_nm, speed) = (equation.mass * acceleration + equation.rest, pose.end[1][0] * rate);
        let torque_nm = if self.prescribed { motion_nm } else { input.torque_nm };
        let (resistance, friction) = match &self.chain.end {
            End::Free { .. } => (0.0, 0.0),
            End::Slider(slider) => (resistance_n(&slider.resistance, theta), slider.friction_n_s_per_m),
        };
        let damper = self.chain.base.damper_nm_s_per_rad;
        [torque_nm * rate - resistance * speed, damper * rate * rate + friction * speed * speed]
    }

    fn as_chain(&mut self) -> Option<&mut dyn ChainModel> {
        Some(self)
    }
}

/// Moves the bodies to a crank angle.
fn set_pose<const D: usize>(chain: &Chain, theta_rad: f64, pose: &mut Pose<D>) {
    let mut at = [[0.0; 2]; D];
    let mut turn = crank_turn(theta_rad);
    for (index, (body, link)) in pose.bodies.iter_mut().zip(&chain.links).enumerate() {
        if index == 1 {
            turn = rod_turn(&turn, chain.links[0].length_m / link.length_m);
        }
        (body.mass_kg, body.inertia_kg_m2, body.turn) = (link.mass_kg, link.inertia_kg_m2, turn);
        body.centre = along(&at, &turn, link.centre_of_mass_m);
        at = along(&at, &turn, link.length_m);
    }
    (pose.links, pose.end) = (chain.links.len(), at);
    if let Some(end) = pose.bodies.get_mut(pose.links) {
        end.centre = at;
        end.mass_kg = match &chain.end {
            End::Free { tip_mass_kg } => *tip_mass_kg,
            End::Slider(slider) => slider.mass_kg,
        };
    }
}

/// Angle, rate and acceleration of link `i`: the first is the crank, the second a rod, within a quarter turn of x.
fn turning(i: usize, turn: &Turn, [theta, rate, acceleration]: [f64; 3]) -> [f64; 3] {
    let [b1, b2, _] = turn.slopes;
    let angle = if i == 0 { theta } else { turn.sin.asin() };
    [angle, b1 * rate, b2 * rate * rate + b1 * acceleration]
}

fn dot(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
