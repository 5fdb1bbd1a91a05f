//! The chain's field, joint forces and internal forces, from a motion that satisfies its equations.

use super::chain::{Chain, ChordAngle};
use super::link::Link;
use super::plane::{Direction, Vector, add, add_scaled, cross, scale, subtract};
use super::station::Station;
use crate::mechanics::mechanism::Input;
use crate::mechanics::observation::{ElementForces, LinkObservation, NodeObservation, Observation};

/// Largest slope from the chord for which the model is trusted, rad: that of a half wave with a tenth of the length as its height.
///
/// The neglected terms grow as the square of the slope, `(πw/L)²` of such a wave. A wire that hangs down from a clamped end has little
/// deflection from its chord, and a steep slope at that end. Measured with two modes: mid-span within 0.4 % of its
/// peak on R3 (1.6 % of the length), 3 % on R4m (17 %); a rod just buckled, the most sensitive case, is 2 % off the elastica at
/// 5.5 % of the length and 6 % at 10 %.
const LARGEST_SLOPE_RAD: f64 = 0.1 * std::f64::consts::PI;
/// Intervals between the places where the slope is compared with that bound.
const RANGE_INTERVALS: usize = 12;

/// Tables of one link for its outputs.
#[derive(Debug, Clone)]
struct Places<const W: usize> {
    nodes: Vec<Station<W>>,
    range: Vec<Station<W>>,
}

/// Tables for outputs of the whole chain.
#[derive(Debug, Clone)]
pub(super) struct Observer<const W: usize> {
    links: Vec<Places<W>>,
}

impl<const W: usize> Observer<W> {
    /// `elements` holds the number of intervals between nodes of each link.
    pub(super) fn new(chain: &Chain<W>, elements: impl Iterator<Item = usize>) -> Self {
        let stations = |link: &Link<W>, n: usize| -> Vec<Station<W>> {
            (0..=n).map(|i| Station::new(&link.shapes, i as f64 / n as f64)).collect()
        };
        let places = |(link, n): (&Link<W>, usize)| Places {
            nodes: stations(link, n.max(1)),
            range: if link.bending > 0 { stations(link, RANGE_INTERVALS) } else { Vec::new() },
        };
        Self { links: chain.links.iter().zip(elements).map(places).collect() }
    }

    /// Fills `out` from the chain after its residual.
    pub(super) fn observe(&self, chain: &Chain<W>, input: &Input, q: &[f64], out: &mut Observation) {
        let count = chain.links.len();
        out.links.resize_with(count, LinkObservation::default);
        for i in (0..count).rev() {
            self.observe_link(chain, i, &mut out.links[i]);
        }
        let global = |i: usize| chain.frames[i].direction.to_global(chain.forces[i].first);
        let slides = chain.tip.slides;
        out.pivot_n = Some(global(0));
        out.crank_pin_n = (count > 1).then(|| global(count - 1));
        out.slider_pin_n = slides.then(|| chain.end_force());
        out.guide_n = slides.then_some(chain.guide_n);
        out.resistance_n = slides.then(|| chain.tip.resistance(chain.frames[0].chord.angle)[0]);
        out.motion_torque_nm = chain.is_prescribed().then(|| chain.motion_torque_nm(input));
        out.energy = chain.energy(q);
        let slope_rad = self.largest_slope_rad(chain);
        out.out_of_range = (slope_rad > LARGEST_SLOPE_RAD).then_some(slope_rad);
    }

    /// Internal forces only where `out` has room for them: a link given by its mass alone has no known distribution of it.
    fn observe_link(&self, chain: &Chain<W>, i: usize, out: &mut LinkObservation) {
        let (link, frame, stations) = (&chain.links[i], &chain.frames[i], &self.links[i].nodes);
        out.chord_rad = frame.chord.angle;
        out.rate_rad_per_s = frame.chord.rate;
        out.acceleration_rad_per_s2 = Some(frame.chord.acceleration);
        out.nodes.resize(stations.len(), NodeObservation::default());
        for (node, station) in out.nodes.iter_mut().zip(stations) {
            let point = frame.point(sum(&station.value, &link.u), sum(&station.value, &link.du), [0.0; 2]);
            *node = NodeObservation {
                position_m: point.position,
                velocity_m_per_s: point.velocity,
                rotation_rad: Some(frame.chord.angle + sum(&station.slope, &link.u)[1] / link.shapes.length_m),
                deflection_m: (link.bending > 0).then(|| sum(&station.value, &link.u)[1]),
            };
        }
        let section = |station: &Station<W>| self.section(chain, i, station);
        let mut start = section(&stations[0]);
        for (pair, element) in stations.windows(2).zip(&mut out.elements) {
            let end = section(&pair[1]);
            let along = subtract(sum(&pair[1].value, &link.u), sum(&pair[0].value, &link.u));
            let length = along[0].hypot(along[1]);
            let direction = Direction { cos: along[0] / length, sin: along[1] / length };
            let [axial_n, shear_n] = direction.to_local(scale(0.5, add(start.0, end.0)));
            *element = ElementForces { axial_n, shear_n, moment_start_nm: start.1, moment_end_nm: end.1 };
            start = end;
        }
    }

    /// Force and moment of the part beyond a section on the part before it, in the frame of the chord, from the equilibrium of
    /// the part beyond, `ξ > ξ_s`, under its inertia less gravity and the force handed on at the second pin:
    ///
    /// ```text
    /// F = −m ∫ a dξ − H      M = −m ∫ (r − r_s) × a dξ − (r_B − r_s) × H
    /// ```
    fn section(&self, chain: &Chain<W>, i: usize, station: &Station<W>) -> (Vector, f64) {
        let (link, frame, a) = (&chain.links[i], &chain.frames[i], &chain.accelerations[i]);
        let first = frame.direction.to_local(subtract(frame.first.acceleration, chain.gravity));
        let handed = frame.direction.to_local(chain.handed(i));
        let tail = add_scaled(sum(&station.tail, a), 1.0 - station.xi, first);
        let here = sum(&station.value, &link.u);
        let mut moment = cross(sum(&station.tail, &link.u), first) - cross(here, tail);
        for (f, u) in link.u.iter().enumerate() {
            moment += cross(*u, sum(&station.products[f], a));
        }
        let force = add_scaled(handed, link.mass_kg, tail);
        let moment = link.mass_kg * moment + cross(subtract(link.u[0], here), handed);
        (scale(-1.0, force), -moment)
    }

    /// Change of the last flexible link's middle from its chord by `dq`, m.
    pub(super) fn deflection_change(&self, chain: &Chain<W>, dq: &[f64]) -> f64 {
        let bent = self.links.iter().zip(&chain.links).rev().find(|(_, link)| link.bending > 0);
        bent.map_or(0.0, |(places, link)| {
            let (middle, own) = (&places.range[RANGE_INTERVALS / 2], &dq[link.at..link.at + link.bending]);
            own.iter().enumerate().map(|(i, d)| middle.value[link.shapes.function_of(i)] * d).sum()
        })
    }

    fn largest_slope_rad(&self, chain: &Chain<W>) -> f64 {
        let mut largest = 0.0_f64;
        for (places, link) in self.links.iter().zip(&chain.links) {
            for station in &places.range {
                largest = largest.max((sum(&station.slope, &link.u)[1] / link.shapes.length_m).abs());
            }
        }
        largest.atan()
    }
}

impl<const W: usize> Chain<W> {
    /// Change of the first link's chord angle by `dq`, rad.
    pub(super) fn chord_change(&self, dq: &[f64]) -> f64 {
        self.angle_rows[0].iter().zip(dq).map(|(row, d)| row * d).sum()
    }

    /// Whether the tangent at the pivot is prescribed.
    pub(super) fn is_prescribed(&self) -> bool {
        self.angles[0] == ChordAngle::Prescribed
    }

    /// Force (global) that link `i` exerts at its second pin.
    fn handed(&self, i: usize) -> Vector {
        match self.forces.get(i + 1) {
            Some(next) => self.frames[i + 1].direction.to_global(next.first),
            None => self.end_force(),
        }
    }
}

/// `Σ k_f x_f`.
fn sum<const W: usize>(k: &[f64; W], x: &[Vector; W]) -> Vector {
    k.iter().zip(x).fold([0.0; 2], |sum, (k, x)| add_scaled(sum, *k, *x))
}
