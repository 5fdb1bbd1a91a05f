//! Rigid links: one degree of freedom, the crank angle θ, in closed form (thesis chapter 4, with `θ̈` kept).
//!
//! Every body's centre of mass `c(θ)` and angle `β(θ)` are known functions, so the kinetic energy is `½ M(θ) θ̇²` and
//! Lagrange's equation reads
//!
//! `M θ̈ + ½ M′ θ̇² = τ − k θ − d θ̇ + Σ m g·c′ − (F + b x_E′ θ̇) x_E′`
//!
//! with `M = Σ (m c′·c′ + I β′²)`, `½ M′ = Σ (m c′·c″ + I β′ β″)`, resistance `F` and viscous friction `b` on the slider.

use super::crank_slider::{Path, Turn, along, crank_turn, moving, rod_turn};
use super::joints;
use super::mechanism::{Input, Mechanism, Singular, Weights};
use super::observation::{Energy, NodeObservation, Observation};
use super::resistance::resistance_n;
use super::rigid_bar::RigidBar;
use crate::scene::{Base, Chain, End};

const ORIGIN: Path = [[0.0; 2]; 4];

/// A body of the chain at one crank angle.
#[derive(Debug, Clone, Copy, Default)]
struct Body {
    mass_kg: f64,
    inertia_kg_m2: f64,
    centre: Path,
    angle: Turn,
}

/// The rigid chain: a crank-slider, or one link with a free end.
#[derive(Debug, Clone)]
pub struct Rigid {
    chain: Chain,
    prescribed: bool,
    tangent: f64,
    scale_nm: f64,
}

/// Everything that depends on the crank angle alone: links, then what hangs on the end.
struct Pose {
    bodies: [Body; 3],
    links: usize,
    end: Path,
}

/// Coefficients of the equation of motion at one state.
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
        Rigid { chain: chain.clone(), prescribed, tangent: 1.0, scale_nm: 0.0 }
    }

    /// `M(θ)`, the inertia of everything as the crank feels it, kg·m².
    pub(crate) fn inertia_kg_m2(&self, theta_rad: f64) -> f64 {
        self.equation(&self.pose(theta_rad), theta_rad, 0.0).mass
    }

    /// Mass of all bodies, kg, and the path of their common centre: digest 4.28–4.29, its derivatives 4.33–4.43 (the thesis
    /// loses brackets in 4.42).
    pub(crate) fn centre_of_mass(&self, theta_rad: f64) -> (f64, Path) {
        let bodies = self.pose(theta_rad).bodies;
        let mass_kg: f64 = bodies.iter().map(|body| body.mass_kg).sum();
        let mut centre = ORIGIN;
        for body in &bodies {
            for (sum, at) in centre.iter_mut().flatten().zip(body.centre.iter().flatten()) {
                *sum += body.mass_kg / mass_kg * at;
            }
        }
        (mass_kg, centre)
    }

    /// The path of the chain's end: of a crank-slider, the slider pin.
    pub(crate) fn end(&self, theta_rad: f64) -> Path {
        self.pose(theta_rad).end
    }

    fn state(&self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 3] {
        match (q, v, a) {
            ([q], [v], [a]) => [*q, *v, *a],
            _ => input.motion.unwrap_or_default(),
        }
    }

    fn pose(&self, theta_rad: f64) -> Pose {
        let mut bodies = [Body::default(); 3];
        let mut at = ORIGIN;
        let mut angle = crank_turn(theta_rad);
        for (index, (body, link)) in bodies.iter_mut().zip(&self.chain.links).enumerate() {
            if index == 1 {
                angle = rod_turn(theta_rad, self.chain.links[0].length_m / link.length_m);
            }
            let centre = along(&at, &angle, link.centre_of_mass_m);
            *body = Body { mass_kg: link.mass_kg, inertia_kg_m2: link.inertia_kg_m2, centre, angle };
            at = along(&at, &angle, link.length_m);
        }
        let links = self.chain.links.len();
        bodies[links] = Body { mass_kg: self.end_mass_kg(), inertia_kg_m2: 0.0, centre: at, angle: [0.0; 4] };
        Pose { bodies, links, end: at }
    }

    fn end_mass_kg(&self) -> f64 {
        match &self.chain.end {
            End::Free { tip_mass_kg } => *tip_mass_kg,
            End::Slider(slider) => slider.mass_kg,
        }
    }

    fn equation(&self, pose: &Pose, theta_rad: f64, rate: f64) -> Equation {
        let [mut mass, mut half_slope, mut weight] = [0.0; 3];
        let gravity = self.chain.gravity_m_per_s2;
        for body in &pose.bodies {
            let [_, c1, c2, _] = &body.centre;
            let [_, b1, b2, _] = body.angle;
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

    /// `∂(M θ̈ + rest)/∂θ` by differentiating term by term; a table's slope within its segment is left to the iteration.
    fn stiffness(&self, pose: &Pose, rate: f64, acceleration: f64) -> f64 {
        let gravity = self.chain.gravity_m_per_s2;
        let bodies: f64 = pose
            .bodies
            .iter()
            .map(|body| {
                let [_, c1, c2, c3] = &body.centre;
                let [_, b1, b2, b3] = body.angle;
                let slope = 2.0 * (body.mass_kg * dot(c1, c2) + body.inertia_kg_m2 * b1 * b2);
                let half_curve = body.mass_kg * (dot(c2, c2) + dot(c1, c3)) + body.inertia_kg_m2 * (b2 * b2 + b1 * b3);
                slope * acceleration + half_curve * rate * rate - body.mass_kg * dot(&gravity, c2)
            })
            .sum();
        let (x1, x2) = (pose.end[1][0], pose.end[2][0]);
        let slider = match &self.chain.end {
            End::Free { .. } => 0.0,
            End::Slider(slider) => {
                let force = resistance_n(&slider.resistance, 0.0);
                let constant = matches!(slider.resistance, crate::scene::Resistance::Constant(_));
                (if constant { force * x2 } else { 0.0 }) + 2.0 * slider.friction_n_s_per_m * rate * x1 * x2
            }
        };
        bodies + self.chain.base.torsion_spring_nm_per_rad + slider
    }

    fn viscosity(&self, pose: &Pose, rate: f64) -> f64 {
        let half_slope: f64 = pose
            .bodies
            .iter()
            .map(|body| body.mass_kg * dot(&body.centre[1], &body.centre[2]) + body.inertia_kg_m2 * body.angle[1] * body.angle[2])
            .sum();
        let friction = match &self.chain.end {
            End::Free { .. } => 0.0,
            End::Slider(slider) => slider.friction_n_s_per_m * pose.end[1][0].powi(2),
        };
        2.0 * half_slope * rate + self.chain.base.damper_nm_s_per_rad + friction
    }

    /// Internal forces, where `out` has room for them.
    fn fill_bars(&self, pose: &Pose, [theta, rate, acceleration]: [f64; 3], torque_nm: f64, out: &mut Observation) {
        let Base { torsion_spring_nm_per_rad, damper_nm_s_per_rad } = self.chain.base;
        let root_nm = torque_nm - torsion_spring_nm_per_rad * theta - damper_nm_s_per_rad * rate;
        let firsts = [(out.pivot_n, root_nm), (out.crank_pin_n, 0.0)];
        let gravity = self.chain.gravity_m_per_s2;
        let mut at = ORIGIN;
        for (i, (seen, (force, moment_nm))) in out.links.iter_mut().zip(firsts).enumerate() {
            let (link, angle) = (&self.chain.links[i], &pose.bodies[i].angle);
            let bar = RigidBar {
                length_m: link.length_m,
                mass_kg: link.mass_kg,
                angle_rad: angle[0],
                rate_rad_per_s: angle[1] * rate,
                acceleration_rad_per_s2: angle[2] * rate * rate + angle[1] * acceleration,
                first_m_per_s2: [0, 1].map(|k| at[2][k] * rate * rate + at[1][k] * acceleration - gravity[k]),
                force_n: force.unwrap_or_default(),
                moment_nm,
            };
            bar.fill(&mut seen.elements);
            at = along(&at, angle, link.length_m);
        }
    }

    fn energy(&self, pose: &Pose, theta_rad: f64, rate: f64, mass: f64) -> Energy {
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

    fn start(&mut self, _input: &Input, q: &mut [f64], v: &mut [f64]) {
        q.fill(self.chain.start.angle_rad);
        v.fill(self.chain.start.rate_rad_per_s);
    }

    fn residual(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let [theta, rate, acceleration] = self.state(input, q, v, a);
        let equation = self.equation(&self.pose(theta), theta, rate);
        self.scale_nm = equation.scale + (equation.mass * acceleration).abs() + input.torque_nm.abs();
        r.fill(equation.mass * acceleration + equation.rest - input.torque_nm);
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        r.iter().map(|r| if *r == 0.0 { 0.0 } else { r.abs() / self.scale_nm }).fold(0.0, f64::max)
    }

    fn factor(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        let [theta, rate, acceleration] = self.state(input, q, v, a);
        let pose = self.pose(theta);
        self.tangent = w.acceleration * self.equation(&pose, theta, rate).mass;
        if w.velocity != 0.0 {
            self.tangent += w.velocity * self.viscosity(&pose, rate);
        }
        if w.position != 0.0 {
            self.tangent += w.position * self.stiffness(&pose, rate, acceleration);
        }
        if self.tangent == 0.0 || !self.tangent.is_finite() { Err(Singular) } else { Ok(()) }
    }

    fn solve(&mut self, x: &mut [f64]) {
        for x in x {
            *x /= self.tangent;
        }
    }

    fn observe(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], out: &mut Observation) {
        let [theta, rate, acceleration] = self.state(input, q, v, a);
        let pose = self.pose(theta);
        let equation = self.equation(&pose, theta, rate);
        let mut at = ORIGIN;
        for (link, (body, seen)) in self.chain.links.iter().zip(pose.bodies.iter().zip(&mut out.links)) {
            let angle = &body.angle;
            seen.chord_rad = angle[0];
            seen.rate_rad_per_s = angle[1] * rate;
            seen.acceleration_rad_per_s2 = Some(angle[2] * rate * rate + angle[1] * acceleration);
            let steps = seen.nodes.len().saturating_sub(1).max(1) as f64;
            for (index, node) in seen.nodes.iter_mut().enumerate() {
                let point = along(&at, angle, link.length_m * index as f64 / steps);
                *node = NodeObservation {
                    position_m: point[0],
                    velocity_m_per_s: [point[1][0] * rate, point[1][1] * rate],
                    rotation_rad: Some(angle[0]),
                    deflection_m: None,
                };
            }
            at = along(&at, angle, link.length_m);
        }
        let dynamics = pose.bodies.map(|body| joints::Body {
            mass_kg: body.mass_kg,
            inertia_kg_m2: body.inertia_kg_m2,
            angle_rad: body.angle[0],
            acceleration_m_per_s2: moving(&body.centre, rate, acceleration)[2],
            angular_acceleration_rad_per_s2: body.angle[2] * rate * rate + body.angle[1] * acceleration,
        });
        let end_force_n = self.resistance_and_friction_n(theta, pose.end[1][0] * rate);
        joints::fill(&self.chain, &dynamics[..=pose.links], end_force_n, out);
        let torque_nm = if self.prescribed { equation.mass * acceleration + equation.rest } else { input.torque_nm };
        self.fill_bars(&pose, [theta, rate, acceleration], torque_nm, out);
        if let End::Slider(slider) = &self.chain.end {
            out.resistance_n = Some(resistance_n(&slider.resistance, theta));
        }
        out.motion_torque_nm = self.prescribed.then_some(torque_nm);
        out.energy = self.energy(&pose, theta, rate, equation.mass);
    }

    fn power(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 2] {
        let [theta, rate, acceleration] = self.state(input, q, v, a);
        let pose = self.pose(theta);
        let torque_nm = if self.prescribed {
            let equation = self.equation(&pose, theta, rate);
            equation.mass * acceleration + equation.rest
        } else {
            input.torque_nm
        };
        let speed = pose.end[1][0] * rate;
        let (resistance, friction) = match &self.chain.end {
            End::Free { .. } => (0.0, 0.0),
            End::Slider(slider) => (resistance_n(&slider.resistance, theta), slider.friction_n_s_per_m),
        };
        let damper = self.chain.base.damper_nm_s_per_rad;
        [torque_nm * rate - resistance * speed, damper * rate * rate + friction * speed * speed]
    }
}

fn dot(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
