//! Takes the state of one model of a chain to another of the same geometry: rigid, modal or finite-element.
//!
//! **Shape.** The new model takes over the chord angles, whole turns counted, and fits its coordinates to the deflections
//! ([`ChainModel::fit`]). A slider's rod closes on y = 0; a prescribed tangent stands as prescribed.
//!
//! **Velocities.** They are the ones that leave the least kinetic energy in what the new model cannot do of the old velocities u: with
//! the velocities `ẋ = J q̇ + …` of its own places and the masses W there,
//!
//! ```text
//! minimise ½ (u − ẋ)ᵀ W (u − ẋ)      q̇ ← q̇ + M⁻¹ Jᵀ W (u − ẋ)
//! ```
//!
//! `JᵀWJ` is M but for the quadrature, so that a few rounds reach the fixed point. What is prescribed is part of ẋ.
//!
//! **Momentum.** `c · ∂T/∂q̇` belongs to a motion c in which the links turn without a change of shape. Were the new places the old
//! ones, the projection would keep it, since c is a motion of the new model. But a fit moves the places by `δ`, and a rigid motion moves
//! places by their distance from the pivot: the momentum changes by `Σ W u · (ω × δ)`, of the first order in what the fit leaves
//! out. So multiples of the motions c are added,
//!
//! ```text
//! q̇ ← q̇ + Σ λ_i c_i      Σ_j (c_i · M c_j) λ_j = p_i,old − p_i,new
//! ```
//!
//! a turn of the links as rigid bodies. It is small, as δ is: of the built-in crank-slider, whose crank turns at 8.5 rad/s in the middle
//! of its vibration, λ is 6e-2 rad/s into rigid links, 6e-6 into one mode, 2e-7 from 32 elements to four modes, 4e-6 to 8 elements.
//!
//! **Shocks.** A link that becomes rigid stops its vibration at once. The projection hands that blow on to the other link: of the
//! built-in crank-slider, whose rod becomes rigid in the middle of its vibration, some 0.7 J of 14 J go into vibrations of the crank
//! that die away within 0.3 ms. Steps of 2 ms do not resolve these. As in [`Transfer::accelerations`], what steps do not resolve is
//! brought to rest. Were there no blow, the other link would keep its velocities, and the rigid one turn as its chord did: q̇_o. To
//! these, the blow d that the projection gives adds
//!
//! ```text
//! q̇ = q̇_o + (M + ½h C + ¼h² K)⁻¹ M d      d = q̇_projected − q̇_o
//! ```
//!
//! which is all of d as the step h goes to 0. The energy that is lost counts as that of the change.
//!
//! **Limits.** The mean axial strain of a link is kept, not its distribution. A model without axial strain has none to hand over:
//! finite elements then begin with slack links, and the axial force rings about its mean for some ten steps. Into rigid links all
//! vibration is lost, with its energy.

mod frame;
mod stations;
#[cfg(test)]
mod tests;

use super::chain_line::{LinkShape, PlacePoint};
use super::mechanism::{ChainModel, Coordinate, Input, Mechanism, Weights};
use crate::scene::{Chain, End};
use frame::{Frame, chord_rate, stretch};
use stations::Stations;

/// Most rounds of the projection of velocities. Two or three do: each leaves 1e-5 of the one before, or less.
const ROUNDS: usize = 8;
/// A round that changes velocities by no more than this part of them is the last: the next would change them by rounding.
const SETTLED: f64 = 1e-10;
/// Links that may turn by themselves, at most.
const TURNS: usize = 2;

const MASS: Weights = Weights { acceleration: 1.0, velocity: 0.0, position: 0.0 };

/// `M + ½h C + ¼h² K`: vibrations of frequencies above 2/h hardly move by it.
fn of_step(h_s: f64) -> Weights {
    Weights { acceleration: 1.0, velocity: 0.5 * h_s, position: 0.25 * h_s * h_s }
}

/// A state cannot be transferred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CannotTransfer {
    /// One of the models is no chain of links.
    #[error("a model that is no chain of links cannot hand over its state, nor take one")]
    NotAChain,
    /// The chains differ in their links' lengths, or in their end.
    #[error("the chains are not of the same geometry")]
    OtherGeometry,
    /// The new model has no velocities at the shape fitted.
    #[error("the new model has a singular mass matrix at the state to transfer")]
    Singular,
    /// The old state is not finite, or is out of the new model's reach.
    #[error("the state to transfer is out of the new model's reach")]
    OutOfReach,
}

/// A state to transfer.
#[derive(Debug, Clone, Copy)]
pub struct Present<'a> {
    /// Prescribed motion, if any, at this instant.
    pub input: &'a Input,
    /// Coordinates.
    pub q: &'a [f64],
    /// Velocities.
    pub v: &'a [f64],
}

/// Everything that a transfer from one model to another needs, prepared.
#[derive(Debug, Clone)]
pub struct Transfer {
    same: bool,
    /// The velocity of each new coordinate without a blow; empty where no link becomes rigid beside one that keeps its coordinates.
    without_blow: Vec<WithoutBlow>,
    /// Whether both chains have the same masses: a chain whose masses change keeps its velocities, and its momentum changes with them.
    keeps_momentum: bool,
    stations: Stations,
    shapes: Vec<LinkShape>,
    /// The old model's, one for each place of `stations`.
    points: Vec<PlacePoint>,
    /// The new model's, of the places with a mass.
    own: Vec<PlacePoint>,
    /// Mass times the velocity that is missing, for each of these places.
    missing: Vec<[f64; 2]>,
    angles: Vec<f64>,
    old: Room,
    new: Room,
}

/// The velocity of a coordinate of the new model, were there no blow.
#[derive(Debug, Clone, Copy)]
enum WithoutBlow {
    /// That at this place of the old velocities.
    AsBefore(usize),
    /// The rate at which the chord of this link turned: its only coordinate is its angle.
    AsChord(usize),
}

/// Vectors of as many numbers as a model has coordinates.
#[derive(Debug, Clone)]
struct Room {
    turns: [Vec<f64>; TURNS],
    momentum: Vec<f64>,
}

impl Room {
    fn new(n: usize) -> Self {
        let zero = vec![0.0; n];
        Self { turns: [zero.clone(), zero.clone()], momentum: zero }
    }
}

impl Transfer {
    /// From one model, of this chain, to another, of that chain. Motion is prescribed in both, or in neither.
    ///
    /// # Errors
    /// [`CannotTransfer::OtherGeometry`] when lengths or ends differ.
    pub fn new(from_chain: &Chain, from: &dyn Mechanism, to_chain: &Chain, to: &dyn Mechanism) -> Result<Self, CannotTransfer> {
        if !alike(from_chain, to_chain) {
            return Err(CannotTransfer::OtherGeometry);
        }
        let stations = Stations::new(from_chain, to_chain);
        let shapes = stations.shapes();
        let [old, new] = [from.coordinates(), to.coordinates()];
        Ok(Self {
            same: old.iter().map(|c| &c.name).eq(new.iter().map(|c| &c.name)),
            without_blow: without_blow(to_chain, &old, &new).unwrap_or_default(),
            keeps_momentum: same_masses(from_chain, to_chain),
            points: vec![PlacePoint::default(); stations.places.len()],
            own: vec![PlacePoint::default(); stations.masses_kg.len()],
            missing: vec![[0.0; 2]; stations.masses_kg.len()],
            angles: vec![0.0; to_chain.links.len()],
            old: Room::new(from.degrees_of_freedom()),
            new: Room::new(to.degrees_of_freedom()),
            shapes,
            stations,
        })
    }

    /// Whether both models have the same coordinates, so that a state is copied as it is.
    pub fn is_copy(&self) -> bool {
        self.same
    }

    /// Sets `q` and `v` of the model `to`, to go on in steps of `h_s`, from the state `old` of the model `from`; both are given anew
    /// after an error.
    ///
    /// # Errors
    /// [`CannotTransfer`], for a model that is no chain, or a shape at which the new model has no velocities.
    pub fn apply(
        &mut self,
        (from, old): (&mut dyn Mechanism, &Present),
        (to, h_s): (&mut dyn Mechanism, f64),
        q: &mut [f64],
        v: &mut [f64],
    ) -> Result<(), CannotTransfer> {
        if self.same {
            q.copy_from_slice(old.q);
            v.copy_from_slice(old.v);
            return Ok(());
        }
        let (Some(from), Some(to)) = (from.as_chain(), to.as_chain()) else { return Err(CannotTransfer::NotAChain) };
        from.points(old.input, old.q, old.v, &self.stations.places, &mut self.points);
        from.chord_angles(old.input, old.q, &mut self.angles);
        self.take_shapes();
        to.fit(old.input, &self.shapes, q);
        self.project(to, old.input, q, v)?;
        self.soften(to, old, h_s, q, v)?;
        if self.keeps_momentum {
            self.keep_momentum(from, old, to, q, v)?;
        }
        let finite = q.iter().chain(v.iter()).all(|x| x.is_finite());
        finite.then_some(()).ok_or(CannotTransfer::OutOfReach)
    }

    /// Sets accelerations to go on with in steps of `h_s`, at a state of the new model: with `r(q, v, a) = M a + …`, damping C and
    /// stiffness K,
    ///
    /// ```text
    /// (M + ½h C + ¼h² K) a = −r(q, v, 0)
    /// ```
    ///
    /// A mode of frequency ω that stands x from its rest gets `−ω² x/(1 + ¼h²ω²)`. For the slow ones that is the equation of motion.
    /// Fast ones, which steps do not resolve, are displaced a little by every fit. Their own accelerations may be 10⁵ times those of
    /// the motion, a predictor would throw the state out of reach, and steps would fail; so they get what brings them to rest.
    ///
    /// # Errors
    /// [`CannotTransfer::Singular`] when that matrix is singular.
    pub fn accelerations(
        &mut self,
        to: &mut dyn Mechanism,
        new: &Present,
        h_s: f64,
        a: &mut [f64],
    ) -> Result<(), CannotTransfer> {
        a.fill(0.0);
        if a.is_empty() {
            return Ok(());
        }
        let (Present { input, q, v }, rest) = (*new, &mut self.new.momentum);
        to.residual(input, q, v, a, rest);
        to.factor(input, q, v, a, of_step(h_s)).map_err(|_| CannotTransfer::Singular)?;
        to.solve(rest);
        a.iter_mut().zip(rest).for_each(|(a, rest)| *a = -*rest);
        Ok(())
    }

    /// The old model's links in the frames of their chords.
    fn take_shapes(&mut self) {
        for (i, shape) in self.shapes.iter_mut().enumerate() {
            let (samples, nodes, pins) = self.stations.of_link(i, &self.points);
            let frame = Frame::new(&pins, self.angles[i]);
            shape.chord_rad = frame.angle;
            shape.chord_m = frame.length_m;
            for (sample, point) in shape.samples.iter_mut().zip(samples) {
                frame.show(point, sample);
            }
            for (node, point) in shape.nodes.iter_mut().zip(nodes) {
                frame.show(point, node);
            }
            shape.stretch = stretch(shape, self.stations.lengths_m[i]);
        }
    }

    /// Sets the velocities of the new model at its coordinates `q`.
    fn project(&mut self, to: &mut dyn ChainModel, input: &Input, q: &[f64], v: &mut [f64]) -> Result<(), CannotTransfer> {
        v.fill(0.0);
        if v.is_empty() {
            return Ok(());
        }
        let (masses_kg, change) = (&self.stations.masses_kg, &mut self.new.momentum);
        let places = &self.stations.places[..masses_kg.len()];
        to.factor(input, q, v, &*change, MASS).map_err(|_| CannotTransfer::Singular)?;
        for _ in 0..ROUNDS {
            to.points(input, q, v, places, &mut self.own);
            for (k, missing) in self.missing.iter_mut().enumerate() {
                let (u, own) = (self.points[k].velocity_m_per_s, self.own[k].velocity_m_per_s);
                *missing = [0, 1].map(|axis| masses_kg[k] * (u[axis] - own[axis]));
            }
            to.pull_back(input, q, places, &self.missing, change);
            to.solve(change);
            v.iter_mut().zip(change.iter()).for_each(|(v, change)| *v += change);
            if dot(change, change) <= SETTLED * SETTLED * dot(v, v) {
                break;
            }
        }
        Ok(())
    }

    /// Takes out of the velocities the part of the blow of a link that becomes rigid that steps of `h_s` do not resolve.
    fn soften(
        &mut self,
        to: &mut dyn ChainModel,
        old: &Present,
        h_s: f64,
        q: &[f64],
        v: &mut [f64],
    ) -> Result<(), CannotTransfer> {
        if self.without_blow.is_empty() {
            return Ok(());
        }
        let Room { turns: [blow, still_a], momentum } = &mut self.new;
        for ((blow, v), without_blow) in blow.iter_mut().zip(&*v).zip(&self.without_blow) {
            *blow = v - match *without_blow {
                WithoutBlow::AsBefore(place) => old.v[place],
                WithoutBlow::AsChord(link) => chord_rate(&self.stations.of_link(link, &self.points).2),
            };
        }
        let still = Input { motion: old.input.motion.map(|[angle, ..]| [angle, 0.0, 0.0]), ..*old.input };
        to.momentum(&still, q, blow, momentum);
        v.iter_mut().zip(&*blow).for_each(|(v, blow)| *v -= blow);
        still_a.fill(0.0);
        to.factor(old.input, q, v, still_a, of_step(h_s)).map_err(|_| CannotTransfer::Singular)?;
        to.solve(momentum);
        v.iter_mut().zip(&*momentum).for_each(|(v, softened)| *v += softened);
        Ok(())
    }

    /// Gives the new state the momentum of the old one in every rigid motion.
    fn keep_momentum(
        &mut self,
        from: &mut dyn ChainModel,
        old: &Present,
        to: &mut dyn ChainModel,
        q: &[f64],
        v: &mut [f64],
    ) -> Result<(), CannotTransfer> {
        let still = Input { motion: old.input.motion.map(|[angle, ..]| [angle, 0.0, 0.0]), ..*old.input };
        let (mut gram, mut lost) = ([[0.0; TURNS]; TURNS], [0.0; TURNS]);
        from.momentum(old.input, old.q, old.v, &mut self.old.momentum);
        to.momentum(old.input, q, v, &mut self.new.momentum);
        for (link, row) in gram.iter_mut().enumerate() {
            let [old_turn, new_turn] = [&mut self.old.turns[link], &mut self.new.turns[link]];
            if from.turn(&still, old.q, link, old_turn) && to.turn(&still, q, link, new_turn) {
                lost[link] = dot(old_turn, &self.old.momentum) - dot(new_turn, &self.new.momentum);
            } else {
                new_turn.fill(0.0);
                row[link] = 1.0;
            }
        }
        let Room { turns, momentum } = &mut self.new;
        for (turn, row) in turns.iter().zip(&mut gram) {
            to.momentum(&still, q, turn, momentum);
            row.iter_mut().zip(turns.iter()).for_each(|(entry, other)| *entry += dot(other, momentum));
        }
        let rates = solve(gram, lost).ok_or(CannotTransfer::Singular)?;
        for (turn, rate) in turns.iter().zip(rates) {
            v.iter_mut().zip(turn).for_each(|(v, turn)| *v += rate * turn);
        }
        Ok(())
    }
}

/// The velocities of the new coordinates without a blow, if links become rigid, and each other one keeps its coordinates. Nodes of
/// another mesh, and modes beside another number of them, may have the same names, and mean something else.
fn without_blow(chain: &Chain, old: &[Coordinate], new: &[Coordinate]) -> Option<Vec<WithoutBlow>> {
    let (mut all, mut is_kept) = (Vec::new(), false);
    for (i, link) in chain.links.iter().enumerate() {
        let is_of_link = |(_, coordinate): &(usize, &Coordinate)| coordinate.name.split('_').next() == Some(link.name.as_str());
        let [olds, news] = [old, new].map(|all| all.iter().enumerate().filter(is_of_link).collect::<Vec<_>>());
        let is_same = olds.iter().map(|(_, one)| &one.name).eq(news.iter().map(|(_, one)| &one.name));
        is_kept |= is_same && !news.is_empty();
        match is_same {
            true => all.extend(news.iter().zip(&olds).map(|((at, _), (place, _))| (*at, WithoutBlow::AsBefore(*place)))),
            false if link.rigid => all.extend(news.iter().map(|(at, _)| (*at, WithoutBlow::AsChord(i)))),
            false => return None,
        }
    }
    all.sort_by_key(|(at, _)| *at);
    (is_kept && all.len() == new.len()).then(|| all.into_iter().map(|(_, without_blow)| without_blow).collect())
}

/// Whether the chains are the same line: as many links, as long, with the same kind of end.
fn alike(one: &Chain, other: &Chain) -> bool {
    let lengths = |chain: &Chain| chain.links.iter().map(|link| link.length_m).collect::<Vec<_>>();
    let slides = |chain: &Chain| matches!(chain.end, End::Slider(_));
    lengths(one) == lengths(other) && slides(one) == slides(other)
}

/// Whether the links and the end have the same masses.
fn same_masses(one: &Chain, other: &Chain) -> bool {
    let links = |chain: &Chain| -> Vec<[f64; 3]> {
        chain.links.iter().map(|link| [link.mass_kg, link.centre_of_mass_m, link.inertia_kg_m2]).collect()
    };
    let end = |chain: &Chain| match &chain.end {
        End::Free { tip_mass_kg } => *tip_mass_kg,
        End::Slider(slider) => slider.mass_kg,
    };
    links(one) == links(other) && end(one) == end(other)
}

/// Solves two equations with a positive matrix.
fn solve([[a, b], [c, d]]: [[f64; 2]; 2], [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let determinant = a * d - b * c;
    determinant.is_normal().then(|| [(d * x - b * y) / determinant, (a * y - c * x) / determinant])
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
