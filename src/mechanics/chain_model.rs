//! The models of a chain of links seen as one moving line, whatever their coordinates: places, shapes, loads and momenta.
//!
//! [`Transfer`](super::Transfer) takes the state of one model to another through these.

use super::mechanism::{Input, Mechanism};

/// A place on the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Its link, counted from the pivot.
    pub link: usize,
    /// Distance from the link's first pin along the undeformed link, over the link's length.
    pub xi: f64,
}

/// Position, direction and velocity of the chain at a place, in global axes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PlacePoint {
    /// Position, m.
    pub position_m: [f64; 2],
    /// `dr/ds` by the undeformed length s.
    pub slope: [f64; 2],
    /// Velocity, m/s.
    pub velocity_m_per_s: [f64; 2],
}

/// A place of a link in the frame of its chord: the first pin is the origin, the chord is the x axis.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ShapePoint {
    /// Distance from the first pin along the undeformed link, over its length.
    pub xi: f64,
    /// Part of the link's length that stands for this place in a quadrature; 0 where there is none.
    pub weight: f64,
    /// Position, m.
    pub position_m: [f64; 2],
    /// `dr/ds`.
    pub slope: [f64; 2],
}

/// The shape of one link.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinkShape {
    /// Angle of the chord, whole turns counted, rad.
    pub chord_rad: f64,
    /// Length of the chord, m.
    pub chord_m: f64,
    /// Mean strain of the axis.
    pub stretch: f64,
    /// Points of a quadrature over the length; none for a link without a section.
    pub samples: Vec<ShapePoint>,
    /// Points at equal intervals, one for each of the fitted link's elements, both pins included.
    pub nodes: Vec<ShapePoint>,
}

/// A model of the chain as a line in motion. Implementations do not allocate.
pub trait ChainModel: Mechanism {
    /// Position, direction and velocity at each place.
    fn points(&mut self, input: &Input, q: &[f64], v: &[f64], places: &[Place], out: &mut [PlacePoint]);
    /// Angle of each link's chord, whole turns counted, rad.
    fn chord_angles(&mut self, input: &Input, q: &[f64], out: &mut [f64]);
    /// `p_j = Σ_k f_k · ∂x_k/∂q_j` for vectors `f_k` at the places `x_k`.
    fn pull_back(&mut self, input: &Input, q: &[f64], places: &[Place], vectors: &[[f64; 2]], p: &mut [f64]);
    /// Sets the coordinates so that the links have these shapes, as nearly as the coordinates can. Chord angles that have a
    /// coordinate are kept; a slider's rod closes on y = 0; a prescribed tangent stands as prescribed.
    fn fit(&mut self, input: &Input, shapes: &[LinkShape], q: &mut [f64]);
    /// `p_j = ∂T/∂q̇_j` of the kinetic energy T, prescribed motion included.
    fn momentum(&mut self, input: &Input, q: &[f64], v: &[f64], p: &mut [f64]);
    /// Velocities as if every link kept its shape, this link's chord turned by 1 rad/s and no other one turned, but for a
    /// slider's rod; prescribed motion stands still. `false` if the link cannot turn by itself.
    fn turn(&mut self, input: &Input, q: &[f64], link: usize, v: &mut [f64]) -> bool;
}
