//! Observation of a model's present state. A quantity that a model does not have is `None` or an empty list, never zero.

/// Everything observable of the chain at one instant. Preallocated by the model and refilled in place.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Observation {
    /// One entry a link, from the pivot outwards.
    pub links: Vec<LinkObservation>,
    /// Force on the first link at the pivot (x, y), N.
    pub pivot_n: Option<[f64; 2]>,
    /// Force on the rod at the crank pin (x, y), N.
    pub crank_pin_n: Option<[f64; 2]>,
    /// Force on the slider at the slider pin (x, y), N.
    pub slider_pin_n: Option<[f64; 2]>,
    /// Force of the guide on the slider in y, N.
    pub guide_n: Option<f64>,
    /// Resistance on the slider, positive along −x, N; `None` without a slider.
    pub resistance_n: Option<f64>,
    /// Torque that a prescribed motion needs at the pivot, N·m; `None` when torque is the input.
    pub motion_torque_nm: Option<f64>,
    /// Energies, J.
    pub energy: Energy,
    /// Largest slope of a link from its chord, rad, where the model's assumption on it is broken.
    pub out_of_range: Option<f64>,
}

impl Observation {
    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        let Observation { links, pivot_n, crank_pin_n, slider_pin_n, guide_n, resistance_n, motion_torque_nm, .. } = self;
        let Energy { kinetic_j, strain_j, potential_j } = self.energy;
        let forces = [pivot_n, crank_pin_n, slider_pin_n].into_iter().flatten().flatten();
        let singles = [guide_n, resistance_n, motion_torque_nm, &strain_j, &potential_j, &self.out_of_range];
        links.iter().all(LinkObservation::is_finite)
            && kinetic_j.is_finite()
            && forces.chain(singles.into_iter().flatten()).all(|number| number.is_finite())
    }
}

impl LinkObservation {
    fn is_finite(&self) -> bool {
        let node = |node: &NodeObservation| {
            let NodeObservation { position_m: [x, y], velocity_m_per_s: [u, v], rotation_rad, deflection_m } = *node;
            [x, y, u, v, rotation_rad.unwrap_or(0.0), deflection_m.unwrap_or(0.0)].iter().all(|number| number.is_finite())
        };
        let element = |element: &ElementForces| {
            let ElementForces { axial_n, shear_n, moment_start_nm, moment_end_nm } = *element;
            [axial_n, shear_n, moment_start_nm, moment_end_nm].iter().all(|number| number.is_finite())
        };
        let angles = [self.chord_rad, self.rate_rad_per_s, self.acceleration_rad_per_s2.unwrap_or(0.0)];
        angles.iter().chain(&self.exact_x_m).all(|number| number.is_finite())
            && self.nodes.iter().all(node)
            && self.elements.iter().all(element)
    }
}

/// Energies of the chain, J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// Kinetic energy, slider and tip mass included.
    pub kinetic_j: f64,
    /// Strain energy of the links and of the base spring; `None` for a model without any.
    pub strain_j: Option<f64>,
    /// Potential energy in gravity, zero at the height of the pivot.
    pub potential_j: Option<f64>,
}

impl Energy {
    /// Their sum, J.
    pub fn total_j(&self) -> f64 {
        self.moving_j() + self.potential_j.unwrap_or(0.0)
    }

    /// Kinetic and strain energy, J, which do not depend on a height of reference.
    pub fn moving_j(&self) -> f64 {
        self.kinetic_j + self.strain_j.unwrap_or(0.0)
    }
}

/// One link's nodes, angles and internal forces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinkObservation {
    /// Nodes along the link, first pin to last, `elements + 1` of them.
    pub nodes: Vec<NodeObservation>,
    /// Chord angle, unwrapped, rad counter-clockwise from x.
    pub chord_rad: f64,
    /// Its rate, rad/s.
    pub rate_rad_per_s: f64,
    /// Its acceleration, rad/s².
    pub acceleration_rad_per_s2: Option<f64>,
    /// Internal forces, one entry an element; empty where the model does not know them.
    pub elements: Vec<ElementForces>,
    /// Exact x of the nodes, m; empty where it is not known, and NaN after a change of the running scene.
    pub exact_x_m: Vec<f64>,
}

/// One node.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NodeObservation {
    /// Position, m.
    pub position_m: [f64; 2],
    /// Velocity, m/s.
    pub velocity_m_per_s: [f64; 2],
    /// Rotation of the tangent from the x axis, unwrapped, rad.
    pub rotation_rad: Option<f64>,
    /// Offset from the link's chord, positive to the left of its direction, m.
    pub deflection_m: Option<f64>,
}

/// Internal forces of one element, at its ends.
///
/// Axial force positive in tension. Shear `V` and moment `M` by the beam convention `M = E J κ` (κ = dθ/ds) and `V = −dM/ds`;
/// axial and shear stand for the whole element, in the directions of its own chord: with modes and of rigid links, the
/// means of those at its two ends; with finite elements, the force of its mean strain, and the slope of its moment.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ElementForces {
    /// Axial force, N.
    pub axial_n: f64,
    /// Shear force, N.
    pub shear_n: f64,
    /// Bending moment at the element's first node, N·m.
    pub moment_start_nm: f64,
    /// Bending moment at its second node, N·m.
    pub moment_end_nm: f64,
}
