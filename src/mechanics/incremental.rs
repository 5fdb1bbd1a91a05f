//! The thesis's incremental method (5.1, 5.3): linear elements, one a link, in a configuration updated after every step.
//!
//! Each step solves `M v̇ + K d = p` by the two-point method in the configuration `X` where the last step ended, then moves the
//! configuration: `X ← X + d`, chord angles Ψ and with them `M = Tᵀ M_l T`, `K = Tᵀ K_l T` anew. Of `d` the next step keeps the
//! rotations relative to their own link's chord, `w − ΔΨ`; translations, and so the axial strain, are dropped; velocities go on
//! unchanged. The retained rotations are added to the configuration again at every step: the nodal rotations `w` drift from the
//! tangents, the positions do not feel it. Gyroscopic terms are left out. All of that is the thesis's; here only `ΔΨ` is taken
//! modulo 2π, without which the method breaks where `atan2` wraps.
//!
//! Eliminating `d₁ = d₀ + h (ϑ v₁ + (1 − ϑ) v₀)` from the two-point step leaves
//! `(M + h² ϑ² K) v₁ = M v₀ + h p − h K d₀ − h² ϑ (1 − ϑ) K v₀`.
//!
//! # What it does
//!
//! Crank angle of the thesis's run at t = 4 s, where the rigid links' true angle is 2.206287 rad (`flexcrank run
//! thesis-crank-slider --pace max --until 4 --set solver.model=rigid --set solver.integrator=runge-kutta --set
//! solver.step_s=0.001`), from `flexcrank run thesis-crank-slider --pace max --until 4 --set solver.step_s=H`:
//!
//! | H, s | angle, rad | error |
//! |---|---|---|
//! | 0.1 | 2.127585 | −0.0787 |
//! | 0.05 | 2.165694 | −0.0406 |
//! | 0.025 | 2.185762 | −0.0205 |
//! | 0.0125 | 2.195965 | −0.0103 |
//!
//! - It is **first order**, whatever the weight ϑ: the configuration is updated after the step, and the gyroscopic terms are
//!   left out.
//! - Its **limit is wrong**. At t = 2 s (true: 1.176031664 rad, `--until 2`) steps of 1e-3, 5e-4, 2e-4, 1e-4 and 5e-5 s are off by
//!   −1.8e-4, −1.9e-4, −3.6e-4, −6.9e-4 and −1.37e-3 rad: the error grows like 1/h. Every step throws the axial strain away,
//!   so in place of a spring `EA/L` stands a damper `EA ϑ h/L`, and as `h` shrinks the links run apart.
//! - **Bending is counted again**: the rotations that a step keeps are added to the configuration once more in the next, so the
//!   nodal rotation `w₁` ends the thesis's run more than 1 rad from the chord. Positions do not feel it.
//! - **Without the modulo 2π it breaks at half a turn**, where `atan2` jumps and the jump is carried on as a rotation: the
//!   thesis's figures after t = 5.6 s are those of a broken mechanism.
//!
//! `cargo test --test thesis limits` asserts the figures.
//!
//! # Degrees of freedom
//!
//! They are `w₁, u₂, v₂, w₁₂, w₂₁, u₃, w₃, v₃` — the tangent at the pivot, the crank pin, the tangents of crank
//! and rod there, the chain's end, the rod's tangent there. A slider holds `v₃`; a single link has the first four.
//!
//! A torsion spring at the base acts as the thesis's listing has it, lagged: the moment `−k w₁` of the configuration where the
//! step begins. (The listing also puts `k` into its first step's matrix, twice, carries the beam's rotation over as
//! `w − Δv₂/(L + Δu₂)`, and hangs the tip mass on `v₂` alone: left out here, that moves its figures by less than 1e-9.)

use std::f64::consts::TAU;

use nalgebra::{SMatrix, SVector};

use super::beam::{self, Matrix6, Vector6};
use super::crank_slider::{along, crank_turn, rod_turn};
use super::mechanism::{Input, Singular};
use super::observation::{ElementForces, Energy, NodeObservation, Observation};
use super::resistance::resistance_n;
use crate::scene::{Bar, Chain, End, Link};

const N: usize = 8;
type Matrix = SMatrix<f64, N, N>;
type Vector = SVector<f64, N>;

const ROOT: usize = 0;

/// Where an element's six local degrees of freedom stand among the chain's; `None` is held at zero.
type Placement = [Option<usize>; 6];
const CRANK: Placement = [None, None, Some(ROOT), Some(1), Some(2), Some(3)];
const ROD: Placement = [Some(1), Some(2), Some(4), Some(5), Some(7), Some(6)];

/// State that the method carries from one step to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct IncrementalState {
    /// The configuration X: rotations and positions in the order of the degrees of freedom.
    pub configuration: [f64; N],
    /// Displacements carried into the next step.
    pub carried: [f64; N],
    /// Velocities.
    pub velocity: [f64; N],
    /// Chord angles of the links, unwrapped, rad.
    pub chord_rad: [f64; 2],
    /// Displacement and acceleration of the last step at its point of collocation, for the forces that it published.
    pub collocated: [[f64; N]; 2],
}

impl IncrementalState {
    /// All of it, in the order of the fields.
    pub fn numbers(&self) -> [f64; 5 * N + 2] {
        let mut all = [0.0; 5 * N + 2];
        let [displacement, acceleration] = &self.collocated;
        let parts = [&self.configuration, &self.carried, &self.velocity, displacement, acceleration];
        for (k, part) in parts.into_iter().enumerate() {
            all[k * N..(k + 1) * N].copy_from_slice(part);
        }
        all[5 * N..].copy_from_slice(&self.chord_rad);
        all
    }

    /// The state of these numbers, as [`IncrementalState::numbers`] returned them.
    pub fn from_numbers(all: &[f64; 5 * N + 2]) -> Self {
        let part = |k: usize| std::array::from_fn(|i| all[k * N + i]);
        IncrementalState {
            configuration: part(0),
            carried: part(1),
            velocity: part(2),
            chord_rad: [all[5 * N], all[5 * N + 1]],
            collocated: [part(3), part(4)],
        }
    }
}

struct Element {
    mass: Matrix6,
    stiffness: Matrix6,
    placement: Placement,
}

/// The incremental chain.
pub struct Incremental {
    elements: Vec<Element>,
    /// Degrees of freedom that are no part of this chain, or held.
    held: Vec<usize>,
    chain: Chain,
    weight: f64,
    start: IncrementalState,
}

impl Incremental {
    /// For flexible links; `None` when one has no section. `weight` is the two-point method's ϑ.
    pub fn new(chain: &Chain, weight: f64) -> Option<Self> {
        let element = |(link, placement): (&Link, Placement)| Some(element(link, &link.bar?, placement));
        let elements = chain.links.iter().zip([CRANK, ROD]).map(element).collect::<Option<Vec<_>>>()?;
        let mut incremental = Incremental { elements, held: Vec::new(), chain: chain.clone(), weight, start: start(chain) };
        incremental.held = (0..N).filter(|i| !incremental.moves(*i)).collect();
        Some(incremental)
    }

    /// The state at t = 0.
    pub fn start(&self) -> IncrementalState {
        self.start.clone()
    }

    /// Where the chain's end moves along x and y.
    fn end(&self) -> [usize; 2] {
        if self.elements.len() == 1 { [1, 2] } else { [5, 7] }
    }

    /// Whether a degree of freedom is part of this chain and free to move.
    fn moves(&self, i: usize) -> bool {
        let slides = matches!(self.chain.end, End::Slider(_));
        self.elements.iter().any(|element| element.placement.contains(&Some(i))) && !(slides && i == self.end()[1])
    }

    /// Mass and stiffness in the present configuration; what does not move gets a unit mass and no force.
    fn assemble(&self, state: &IncrementalState) -> (Matrix, Matrix) {
        let (mut mass, mut stiffness) = (Matrix::zeros(), Matrix::zeros());
        for (element, chord) in self.elements.iter().zip(state.chord_rad) {
            place(&element.placement, &beam::to_global(&element.mass, chord), &mut mass);
            place(&element.placement, &beam::to_global(&element.stiffness, chord), &mut stiffness);
        }
        for i in self.end() {
            mass[(i, i)] += self.end_mass_kg();
        }
        for &i in &self.held {
            for matrix in [&mut mass, &mut stiffness] {
                matrix.row_mut(i).fill(0.0);
                matrix.column_mut(i).fill(0.0);
            }
            mass[(i, i)] = 1.0;
        }
        (mass, stiffness)
    }

    fn end_mass_kg(&self) -> f64 {
        match &self.chain.end {
            End::Free { tip_mass_kg } => *tip_mass_kg,
            End::Slider(slider) => slider.mass_kg,
        }
    }

    /// Force along −x at the chain's end: resistance and viscous friction, N.
    fn end_force_n(&self, state: &IncrementalState) -> [f64; 2] {
        match &self.chain.end {
            End::Free { .. } => [0.0; 2],
            End::Slider(slider) => {
                let speed = state.velocity[self.end()[0]];
                [resistance_n(&slider.resistance, state.chord_rad[0]), slider.friction_n_s_per_m * speed]
            }
        }
    }

    /// Loads of the configuration where the step begins.
    fn load(&self, input: &Input, mass: &Matrix, state: &IncrementalState) -> Vector {
        let gravity = self.chain.gravity_m_per_s2;
        let falling = Vector::from([0.0, gravity[0], gravity[1], 0.0, 0.0, gravity[0], 0.0, gravity[1]]);
        let mut load = mass * falling;
        let base = &self.chain.base;
        load[ROOT] += input.torque_nm
            - base.torsion_spring_nm_per_rad * state.configuration[ROOT]
            - base.damper_nm_s_per_rad * state.velocity[ROOT];
        load[self.end()[0]] -= self.end_force_n(state).iter().sum::<f64>();
        for &i in &self.held {
            load[i] = 0.0;
        }
        load
    }

    /// One step of `h_s` under the torque that `input` holds constant. On error the state is unchanged.
    ///
    /// # Errors
    /// [`Singular`] when the step's matrix cannot be factored.
    pub fn step(&self, input: &Input, h_s: f64, state: &mut IncrementalState) -> Result<(), Singular> {
        let (mass, stiffness) = self.assemble(state);
        let (theta, rest) = (self.weight, 1.0 - self.weight);
        let (d0, v0) = (Vector::from(state.carried), Vector::from(state.velocity));
        let load = self.load(input, &mass, state);
        let right = mass * v0 + h_s * (load - stiffness * (d0 + (h_s * theta * rest) * v0));
        let v1 = (mass + (h_s * theta).powi(2) * stiffness).lu().solve(&right).ok_or(Singular)?;
        let d1 = d0 + h_s * (theta * v1 + rest * v0);
        state.collocated = [(theta * d1 + rest * d0).into(), ((v1 - v0) / h_s).into()];
        self.advance(&d1, state);
        state.velocity = v1.into();
        Ok(())
    }

    /// `X ← X + d`; the chord angles follow, and the rotations relative to them are carried on.
    fn advance(&self, d: &Vector, state: &mut IncrementalState) {
        for (x, d) in state.configuration.iter_mut().zip(d.iter()) {
            *x += d;
        }
        state.carried = [0.0; N];
        for (k, element) in self.elements.iter().enumerate() {
            let [from, to] = ends(&element.placement, &state.configuration);
            let change = (to[1] - from[1]).atan2(to[0] - from[0]) - state.chord_rad[k];
            let turned = change - TAU * (change / TAU).round();
            state.chord_rad[k] += turned;
            for i in [element.placement[2], element.placement[5]].into_iter().flatten() {
                state.carried[i] = d[i] - turned;
            }
        }
    }

    /// `[work put in by torque and resistance, work dissipated]` in the step that led to `after`, J.
    pub fn work_j(&self, input: &Input, h_s: f64, before: &IncrementalState, after: &IncrementalState) -> [f64; 2] {
        let (theta, rest) = (self.weight, 1.0 - self.weight);
        self.work_over_j(input, before, |i| h_s * (theta * after.velocity[i] + rest * before.velocity[i]))
    }

    /// The same if the travel were that of the mean of the rates before and after, J.
    pub fn work_by_mean_rates_j(&self, input: &Input, h_s: f64, before: &IncrementalState, after: &IncrementalState) -> [f64; 2] {
        self.work_over_j(input, before, |i| 0.5 * h_s * (after.velocity[i] + before.velocity[i]))
    }

    fn work_over_j(&self, input: &Input, before: &IncrementalState, travel: impl Fn(usize) -> f64) -> [f64; 2] {
        let [resistance, friction] = self.end_force_n(before);
        let damper = self.chain.base.damper_nm_s_per_rad * before.velocity[ROOT];
        let (turned, moved) = (travel(ROOT), travel(self.end()[0]));
        [input.torque_nm * turned - resistance * moved, damper * turned + friction * moved]
    }

    /// Fills `out`. Forces are those of the last step, at its point of collocation.
    pub fn observe(&self, state: &IncrementalState, out: &mut Observation) {
        for (k, (element, seen)) in self.elements.iter().zip(&mut out.links).enumerate() {
            let [from, to] = ends(&element.placement, &state.configuration);
            let [from_rate, to_rate] = ends(&element.placement, &state.velocity);
            let turn = |place: usize| element.placement[place].map(|i| state.configuration[i]);
            let node = |position_m, velocity_m_per_s, rotation_rad| NodeObservation {
                position_m,
                velocity_m_per_s,
                rotation_rad,
                deflection_m: Some(0.0),
            };
            seen.nodes.copy_from_slice(&[node(from, from_rate, turn(2)), node(to, to_rate, turn(5))]);
            seen.chord_rad = state.chord_rad[k];
            let along = [to[0] - from[0], to[1] - from[1]];
            let across = [to_rate[0] - from_rate[0], to_rate[1] - from_rate[1]];
            seen.rate_rad_per_s = (along[0] * across[1] - along[1] * across[0]) / (along[0].powi(2) + along[1].powi(2));
            seen.acceleration_rad_per_s2 = None;
        }
        self.forces(state, out);
        out.energy = self.energy(state);
    }

    /// Joint forces and internal forces from `f = M v̇ + K d` of each element, its weight deducted.
    fn forces(&self, state: &IncrementalState, out: &mut Observation) {
        let [displacement, acceleration] = &state.collocated;
        let mut first = [None; 2];
        let mut last = [0.0; 2];
        for (k, element) in self.elements.iter().enumerate() {
            let t = beam::rotation(state.chord_rad[k]);
            let gather = |all: &[f64; N]| Vector6::from_iterator(element.placement.iter().map(|i| i.map_or(0.0, |i| all[i])));
            let [gx, gy] = self.chain.gravity_m_per_s2;
            let moving = gather(acceleration) - Vector6::from([gx, gy, 0.0, gx, gy, 0.0]);
            let elastic = element.stiffness * (t * gather(displacement));
            let total = t.transpose() * (element.mass * (t * moving) + elastic);
            first[k] = Some([total[0], total[1]]);
            last = [-total[3], -total[4]];
            if let Some(seen) = out.links[k].elements.first_mut() {
                *seen = ElementForces {
                    axial_n: elastic[3],
                    shear_n: -elastic[1],
                    moment_start_nm: -elastic[2],
                    moment_end_nm: elastic[5],
                };
            }
        }
        [out.pivot_n, out.crank_pin_n] = first;
        if let End::Slider(slider) = &self.chain.end {
            out.slider_pin_n = Some(last);
            out.guide_n = Some(-last[1] - slider.mass_kg * self.chain.gravity_m_per_s2[1]);
            out.resistance_n = Some(self.end_force_n(state)[0]);
        }
    }

    /// Kinetic energy and the base spring's. The links' own strain energy is not known: the method drops their stretch at every
    /// step and counts their bending again.
    pub fn energy(&self, state: &IncrementalState) -> Energy {
        let (mass, _) = self.assemble(state);
        let v = Vector::from(state.velocity);
        let spring = self.chain.base.torsion_spring_nm_per_rad;
        Energy {
            kinetic_j: 0.5 * v.dot(&(mass * v)),
            strain_j: (spring != 0.0).then(|| 0.5 * spring * state.configuration[ROOT].powi(2)),
            potential_j: self.potential_j(state),
        }
    }

    /// Weight of each link as if straight, half its mass at either end, and of the end's mass; `None` without gravity.
    fn potential_j(&self, state: &IncrementalState) -> Option<f64> {
        let gravity = self.chain.gravity_m_per_s2;
        if gravity == [0.0; 2] {
            return None;
        }
        let fallen = |at: [f64; 2]| gravity[0] * at[0] + gravity[1] * at[1];
        let mut sum = 0.0;
        for (element, link) in self.elements.iter().zip(&self.chain.links) {
            let [from, to] = ends(&element.placement, &state.configuration);
            sum += 0.5 * link.mass_kg * (fallen(from) + fallen(to));
        }
        let end = self.end().map(|i| state.configuration[i]);
        Some(-sum - self.end_mass_kg() * fallen(end))
    }
}

fn element(link: &Link, bar: &Bar, placement: Placement) -> Element {
    Element {
        mass: beam::mass(link.mass_kg, link.length_m),
        stiffness: beam::stiffness(bar.axial_stiffness_n(), bar.bending_stiffness_nm2(), link.length_m),
        placement,
    }
}

fn place(placement: &Placement, element: &Matrix6, chain: &mut Matrix) {
    for (row, i) in placement.iter().enumerate() {
        for (column, j) in placement.iter().enumerate() {
            if let (Some(i), Some(j)) = (i, j) {
                chain[(*i, *j)] += element[(row, column)];
            }
        }
    }
}

/// Values of `all` at an element's two ends, along x and y.
fn ends(placement: &Placement, all: &[f64; N]) -> [[f64; 2]; 2] {
    let of = |place: usize| placement[place].map_or(0.0, |i| all[i]);
    [[of(0), of(1)], [of(3), of(4)]]
}

/// Undeformed links at the start angle, turning as rigid bodies; the second of an open chain is in line with the first.
fn start(chain: &Chain) -> IncrementalState {
    let (theta, rate) = (chain.start.angle_rad, chain.start.rate_rad_per_s);
    let lengths: Vec<f64> = chain.links.iter().map(|link| link.length_m).collect();
    let crank = crank_turn(theta);
    let rod = match (&chain.end, lengths.as_slice()) {
        (End::Slider(_), [l1, l2]) => rod_turn(&crank, l1 / l2),
        _ => crank,
    };
    let pin = along(&[[0.0; 2]; 2], &crank, lengths[0]);
    let end = along(&pin, &rod, lengths.get(1).copied().unwrap_or(0.0));
    let chord_rad = match chain.end {
        End::Slider(_) => [theta, rod.sin.asin()],
        End::Free { .. } => [theta; 2],
    };
    let values = |[crank, rod]: [f64; 2], k: usize| [crank, pin[k][0], pin[k][1], crank, rod, end[k][0], rod, end[k][1]];
    IncrementalState {
        configuration: values(chord_rad, 0),
        carried: [0.0; N],
        velocity: values([crank.slopes[0], rod.slopes[0]], 1).map(|slope| slope * rate),
        chord_rad,
        collocated: [[0.0; N]; 2],
    }
}
