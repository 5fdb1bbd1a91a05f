//! Places with masses that stand for those of the chain, and places where its shape is looked at.

use crate::mechanics::chain_line::{LinkShape, Place, PlacePoint, ShapePoint};
use crate::scene::{Chain, End, Link};

/// Gauss's four points on (0, 1) and their weights: exact to the seventh degree, where the inertia of a cubic has the sixth.
const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// Places: those with masses, link by link and the end; then, link by link, both pins of equal intervals.
#[derive(Debug, Clone)]
pub(super) struct Stations {
    pub(super) places: Vec<Place>,
    /// Masses of the first places; the rest has none.
    pub(super) masses_kg: Vec<f64>,
    pub(super) lengths_m: Vec<f64>,
    links: Vec<Spans>,
}

/// Where the places of a link stand.
#[derive(Debug, Clone)]
struct Spans {
    /// Those that stand for parts of the length; none for a link without a section.
    samples: std::ops::Range<usize>,
    nodes: std::ops::Range<usize>,
}

impl Stations {
    /// Masses as the second chain has them, intervals as many as its links have elements.
    pub(super) fn new(from: &Chain, to: &Chain) -> Self {
        let (mut places, mut masses_kg, mut links) = (Vec::new(), Vec::new(), Vec::new());
        for (i, (old, link)) in from.links.iter().zip(&to.links).enumerate() {
            let start = places.len();
            let stations = if link.bar.is_some() { uniform(old, link) } else { body(link) };
            for [xi, mass_kg] in stations {
                places.push(Place { link: i, xi });
                masses_kg.push(mass_kg);
            }
            let end = if link.bar.is_some() { places.len() } else { start };
            links.push(Spans { samples: start..end, nodes: 0..0 });
        }
        places.push(Place { link: to.links.len() - 1, xi: 1.0 });
        masses_kg.push(match &to.end {
            End::Free { tip_mass_kg } => *tip_mass_kg,
            End::Slider(slider) => slider.mass_kg,
        });
        for (i, (link, spans)) in to.links.iter().zip(&mut links).enumerate() {
            let start = places.len();
            places.extend((0..=link.elements).map(|k| Place { link: i, xi: k as f64 / link.elements as f64 }));
            spans.nodes = start..places.len();
        }
        Self { places, masses_kg, lengths_m: to.links.iter().map(|link| link.length_m).collect(), links }
    }

    /// Room for the links' shapes.
    pub(super) fn shapes(&self) -> Vec<LinkShape> {
        let at = |k: usize, weight: f64| ShapePoint { xi: self.places[k].xi, weight, ..ShapePoint::default() };
        let shape = |spans: &Spans| {
            let mass_kg: f64 = self.masses_kg[spans.samples.clone()].iter().sum();
            LinkShape {
                samples: spans.samples.clone().map(|k| at(k, self.masses_kg[k] / mass_kg)).collect(),
                nodes: spans.nodes.clone().map(|k| at(k, 0.0)).collect(),
                ..LinkShape::default()
            }
        };
        self.links.iter().map(shape).collect()
    }

    /// The points of a link: those that stand for parts of its length, its nodes, its pins.
    pub(super) fn of_link<'a>(
        &self,
        i: usize,
        points: &'a [PlacePoint],
    ) -> (&'a [PlacePoint], &'a [PlacePoint], [PlacePoint; 2]) {
        let Spans { samples, nodes } = self.links[i].clone();
        let nodes = &points[nodes];
        let pins = [nodes.first(), nodes.last()].map(|pin| pin.copied().unwrap_or_default());
        (&points[samples], nodes, pins)
    }
}

/// `[ξ, mass]` of a uniform bar. Cells stand within the new elements, as many as the old elements or as two for each half-wave of a mode.
fn uniform(old: &Link, link: &Link) -> Vec<[f64; 2]> {
    let least = old.elements.max(2 * old.modes).max(2 * link.modes);
    let cells = link.elements * least.div_ceil(link.elements);
    let cell = |k: usize| GAUSS.map(|[at, part]| [(k as f64 + at) / cells as f64, link.mass_kg * part / cells as f64]);
    (0..cells).flat_map(cell).collect()
}

/// `[ξ, mass]` of a rigid body: masses at both pins and halfway, some of them negative, that have its mass m, its first moment
/// `m c` and its moment of inertia `I_o = I + m c²` about the first pin: with `m_½/2 + m_1 = m c/L` and `m_½/4 + m_1 = I_o/L²`,
/// `m_½ = 4 (m c/L − I_o/L²)`, `m_1 = 2 I_o/L² − m c/L`.
fn body(link: &Link) -> Vec<[f64; 2]> {
    let first = link.mass_kg * link.centre_of_mass_m / link.length_m;
    let second = (link.inertia_kg_m2 + link.mass_kg * link.centre_of_mass_m.powi(2)) / link.length_m.powi(2);
    let (middle, last) = (4.0 * (first - second), 2.0 * second - first);
    vec![[0.0, link.mass_kg - middle - last], [0.5, middle], [1.0, last]]
}
