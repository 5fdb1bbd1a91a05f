//! The chain's coordinates, its motion, and its equations `r = M(q) q̈ + g(q, q̇) − p`.

use super::frame::{Angle, Frame, Point};
use super::link::Link;
use super::loads::{Tip, base_torque_nm};
use super::plane::{Vector, add, add_scaled, scale, subtract};
use crate::mechanics::mechanism::Input;
use crate::scene::{self, Base};

/// The chord angle of a link, from the coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChordAngle {
    /// `β = q_k`.
    Coordinate(usize),
    /// The tangent at the pivot is prescribed: `β = θ(t) − Σ φ_i'(0) η_i`.
    Prescribed,
    /// The link's end slides on `y = 0`.
    Closed,
}

/// The forces on one link's pin and functions, in the frame of its chord.
#[derive(Debug, Clone)]
pub(super) struct LinkForces<const W: usize> {
    /// On the first pin.
    pub(super) first: Vector,
    /// On the functions; the chord's is the one on the second pin.
    pub(super) functions: [Vector; W],
}

/// Sums of the magnitudes of forces in the last residual, for its relative size.
#[derive(Debug, Clone, Copy, Default)]
struct ForcesAtWork {
    on_links_n: f64,
    /// With those at the pivot.
    force_n: f64,
    /// With those at the pivot.
    moment_nm: f64,
}

/// The chain and its present motion.
#[derive(Debug, Clone)]
pub(super) struct Chain<const W: usize> {
    pub(super) links: Vec<Link<W>>,
    pub(super) angles: Vec<ChordAngle>,
    /// Which coordinates are angles.
    pub(super) is_angle: Vec<bool>,
    pub(super) tip: Tip,
    pub(super) base: Base,
    pub(super) gravity: Vector,
    pub(super) degrees_of_freedom: usize,
    /// `∂β/∂q` for each link; that of a closed link is the tangent's business.
    pub(super) angle_rows: Vec<Vec<f64>>,
    /// `∂(tangent at the pivot)/∂q`; nil where it is prescribed.
    pub(super) tangent_row: Vec<f64>,
    pub(super) frames: Vec<Frame>,
    /// The last pin.
    pub(super) end: Point,
    /// Accelerations of the functions, in the frame of the chord.
    pub(super) accelerations: Vec<[Vector; W]>,
    /// Inertia forces less loads, transmitted ones included: what must act from outside the link.
    pub(super) forces: Vec<LinkForces<W>>,
    /// Force of the guide on the chain's end, N.
    pub(super) guide_n: f64,
    at_work: ForcesAtWork,
}

impl<const W: usize> Chain<W> {
    pub(super) fn new(chain: &scene::Chain, prescribed: bool) -> Self {
        let tip = Tip::new(&chain.end);
        let (mut links, mut angles, mut at) = (Vec::new(), Vec::new(), 0);
        for (i, link) in chain.links.iter().enumerate() {
            let last = i + 1 == chain.links.len();
            angles.push(if last && tip.slides {
                ChordAngle::Closed
            } else if i == 0 && prescribed {
                ChordAngle::Prescribed
            } else {
                at += 1;
                ChordAngle::Coordinate(at - 1)
            });
            let link = Link::new(link, at, i == 0);
            at += link.coordinates();
            links.push(link);
        }
        let row = vec![0.0; at];
        let mut rows = vec![row.clone(); links.len()];
        let mut tangent_row = row;
        for (row, (angle, link)) in rows.iter_mut().zip(angles.iter().zip(&links)) {
            match angle {
                ChordAngle::Coordinate(k) => row[*k] = 1.0,
                ChordAngle::Prescribed => {
                    for (i, slope) in link.shapes.root_slope.iter().enumerate() {
                        row[link.at + i] = -slope / link.shapes.length_m;
                    }
                }
                ChordAngle::Closed => {}
            }
        }
        if !prescribed {
            tangent_row.copy_from_slice(&rows[0]);
            for (i, slope) in links[0].shapes.root_slope.iter().enumerate() {
                tangent_row[links[0].at + i] = slope / links[0].shapes.length_m;
            }
        }
        let zero = [[0.0; 2]; W];
        Self {
            frames: vec![Frame::new(Point::default(), Angle::default()); links.len()],
            accelerations: vec![zero; links.len()],
            forces: vec![LinkForces { first: [0.0; 2], functions: zero }; links.len()],
            links,
            is_angle: (0..at).map(|k| angles.contains(&ChordAngle::Coordinate(k))).collect(),
            angles,
            tip,
            base: chain.base,
            gravity: chain.gravity_m_per_s2,
            degrees_of_freedom: at,
            angle_rows: rows,
            tangent_row,
            end: Point::default(),
            guide_n: 0.0,
            at_work: ForcesAtWork::default(),
        }
    }

    /// The whole motion for coordinates, velocities and accelerations given.
    #[inline]
    pub(super) fn advance(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) {
        let mut first = Point::default();
        for (i, link) in self.links.iter_mut().enumerate() {
            link.deform(q, v, a);
            let frame = match self.angles[i] {
                ChordAngle::Coordinate(k) => Frame::new(first, Angle { angle: q[k], rate: v[k], acceleration: a[k] }),
                ChordAngle::Prescribed => {
                    let [angle, rate, acceleration] = input.motion.unwrap_or_default();
                    let row = &self.angle_rows[i];
                    let (angle, rate) = (angle + product(row, q), rate + product(row, v));
                    Frame::new(first, Angle { angle, rate, acceleration: acceleration + product(row, a) })
                }
                ChordAngle::Closed => Frame::closed(first, link),
            };
            let functions = &mut self.accelerations[i];
            link.accelerate(frame.chord.rate, frame.chord.acceleration, functions);
            first = frame.point(link.u[0], link.du[0], functions[0]);
            self.frames[i] = frame;
        }
        self.end = first;
    }

    /// The tangent at the pivot and its rate.
    pub(super) fn tangent(&self) -> [f64; 2] {
        let (link, chord) = (&self.links[0], self.frames[0].chord);
        let (sines, root) = link.shapes.root_slope.split_at(link.shapes.modes);
        let slope = |u: &[Vector]| -> f64 {
            let of_sines: f64 = sines.iter().zip(&u[1..]).map(|(slope, u)| slope * u[1]).sum();
            let of_root: f64 = root.iter().zip(u.get(link.shapes.sines + 1)).map(|(slope, u)| slope * u[1]).sum();
            (of_sines + of_root) * link.per_length
        };
        [chord.angle + slope(&link.u), chord.rate + slope(&link.du)]
    }

    /// `r` without the moments at the pivot ([`Chain::add_pivot`]); leaves the forces behind.
    pub(super) fn residual(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.advance(input, q, v, a);
        for (i, link) in self.links.iter().enumerate() {
            let (frame, forces) = (&self.frames[i], &mut self.forces[i]);
            let first = frame.direction.to_local(subtract(frame.first.acceleration, self.gravity));
            forces.first = link.inertia(first, &self.accelerations[i], &mut forces.functions);
        }
        self.guide_n = 0.0;
        let end = self.end_force();
        r.fill(0.0);
        let mut forces = std::mem::take(&mut self.forces);
        self.guide_n = self.pull_back(end, &mut forces, r);
        self.forces = forces;
        for link in &mut self.links {
            let own = link.own();
            link.elastic.force(&q[own.clone()], &v[own.clone()], &mut r[own.clone()]);
            link.strong.force(&mut r[own]);
        }
        self.at_work.on_links_n = self.size_of_forces_n(q);
    }

    /// Adds torque, spring and damper at the pivot to the residual of the motion present.
    pub(super) fn add_pivot(&mut self, input: &Input, r: &mut [f64]) {
        let [tangent, rate] = self.tangent();
        let torque = base_torque_nm(self.base, tangent, rate) - input.torque_nm;
        for (r, row) in r.iter_mut().zip(&self.tangent_row) {
            *r += torque * row;
        }
        let length: f64 = self.links.iter().map(|link| link.shapes.length_m).sum();
        let (on_links_n, torque) = (self.at_work.on_links_n, torque.abs());
        self.at_work =
            ForcesAtWork { on_links_n, force_n: on_links_n + torque / length, moment_nm: on_links_n * length + torque };
    }

    /// The end's inertia less its loads, the guide's force included: what the last link must exert on it (global axes).
    pub(super) fn end_force(&self) -> Vector {
        let [resistance, _] = self.tip.resistance(self.frames[0].chord.angle);
        let force = scale(self.tip.mass_kg, subtract(self.end.acceleration, self.gravity));
        [force[0] + resistance + self.tip.friction_n_s_per_m * self.end.velocity[0], force[1] - self.guide_n]
    }

    /// Adds to `r` what `forces` and `end` (global, on the last pin) do in each coordinate, from the last link to the first,
    /// handing each first pin's force on to the link before. Returns the guide's force, which takes the moment on a closed link,
    /// so that this link's angle does no work.
    #[inline]
    pub(super) fn pull_back(&self, end: Vector, forces: &mut [LinkForces<W>], r: &mut [f64]) -> f64 {
        let (mut handed, mut guide_n) = (end, 0.0);
        for (i, link) in self.links.iter().enumerate().rev() {
            let (direction, forces) = (self.frames[i].direction, &mut forces[i]);
            if self.angles[i] == ChordAngle::Closed {
                let arm = direction.to_global(link.u[0]);
                let without_guide = link.moment(&forces.functions) + arm[0] * handed[1] - arm[1] * handed[0];
                guide_n = without_guide / arm[0];
                handed[1] -= guide_n;
            }
            let local = direction.to_local(handed);
            forces.functions[0] = add(forces.functions[0], local);
            forces.first = add(forces.first, local);
            link.pull_back(&forces.functions, r);
            if self.angles[i] != ChordAngle::Closed {
                let moment = link.moment(&forces.functions);
                for (r, row) in r.iter_mut().zip(&self.angle_rows[i]) {
                    *r += moment * row;
                }
            }
            handed = direction.to_global(forces.first);
        }
        guide_n
    }

    /// Sum of the magnitudes of the forces on the links and in them, N.
    fn size_of_forces_n(&self, q: &[f64]) -> f64 {
        let size = |(link, forces): (&Link<W>, &LinkForces<W>)| {
            let on = forces.functions.iter().fold([0.0; 2], |sum, f| [sum[0] + f[0].abs(), sum[1] + f[1].abs()]);
            on[0] + on[1] + link.elastic.size_n(&q[link.own()])
        };
        self.links.iter().zip(&self.forces).map(size).sum()
    }

    /// Largest of `r` relative to the forces and moments in the last residual.
    pub(super) fn residual_size(&self, r: &[f64]) -> f64 {
        let ForcesAtWork { force_n, moment_nm, .. } = self.at_work;
        let [mut on_angles, mut on_shapes] = [0.0_f64; 2];
        for (r, is_angle) in r.iter().zip(&self.is_angle) {
            let most = if *is_angle { &mut on_angles } else { &mut on_shapes };
            if r.abs() > *most {
                *most = r.abs();
            }
        }
        let ratio = |most: f64, at_work: f64| if most == 0.0 { 0.0 } else { most / at_work };
        ratio(on_angles, moment_nm).max(ratio(on_shapes, force_n))
    }
}

/// `a · b`.
fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `a + k b` for points' columns.
#[inline(always)]
pub(super) fn combine(k: [f64; 3], x: [Vector; 3]) -> Vector {
    add_scaled(add_scaled(scale(k[0], x[0]), k[1], x[1]), k[2], x[2])
}
