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
//! Degrees of freedom of the crank-slider: `w₁, u₂, v₂, w₁₂, w₂₁, u₃, w₃` — the tangent at the pivot, the crank pin, the
//! tangents of crank and rod there, the slider, the rod's tangent there.

use std::f64::consts::TAU;

use nalgebra::{SMatrix, SVector};

use super::beam::{self, Matrix6, Vector6};
use super::mechanism::{Input, Singular};
use super::observation::{ElementForces, Energy, NodeObservation, Observation};
use super::resistance::resistance_n;
use crate::scene::{Bar, Chain, Link, Slider};

const N: usize = 7;
type Matrix = SMatrix<f64, N, N>;
type Vector = SVector<f64, N>;

const CRANK_PIN_X: usize = 1;
const CRANK_PIN_Y: usize = 2;
const SLIDER_X: usize = 5;

/// Where an element's six local degrees of freedom stand among the chain's; `None` is held at zero.
type Placement = [Option<usize>; 6];
const CRANK: Placement = [None, None, Some(0), Some(1), Some(2), Some(3)];
const ROD: Placement = [Some(1), Some(2), Some(4), Some(5), None, Some(6)];

/// What the method carries from one step to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct IncrementalState {
    /// The configuration X: rotations and positions in the order of the degrees of freedom.
    pub configuration: [f64; N],
    /// Displacements carried into the next step.
    pub carried: [f64; N],
    /// Velocities.
    pub velocity: [f64; N],
    /// Chord angles of crank and rod, unwrapped, rad.
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

    /// What [`IncrementalState::numbers`] gave.
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

/// The incremental crank-slider.
pub struct Incremental {
    elements: [Element; 2],
    slider: Slider,
    weight: f64,
    start: IncrementalState,
}

impl Incremental {
    /// For a crank-slider of two flexible links; `None` for any other chain. `weight` is the two-point method's ϑ.
    pub fn new(chain: &Chain, weight: f64) -> Option<Self> {
        let ([crank, rod], crate::scene::End::Slider(slider)) = (chain.links.as_slice(), &chain.end) else { return None };
        let elements = [element(crank, &crank.bar?, CRANK), element(rod, &rod.bar?, ROD)];
        Some(Incremental { elements, slider: slider.clone(), weight, start: start(chain, crank, rod) })
    }

    /// The state at t = 0.
    pub fn start(&self) -> IncrementalState {
        self.start.clone()
    }

    fn assemble(&self, state: &IncrementalState) -> (Matrix, Matrix) {
        let (mut mass, mut stiffness) = (Matrix::zeros(), Matrix::zeros());
        for (element, chord) in self.elements.iter().zip(state.chord_rad) {
            let t = beam::rotation(chord);
            place(&element.placement, &(t.transpose() * element.mass * t), &mut mass);
            place(&element.placement, &(t.transpose() * element.stiffness * t), &mut stiffness);
        }
        mass[(SLIDER_X, SLIDER_X)] += self.slider.mass_kg;
        (mass, stiffness)
    }

    /// One step of `h_s` under the torque that `input` holds constant. On error the state is unchanged.
    ///
    /// # Errors
    /// [`Singular`] when the step's matrix cannot be factored.
    pub fn step(&self, input: &Input, h_s: f64, state: &mut IncrementalState) -> Result<(), Singular> {
        let (mass, stiffness) = self.assemble(state);
        let (theta, rest) = (self.weight, 1.0 - self.weight);
        let (d0, v0) = (Vector::from(state.carried), Vector::from(state.velocity));
        let mut load = Vector::zeros();
        load[0] = input.torque_nm;
        load[SLIDER_X] = -resistance_n(&self.slider.resistance, state.chord_rad[0]);
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
        let x = &state.configuration;
        let wrapped = [x[CRANK_PIN_Y].atan2(x[CRANK_PIN_X]), (-x[CRANK_PIN_Y]).atan2(x[SLIDER_X] - x[CRANK_PIN_X])];
        let turned = [0, 1].map(|k| {
            let change: f64 = wrapped[k] - state.chord_rad[k];
            change - TAU * (change / TAU).round()
        });
        for k in [0, 1] {
            state.chord_rad[k] += turned[k];
        }
        let [crank, rod] = turned;
        state.carried = [d[0] - crank, 0.0, 0.0, d[3] - crank, d[4] - rod, 0.0, d[6] - rod];
    }

    /// `[work put in by torque and resistance, work dissipated]` in the step that led to `after`, J.
    pub fn work_j(&self, input: &Input, h_s: f64, before: &IncrementalState, after: &IncrementalState) -> [f64; 2] {
        let (theta, rest) = (self.weight, 1.0 - self.weight);
        let travel = |i: usize| h_s * (theta * after.velocity[i] + rest * before.velocity[i]);
        let resistance = resistance_n(&self.slider.resistance, before.chord_rad[0]);
        [input.torque_nm * travel(0) - resistance * travel(SLIDER_X), 0.0]
    }

    /// Fills `out`. Forces are those of the last step, at its point of collocation.
    pub fn observe(&self, state: &IncrementalState, out: &mut Observation) {
        let (x, v) = (&state.configuration, &state.velocity);
        let node = |at: [f64; 2], rate: [f64; 2], turn: f64| NodeObservation {
            position_m: at,
            velocity_m_per_s: rate,
            rotation_rad: Some(turn),
            deflection_m: Some(0.0),
        };
        let pin = ([x[CRANK_PIN_X], x[CRANK_PIN_Y]], [v[CRANK_PIN_X], v[CRANK_PIN_Y]]);
        let slider = ([x[SLIDER_X], 0.0], [v[SLIDER_X], 0.0]);
        let nodes = [
            [node([0.0; 2], [0.0; 2], x[0]), node(pin.0, pin.1, x[3])],
            [node(pin.0, pin.1, x[4]), node(slider.0, slider.1, x[6])],
        ];
        for (k, seen) in out.links.iter_mut().enumerate() {
            seen.nodes.copy_from_slice(&nodes[k]);
            seen.chord_rad = state.chord_rad[k];
            let [from, to] = [nodes[k][0], nodes[k][1]];
            let along = [0, 1].map(|i| to.position_m[i] - from.position_m[i]);
            let across = [0, 1].map(|i| to.velocity_m_per_s[i] - from.velocity_m_per_s[i]);
            seen.rate_rad_per_s = (along[0] * across[1] - along[1] * across[0]) / (along[0].powi(2) + along[1].powi(2));
            seen.acceleration_rad_per_s2 = None;
        }
        self.forces(state, out);
        out.resistance_n = Some(resistance_n(&self.slider.resistance, state.chord_rad[0]));
        out.energy = self.energy(state);
    }

    /// Joint forces and internal forces from `f = M v̇ + K d` of each element.
    fn forces(&self, state: &IncrementalState, out: &mut Observation) {
        let [displacement, acceleration] = &state.collocated;
        let mut ends = [Vector6::zeros(); 2];
        for (k, element) in self.elements.iter().enumerate() {
            let t = beam::rotation(state.chord_rad[k]);
            let gather = |all: &[f64; N]| Vector6::from_iterator(element.placement.iter().map(|i| i.map_or(0.0, |i| all[i])));
            let elastic = element.stiffness * (t * gather(displacement));
            ends[k] = t.transpose() * (element.mass * (t * gather(acceleration)) + elastic);
            if let Some(seen) = out.links[k].elements.first_mut() {
                *seen = ElementForces {
                    axial_n: elastic[3],
                    shear_n: -elastic[1],
                    moment_start_nm: -elastic[2],
                    moment_end_nm: elastic[5],
                };
            }
        }
        let [crank, rod] = ends;
        out.pivot_n = Some([crank[0], crank[1]]);
        out.crank_pin_n = Some([rod[0], rod[1]]);
        out.slider_pin_n = Some([-rod[3], -rod[4]]);
        out.guide_n = Some(rod[4]);
    }

    fn energy(&self, state: &IncrementalState) -> Energy {
        let (mass, stiffness) = self.assemble(state);
        let (d, v) = (Vector::from(state.carried), Vector::from(state.velocity));
        Energy { kinetic_j: 0.5 * v.dot(&(mass * v)), strain_j: Some(0.5 * d.dot(&(stiffness * d))), potential_j: None }
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

/// Undeformed links at the start angle, turning as rigid bodies.
fn start(chain: &Chain, crank: &Link, rod: &Link) -> IncrementalState {
    let (theta, rate) = (chain.start.angle_rad, chain.start.rate_rad_per_s);
    let angle = super::crank_slider::rod_turn(theta, crank.length_m / rod.length_m);
    let turn = super::crank_slider::crank_turn(theta);
    let pin = super::crank_slider::along(&[[0.0; 2]; 4], &turn, crank.length_m);
    let slider = super::crank_slider::along(&pin, &angle, rod.length_m);
    let [pin_at, pin_rate, ..] = pin;
    IncrementalState {
        configuration: [theta, pin_at[0], pin_at[1], theta, angle[0], slider[0][0], angle[0]],
        carried: [0.0; N],
        velocity: [rate, pin_rate[0] * rate, pin_rate[1] * rate, rate, angle[1] * rate, slider[1][0] * rate, angle[1] * rate],
        chord_rad: [theta, angle[0]],
        collocated: [[0.0; N]; 2],
    }
}
