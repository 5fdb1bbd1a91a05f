//! A chain of links as one line, whatever the coordinates of its model: places, and shapes of links.
//!
//! [`Transfer`](super::Transfer) takes the state of one model to another through these.

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
