//! The one interface of the models that are second-order systems: `r(q, q̇, q̈) = M(q) q̈ + g(q, q̇) − p = 0`.

use super::chain_line::{LinkShape, Place, PlacePoint};
use super::observation::{Energy, Observation};

/// Loads and prescribed motion of the mechanism at one instant, from outside the model.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Input {
    /// Simulated time, s.
    pub time_s: f64,
    /// Torque on the first link's tangent at the pivot, N·m.
    pub torque_nm: f64,
    /// Prescribed angle of that tangent (rad), rate and acceleration; given exactly when the scene prescribes motion.
    pub motion: Option<[f64; 3]>,
}

/// Weights of the tangent `a ∂r/∂q̈ + v ∂r/∂q̇ + q ∂r/∂q`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Weight of ∂r/∂q̈.
    pub acceleration: f64,
    /// Weight of ∂r/∂q̇.
    pub velocity: f64,
    /// Weight of ∂r/∂q.
    pub position: f64,
}

/// Most angles that say where a rigid chain is: the first link's, and a second one's that is free.
pub const ROTATIONS: usize = 2;

/// A small change of the first link's chord angle and of a deflection.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measure {
    /// Change of the first link's chord, rad; of an oscillator's first mass, m.
    pub angle_rad: f64,
    /// Change of the last flexible link's middle from its chord, m; 0 where it has no node there.
    pub deflection_m: f64,
    /// The parts of it in which the first link, and a second one that is free, turn as if all links kept their shape, rad; a mechanism
    /// leaves them 0.
    pub turns_rad: [f64; ROTATIONS],
}

impl Measure {
    /// All of it times a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            angle_rad: factor * self.angle_rad,
            deflection_m: factor * self.deflection_m,
            turns_rad: self.turns_rad.map(|turn| factor * turn),
        }
    }

    /// With another one added.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            angle_rad: self.angle_rad + other.angle_rad,
            deflection_m: self.deflection_m + other.deflection_m,
            turns_rad: std::array::from_fn(|link| self.turns_rad[link] + other.turns_rad[link]),
        }
    }
}

/// A coordinate's name, with its unit, and the change of it over which the model is far from linear.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// The name, such as `rod_bending_1_m`.
    pub name: String,
    /// 1 for angles and slopes, a length for displacements.
    pub scale: f64,
}

impl Coordinate {
    /// A displacement of a link of this length, m.
    pub(super) fn displacement(name: String, length_m: f64) -> Self {
        Self { name, scale: length_m }
    }

    /// An angle or a slope.
    pub(super) fn turn(name: String) -> Self {
        Self { name, scale: 1.0 }
    }
}

/// The tangent could not be factored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Singular;

/// No static equilibrium was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoEquilibrium;

/// A model with coordinates `q` (n of them), velocities `q̇` and accelerations `q̈`; slices have length `n`.
/// Implementations do not allocate after construction.
pub trait Mechanism: Send {
    /// n, the number of degrees of freedom (0 is possible: rigid links with prescribed motion).
    fn degrees_of_freedom(&self) -> usize;
    /// The coordinates by name, n of them.
    fn coordinates(&self) -> Vec<Coordinate>;
    /// Coordinates and velocities at t = 0 as the scene's `[start]` asks. Static equilibrium holds the tangent at the pivot at
    /// `start.angle_rad`, unless a base spring is there: then the tangent turns from that angle to where spring, weight, constant
    /// loads and `input.torque_nm` balance.
    ///
    /// # Errors
    /// [`NoEquilibrium`] when the scene asks for static equilibrium and none is found.
    fn start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) -> Result<(), NoEquilibrium>;
    /// `r = M(q) a + g(q, v) − p`.
    fn residual(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]);
    /// Largest of `r` relative to the forces at work in the last `residual`, per kind of unknown (forces, moments).
    fn residual_size(&self, r: &[f64]) -> f64;
    /// Factors `w.acceleration ∂r/∂a + w.velocity ∂r/∂v + w.position ∂r/∂q` at the state given.
    fn factor(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular>;
    /// Hands the entries of that tangent to `entry(row, column, value)`; entries that are not handed over are 0, and those of one
    /// place add up.
    fn tangent(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64));
    /// Velocities and accelerations as if every link kept its shape at `q` and the first one turned steadily, at `rate_rad_per_s`
    /// or as motion is prescribed.
    fn rigid_motion(&mut self, input: &Input, rate_rad_per_s: f64, q: &[f64], v: &mut [f64], a: &mut [f64]);
    /// Solves the last factored system for `x` in place.
    fn solve(&mut self, x: &mut [f64]);
    /// Work of `factor` over that of `residual` and `solve` together; about.
    fn factor_over_correction(&self) -> f64 {
        1.0
    }
    /// Fills `out` for the state given; `a` solves `residual = 0` at it.
    fn observe(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], out: &mut Observation);
    /// Kinetic, strain and potential energy of the state given, J; the kinetic is homogeneous in the velocities, of second degree,
    /// unless motion is prescribed.
    fn energy(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> Energy;
    /// Change of the angle and the deflection that users look at first, by a small change `dq` of the coordinates at `q`; `None` where
    /// there are no links.
    fn measure(&self, q: &[f64], dq: &[f64]) -> Option<Measure>;
    /// Angles of the chords of the first link, where motion is free, and of a second one that is free, rad, each with its rate, rad/s;
    /// whole turns may be missing. 0 where there is none.
    fn chords(&self, q: &[f64], v: &[f64]) -> [[f64; 2]; ROTATIONS];
    /// Fills `part` with `M c/(c·M c)`, where c are the velocities as this link turns about its first pin by 1 rad/s and no other one
    /// but a slider's rod, as if all kept their shape. If no other link is free, its product with a small change of the coordinates is
    /// the part of it in which the chain turns so: vibration, which has no part in the momentum of c, drops out. `false` if the link has
    /// no such turn.
    fn turn_part(&mut self, _input: &Input, _q: &[f64], _v: &[f64], _a: &[f64], _link: usize, _part: &mut [f64]) -> bool {
        false
    }
    /// `[power put in by torque, motion and resistance, power dissipated by dampers and friction]`, W.
    fn power(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 2];
    /// The model as a line in motion, from which and to which a state may be transferred; `None` if it is no chain of links.
    fn as_chain(&mut self) -> Option<&mut dyn ChainModel> {
        None
    }
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
