//! The shape of a mode on the mechanism: displacements of the links' nodes.

use nalgebra::{Complex, DVector};

use super::point::Point;
use super::subject::Subject;
use crate::mechanics::{LinkObservation, Mechanism, NodeObservation, Observation};
use crate::scene::LinkName;

/// Forces at the pivot, the crank pin and the slider pin (x, y); 0 where there is no such joint.
pub type JointForces = [[f64; 2]; 3];

/// Displacement of the coordinates by which the shape is found, m or rad; what it adds to a linear change is its square.
const SMALL: f64 = 1e-5;

/// A mode's shape on one link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkShape {
    /// The link.
    pub link: LinkName,
    /// Places of its nodes at the point, m.
    pub at_m: Vec<[f64; 2]>,
    /// Displacement of each node, along the chord and to its left.
    pub displacement: Vec<[Complex<f64>; 2]>,
    /// Turn of the tangent at each node, rad.
    pub turn: Vec<Complex<f64>>,
    /// Chord angle at the point, rad.
    pub chord_rad: f64,
    /// Mass, kg.
    pub mass_kg: f64,
}

/// Part of the squared displacements of all nodes that is left when every link moves as its pins do, without bending or stretching: at
/// the first pin with it, and turned as the chord is. 0 to about 1.
pub(super) fn deformed_part(links: &[LinkShape]) -> f64 {
    let (mut left, mut whole) = (0.0, 0.0);
    for link in links {
        let Some([along, across]) = link.displacement.first().copied() else { continue };
        let intervals = link.displacement.len().saturating_sub(1).max(1) as f64;
        let across_end = link.displacement.last().map_or(across, |end| end[1]);
        for (k, node) in (0..).zip(&link.displacement) {
            let turned = (across_end - across) * (f64::from(k) / intervals);
            left += (node[0] - along).norm_sqr() + (node[1] - across - turned).norm_sqr();
            whole += node[0].norm_sqr() + node[1].norm_sqr();
        }
    }
    if whole > 0.0 { left / whole } else { 0.0 }
}

/// The links' nodes in a state, by which shapes are found.
pub(super) struct Figure {
    names: Vec<(LinkName, f64)>,
    observation: Observation,
}

impl Figure {
    pub(super) fn new(subject: &Subject) -> Self {
        let links = subject.chain().map(|chain| chain.links.as_slice()).unwrap_or_default();
        let blank =
            |nodes: usize| LinkObservation { nodes: vec![NodeObservation::default(); nodes], ..LinkObservation::default() };
        Figure {
            names: links.iter().map(|link| (link.name, link.mass_kg)).collect(),
            observation: Observation {
                links: links.iter().map(|link| blank(link.elements + 1)).collect(),
                ..Observation::default()
            },
        }
    }

    /// The shape of `φ` on every link; none of an oscillator.
    pub(super) fn shape(
        &mut self,
        mechanism: &mut dyn Mechanism,
        point: &Point,
        vector: &DVector<Complex<f64>>,
    ) -> Vec<LinkShape> {
        if self.names.is_empty() {
            return Vec::new();
        }
        let still = self.links(mechanism, point, None);
        let largest = vector.iter().fold(0.0, |most: f64, x| most.max(x.norm()));
        let scale = SMALL / largest.max(f64::MIN_POSITIVE);
        let [re, im] = [|x: &Complex<f64>| x.re, |x: &Complex<f64>| x.im].map(|part| {
            let [ahead, behind] = [scale, -scale].map(|scale| {
                let change: Vec<f64> = vector.iter().map(|x| scale * part(x)).collect();
                self.links(mechanism, point, Some(&change))
            });
            (ahead, behind)
        });
        let half = 0.5 / scale;
        let link = |k: usize| {
            let (name, mass_kg) = self.names[k];
            let (sin, cos) = still[k].chord_rad.sin_cos();
            let node = |i: usize| {
                let moved = |pair: &(Vec<LinkObservation>, Vec<LinkObservation>)| {
                    let [a, b] = [&pair.0[k].nodes[i], &pair.1[k].nodes[i]];
                    let d = [0, 1].map(|c| half * (a.position_m[c] - b.position_m[c]));
                    let turn = half * (a.rotation_rad.unwrap_or_default() - b.rotation_rad.unwrap_or_default());
                    ([cos * d[0] + sin * d[1], cos * d[1] - sin * d[0]], turn)
                };
                let ((re, re_turn), (im, im_turn)) = (moved(&re), moved(&im));
                ([0, 1].map(|c| Complex::new(re[c], im[c])), Complex::new(re_turn, im_turn))
            };
            let (displacement, turn) = (0..still[k].nodes.len()).map(node).unzip();
            let at_m = still[k].nodes.iter().map(|node| node.position_m).collect();
            LinkShape { link: name, at_m, displacement, turn, chord_rad: still[k].chord_rad, mass_kg }
        };
        (0..self.names.len()).map(link).collect()
    }

    /// Forces at the joints in a free vibration of the shape φ and the squared frequency ω², over its displacement x, N/m:
    ///
    /// ```text
    /// (F(q₀ + ε φ, v₀, a₀ − ω² ε φ) − F(q₀ − ε φ, v₀, a₀ + ω² ε φ)) / 2ε
    /// ```
    ///
    /// with the forces `F(q, v, a)` that the model shows: the acceleration of a free vibration is `ẍ = −ω² x`.
    pub(super) fn joint_forces(
        &mut self,
        mechanism: &mut dyn Mechanism,
        point: &Point,
        shape: &[f64],
        square: f64,
    ) -> JointForces {
        if self.names.is_empty() {
            return JointForces::default();
        }
        let largest = shape.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let scale = SMALL / largest.max(f64::MIN_POSITIVE);
        let [ahead, behind] = [scale, -scale].map(|scale| {
            let mut moved = point.clone();
            moved.q.iter_mut().zip(shape).for_each(|(q, x)| *q += scale * x);
            moved.a.iter_mut().zip(shape).for_each(|(a, x)| *a -= square * scale * x);
            mechanism.observe(&moved.input, &moved.q, &moved.v, &moved.a, &mut self.observation);
            let Observation { pivot_n, crank_pin_n, slider_pin_n, .. } = self.observation;
            [pivot_n, crank_pin_n, slider_pin_n].map(Option::unwrap_or_default)
        });
        let half = 0.5 / scale;
        std::array::from_fn(|joint| [0, 1].map(|c| half * (ahead[joint][c] - behind[joint][c])))
    }

    /// Axial force of every link's elements, N; empty where the model does not know them.
    pub(super) fn axial_n(&mut self, mechanism: &mut dyn Mechanism, point: &Point) -> Vec<Vec<f64>> {
        let links = self.links(mechanism, point, None);
        links.iter().map(|link| link.elements.iter().map(|element| element.axial_n).collect()).collect()
    }

    /// The links with the coordinates changed.
    fn links(&mut self, mechanism: &mut dyn Mechanism, point: &Point, change: Option<&[f64]>) -> Vec<LinkObservation> {
        let mut q = point.q.clone();
        q.iter_mut().zip(change.unwrap_or_default()).for_each(|(q, change)| *q += change);
        mechanism.observe(&point.input, &q, &point.v, &point.a, &mut self.observation);
        self.observation.links.clone()
    }
}

/// Likeness of two modes' shapes, from 0 to 1: `|Σ m u₁ᴴ u₂|² / (Σ m |u₁|² Σ m |u₂|²)` over the nodes, in the frames of their chords, so that the
/// chain may have turned in between.
pub fn likeness(one: &[LinkShape], other: &[LinkShape]) -> f64 {
    let product = |one: &[LinkShape], other: &[LinkShape]| -> Complex<f64> {
        let links = one.iter().zip(other);
        links
            .map(|(one, other)| {
                let nodes = one.displacement.iter().zip(&other.displacement);
                let sum: Complex<f64> = nodes.flat_map(|(a, b)| [a[0].conj() * b[0], a[1].conj() * b[1]]).sum();
                sum * (one.mass_kg / one.displacement.len() as f64)
            })
            .sum()
    };
    let sizes = product(one, one).re * product(other, other).re;
    if sizes > 0.0 { product(one, other).norm_sqr() / sizes } else { 0.0 }
}
