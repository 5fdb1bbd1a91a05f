//! Outputs of a linearised mechanism: positions, deflections and forces that an observation shows, and their derivatives.

use nalgebra::{DMatrix, DVector};

use super::point::Point;
use super::subject::Subject;
use crate::mechanics::{Coordinate, LinkObservation, Mechanism, NodeObservation, Observation};
use crate::scene::{Chain, End};

/// Steps in the coordinates, as a part of the change over which the model is far from linear. Of finite elements' forces, rows then
/// err by 3e-13 of their largest entry; by 4e-10 with 1e-2, and more by rounding with 1e-3.
const STEP: f64 = 3e-3;
/// Weights of the central difference of sixth order at 1, 2 and 3 steps to either side.
const WEIGHTS: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];
/// Steps in velocities and accelerations, 1/s and 1/s²: forces are of second degree in the former and affine in the latter, so that
/// long steps are exact, and outweigh the rounding of stiff sections.
const RATE_STEP: f64 = 100.0;
const ACCELERATION_STEP: f64 = 1e6;

/// Derivatives by coordinates, velocities and accelerations, one row an output.
pub(super) struct Rows {
    pub(super) position: DMatrix<f64>,
    pub(super) velocity: DMatrix<f64>,
    pub(super) acceleration: DMatrix<f64>,
}

/// The outputs of a subject, with room for an observation.
pub(super) struct Outputs<'a> {
    pub(super) names: Vec<String>,
    chain: Option<&'a Chain>,
    room: Observation,
}

impl<'a> Outputs<'a> {
    /// Those that the subject has at a point.
    pub(super) fn new(subject: &'a Subject, mechanism: &mut dyn Mechanism, point: &Point) -> Self {
        let chain = subject.chain();
        let room =
            |nodes: usize| LinkObservation { nodes: vec![NodeObservation::default(); nodes], ..LinkObservation::default() };
        let links = match chain {
            Some(chain) => chain.links.iter().map(|link| room(link.elements + 1)).collect(),
            None => vec![LinkObservation { exact_x_m: vec![0.0; point.q.len()], ..room(point.q.len()) }],
        };
        let mut outputs = Outputs { names: Vec::new(), chain, room: Observation { links, ..Observation::default() } };
        outputs.names = outputs.observe(mechanism, point).into_iter().map(|(name, _)| name).collect();
        outputs
    }

    /// Their values at a point.
    pub(super) fn values(&mut self, mechanism: &mut dyn Mechanism, point: &Point) -> DVector<f64> {
        let seen = self.observe(mechanism, point);
        DVector::from_iterator(seen.len(), seen.into_iter().map(|(_, value)| value))
    }

    fn observe(&mut self, mechanism: &mut dyn Mechanism, point: &Point) -> Vec<(String, f64)> {
        mechanism.observe(&point.input, &point.q, &point.v, &point.a, &mut self.room);
        match self.chain {
            Some(chain) => of_chain(chain, &self.room),
            None => of_masses(&self.room),
        }
    }

    /// Their derivatives at a point, by central differences.
    pub(super) fn rows(&mut self, mechanism: &mut dyn Mechanism, point: &Point) -> Rows {
        let coordinates = mechanism.coordinates();
        let mut by = |part: fn(&mut Point) -> &mut Vec<f64>, step: f64, weights: &[f64]| {
            let mut rows = DMatrix::zeros(self.names.len(), coordinates.len());
            for (k, Coordinate { scale, .. }) in coordinates.iter().enumerate() {
                for (place, weight) in (1..).zip(weights) {
                    for step in [step * scale, -step * scale] {
                        let mut moved = point.clone();
                        part(&mut moved)[k] += f64::from(place) * step;
                        let values = self.values(mechanism, &moved);
                        rows.column_mut(k).axpy(weight / step, &values, 1.0);
                    }
                }
            }
            rows
        };
        Rows {
            position: by(|point| &mut point.q, STEP, &WEIGHTS),
            velocity: by(|point| &mut point.v, RATE_STEP, &[0.5]),
            acceleration: by(|point| &mut point.a, ACCELERATION_STEP, &[0.5]),
        }
    }
}

fn of_masses(seen: &Observation) -> Vec<(String, f64)> {
    let nodes = seen.links.iter().flat_map(|link| &link.nodes);
    let both = |(i, node): (usize, &NodeObservation)| {
        [(format!("mass_{i}_m"), node.position_m[0]), (format!("mass_{i}_speed_m_per_s"), node.velocity_m_per_s[0])]
    };
    (1..).zip(nodes).flat_map(both).collect()
}

fn of_chain(chain: &Chain, seen: &Observation) -> Vec<(String, f64)> {
    let mut outputs = Vec::new();
    for (link, seen) in chain.links.iter().zip(&seen.links) {
        let name = link.name.as_str();
        outputs.push((format!("{name}_chord_rad"), seen.chord_rad));
        outputs.push((format!("{name}_chord_speed_rad_per_s"), seen.rate_rad_per_s));
        let middle = seen.nodes.get(link.elements / 2).filter(|_| link.elements.is_multiple_of(2));
        outputs.extend(middle.and_then(|node| node.deflection_m).map(|deflection| (format!("{name}_deflection_m"), deflection)));
    }
    let end = seen.links.last().and_then(|link| link.nodes.last()).copied().unwrap_or_default();
    match chain.end {
        End::Slider(_) => {
            outputs.push(("slider_m".to_owned(), end.position_m[0]));
            outputs.push(("slider_speed_m_per_s".to_owned(), end.velocity_m_per_s[0]));
        }
        End::Free { .. } => outputs.extend(pair("tip", "m", Some(end.position_m))),
    }
    outputs.extend(pair("pivot", "n", seen.pivot_n));
    outputs.extend(pair("crank_pin", "n", seen.crank_pin_n));
    outputs.extend(pair("slider_pin", "n", seen.slider_pin_n));
    outputs.extend(seen.guide_n.map(|force_n| ("guide_n".to_owned(), force_n)));
    outputs.extend(seen.motion_torque_nm.map(|torque_nm| ("motion_torque_nm".to_owned(), torque_nm)));
    outputs
}

fn pair(what: &str, unit: &str, vector: Option<[f64; 2]>) -> impl Iterator<Item = (String, f64)> {
    vector.into_iter().flat_map(move |vector| ["x", "y"].map(|axis| format!("{what}_{axis}_{unit}")).into_iter().zip(vector))
}
