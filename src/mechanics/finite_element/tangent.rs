//! `w.acceleration ∂r/∂a + w.velocity ∂r/∂v + w.position ∂r/∂q`, assembled, factored and solved.

use nalgebra::{Matrix2, Vector2};

use super::FiniteElement;
use super::beam::{Beam, Blocks};
use super::layout::{Layout, PIVOT, ROOT};
use super::loads::EndLoad;
use super::member::{Member, windows};
use super::motion::{Motion, Window};
use super::polar::{Column, Polar};
use super::rigid::Masses;
use super::strain::StiffnessWeights;
use crate::mechanics::mechanism::{Singular, Weights};

/// A resistance that follows the crank's angle acts at the chain's end and depends on the pin, outside the band:
/// `A = B + e gᵀ`, solved by Sherman and Morrison's formula `x = y − z (gᵀy)/(1 + gᵀz)` with `B y = b`, `B z = e`.
#[derive(Debug, Clone)]
pub(super) struct Coupling {
    /// `B⁻¹ e`.
    response: Vec<Vector2<f64>>,
    /// `g`, in the pin's slot alone.
    gradient: Vector2<f64>,
    inverse: f64,
    pin: usize,
    end: usize,
}

impl Coupling {
    /// If the chain needs it.
    pub(super) fn new(load: &EndLoad, layout: &Layout) -> Option<Self> {
        let (Some(pin), Some(end), true) = (layout.pin, layout.end, load.tabulated()) else { return None };
        let response = vec![Vector2::zeros(); layout.slots() + 3];
        Some(Self { response, gradient: Vector2::zeros(), inverse: 1.0, pin, end })
    }
}

/// Turns the blocks of an element, in Cartesian coordinates, to the coordinates of its polar slots. Their change with the coordinates at
/// constant forces is added once for each slot: see [`FiniteElement::add_point_terms`].
struct PolarChange<'a, const N: usize> {
    polars: [Option<&'a Polar>; N],
    mass: &'a [[f64; N]; N],
    /// Derivative by rates, when there is damping.
    damping: Option<&'a [[Matrix2<f64>; N]; N]>,
}

impl<const N: usize> PolarChange<'_, N> {
    fn apply(&self, blocks: &mut [[Matrix2<f64>; N]; N], w: Weights) {
        for (k, polar) in self.polars.iter().enumerate() {
            let Some(column) = polar.map(|polar| polar.column(w)) else { continue };
            for (row, blocks) in blocks.iter_mut().enumerate() {
                blocks[k] = blocks[k] * column.direction + column.acceleration * self.mass[row][k];
                if let Some(damping) = self.damping {
                    blocks[k] += damping[row][k] * column.velocity;
                }
            }
        }
        for (k, polar) in self.polars.iter().enumerate() {
            let Some(polar) = polar else { continue };
            let rows = polar.column(w).direction.transpose();
            for block in &mut blocks[k] {
                *block = rows * *block;
            }
        }
    }
}

impl FiniteElement {
    /// Fills the band for the motion as loaded.
    pub(super) fn assemble(&mut self, w: Weights) {
        self.band.clear();
        for i in 0..self.members.len() {
            match &self.members[i] {
                Member::Flexible { beam, first, elements, swapped } => {
                    for window in windows(*first, *elements, *swapped) {
                        let mut blocks = self.element_blocks(beam, window, w);
                        if window.first == *first {
                            self.add_hub(beam, window, stiffness(w), &mut blocks);
                            self.to_polar(beam, window, w, &mut blocks);
                        }
                        self.band.add_element(window, &blocks);
                    }
                }
                Member::Rigid { first, masses } => {
                    let blocks = self.rigid(*first, masses, w);
                    for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        self.band.add(first + row, first + column, blocks[row][column]);
                    }
                }
                Member::Guided { first, .. } => {
                    let block = self.guided(*first, w);
                    self.band.add(*first, *first, block);
                }
            }
        }
        self.add_point_terms(w);
        for &place in self.layout.held.iter().filter(|place| **place / 2 != PIVOT) {
            self.band.hold(place / 2, place % 2);
        }
    }

    #[inline]
    fn element_blocks(&self, beam: &Beam, window: Window, w: Weights) -> Blocks {
        let (x, dx) = (window.gather(&self.motion.p), window.gather(&self.motion.v));
        let mut blocks = beam.tangent(&x, &dx, stiffness(w));
        for (row, masses) in blocks.iter_mut().zip(&beam.mass) {
            for (block, mass) in row.iter_mut().zip(masses) {
                block.m11 += w.acceleration * mass;
                block.m22 += w.acceleration * mass;
            }
        }
        blocks
    }

    /// Adds the term of the hub, if this is the first element of the first link.
    fn add_hub(&self, beam: &Beam, window: Window, weights: StiffnessWeights, blocks: &mut Blocks) {
        if window.at_hub() {
            beam.add_hub_tangent(&window.gather(&self.motion.p), &window.gather(&self.motion.v), weights, blocks);
        }
    }

    /// The first element of a link, whose first two slots may be polar.
    fn to_polar(&self, beam: &Beam, window: Window, w: Weights, blocks: &mut Blocks) {
        let motion = &self.motion;
        let rates = StiffnessWeights { velocity: 1.0, position: 0.0 };
        let damping = beam.damped().then(|| {
            let mut damping = beam.tangent(&window.gather(&motion.p), &window.gather(&motion.v), rates);
            self.add_hub(beam, window, rates, &mut damping);
            damping
        });
        let polars = [motion.polar(window.first), motion.polar(window.first + 1), None, None];
        PolarChange { polars, mass: &beam.mass, damping: damping.as_ref() }.apply(blocks, w);
    }

    fn rigid(&self, first: usize, masses: &Masses, w: Weights) -> [[Matrix2<f64>; 2]; 2] {
        let mut blocks = masses.map(|row| row.map(|mass| Matrix2::from_diagonal_element(w.acceleration * mass)));
        let polars = [self.motion.polar(first), self.motion.polar(first + 1)];
        PolarChange { polars, mass: masses, damping: None }.apply(&mut blocks, w);
        blocks
    }

    fn guided(&self, first: usize, w: Weights) -> Matrix2<f64> {
        let Some(Member::Guided { rod, .. }) = self.members.last() else { return Matrix2::zeros() };
        let (pin, load) = self.guided_state(first);
        let Some(polar) = self.motion.polar(first) else {
            return rod.tangent(&pin, &load, &Column::cartesian(), w);
        };
        let column = polar.column(w);
        let by_pin = rod.tangent(&pin, &load, &column, w);
        column.direction.transpose() * by_pin
    }

    /// Entries at the polar slots (`∂(Tᵀ f)/∂u` for all of the force f on one), at the end of a flexible link, and at the base.
    fn add_point_terms(&mut self, w: Weights) {
        for polar in &self.motion.polars {
            self.band.add(polar.slot, polar.slot, polar.polar.geometric(&polar.force) * w.position);
        }
        if let Some(end) = self.layout.end {
            let mass = w.acceleration * self.end.mass_kg;
            let friction = w.velocity * self.end.friction_n_s_per_m;
            self.band.add(end, end, Matrix2::new(mass + friction, 0.0, 0.0, mass));
        }
        let base = &self.chain.base;
        let turning = w.position * base.torsion_spring_nm_per_rad + w.velocity * base.damper_nm_s_per_rad;
        self.band.add(ROOT, ROOT, Matrix2::new(0.0, 0.0, 0.0, turning));
    }

    /// Prepares [`Coupling`].
    pub(super) fn couple(&mut self, w: Weights) -> Result<(), Singular> {
        let Some(coupling) = &mut self.coupling else { return Ok(()) };
        coupling.gradient = gradient(coupling.pin, &self.end, &self.motion, &self.layout) * w.position;
        coupling.response.fill(Vector2::zeros());
        coupling.response[coupling.end].x = 1.0;
        self.band.solve(&mut coupling.response);
        let denominator = 1.0 + coupling.gradient.dot(&coupling.response[coupling.pin]);
        coupling.inverse = 1.0 / denominator;
        if denominator.is_normal() { Ok(()) } else { Err(Singular) }
    }

    /// Hands over the entries as assembled.
    pub(super) fn entries(&self, w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        let mut block = |row: usize, column: usize, block: &Matrix2<f64>| {
            for place in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let unknowns = self.layout.unknown(2 * row + place.0).zip(self.layout.unknown(2 * column + place.1));
                if let Some((i, j)) = unknowns {
                    entry(i, j, block[place]);
                }
            }
        };
        self.band.for_each(&mut block);
        if let Some(coupling) = &self.coupling {
            let gradient = gradient(coupling.pin, &self.end, &self.motion, &self.layout) * w.position;
            block(coupling.end, coupling.pin, &Matrix2::new(gradient.x, gradient.y, 0.0, 0.0));
        }
    }

    /// Solves for the unknowns in place.
    pub(super) fn solve_unknown(&mut self, x: &mut [f64]) {
        self.unknown.fill(Vector2::zeros());
        for (value, &place) in x.iter().zip(&self.layout.active) {
            self.unknown[place / 2][place % 2] = *value;
        }
        self.band.solve(&mut self.unknown);
        if let Some(coupling) = &self.coupling {
            let factor = coupling.gradient.dot(&self.unknown[coupling.pin]) * coupling.inverse;
            for (value, response) in self.unknown.iter_mut().zip(&coupling.response) {
                *value -= response * factor;
            }
        }
        for (value, &place) in x.iter_mut().zip(&self.layout.active) {
            *value = self.unknown[place / 2][place % 2];
        }
    }
}

fn stiffness(w: Weights) -> StiffnessWeights {
    StiffnessWeights { velocity: w.velocity, position: w.position }
}

/// Derivative of the resistance by the coordinates of the crank's pin; nil in those that are held.
fn gradient(pin: usize, end: &EndLoad, motion: &Motion, layout: &Layout) -> Vector2<f64> {
    let slope = end.resistance(&motion.p[pin]).1;
    let mut gradient = motion.polar(pin).map_or(slope, |polar| polar.force(&slope));
    for place in layout.held.iter().filter(|place| **place / 2 == pin) {
        gradient[place % 2] = 0.0;
    }
    gradient
}
