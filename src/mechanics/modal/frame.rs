//! Where a link's chord is and how it moves.

use super::link::Link;
use super::plane::{Direction, Vector, add, add_scaled, quarter};

/// A point's position, velocity and acceleration in global axes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Point {
    pub(super) position: Vector,
    pub(super) velocity: Vector,
    pub(super) acceleration: Vector,
}

/// An angle, its rate and its acceleration.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Angle {
    pub(super) angle: f64,
    pub(super) rate: f64,
    pub(super) acceleration: f64,
}

/// The chord's frame: its first pin and its direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) first: Point,
    pub(super) chord: Angle,
    pub(super) direction: Direction,
}

impl Frame {
    pub(super) fn new(first: Point, chord: Angle) -> Self {
        let (sin, cos) = chord.angle.sin_cos();
        Self { first, chord, direction: Direction { cos, sin } }
    }

    /// The frame of the last link, whose end slides on `y = 0`: `y_A + c sin β = 0`, differentiated twice.
    pub(super) fn closed<const W: usize>(first: Point, link: &Link<W>) -> Self {
        let (c, dc, ddc) = (link.u[0][0], link.du[0][0], link.ddu[0][0]);
        let sin = -first.position[1] / c;
        let cos = (1.0 - sin * sin).sqrt();
        let rate = -(first.velocity[1] + dc * sin) / (c * cos);
        let acceleration = -(first.acceleration[1] + ddc * sin + (2.0 * dc * cos - c * sin * rate) * rate) / (c * cos);
        Self { first, chord: Angle { angle: sin.atan2(cos), rate, acceleration }, direction: Direction { cos, sin } }
    }

    /// The point with field `u`, `u̇` and, in the frame, acceleration `a`.
    pub(super) fn point(&self, u: Vector, du: Vector, a: Vector) -> Point {
        let velocity = add_scaled(du, self.chord.rate, quarter(u));
        Point {
            position: add(self.first.position, self.direction.to_global(u)),
            velocity: add(self.first.velocity, self.direction.to_global(velocity)),
            acceleration: add(self.first.acceleration, self.direction.to_global(a)),
        }
    }
}

/// The closure `y_A + c sin β = 0` of a link whose end slides on `y = 0`, for columns of the tangent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Closure {
    /// `D = c cos β` with two time derivatives.
    d: [f64; 3],
    /// `sin β` with two time derivatives.
    sines: [f64; 3],
}

impl Closure {
    pub(super) fn new<const W: usize>(link: &Link<W>, frame: &Frame) -> Self {
        let (Direction { cos, sin }, chord) = (frame.direction, frame.chord);
        let (rate, square) = (chord.rate, chord.rate * chord.rate);
        let cosines = [cos, -sin * rate, -sin * chord.acceleration - cos * square];
        let sines = [sin, cos * rate, cos * chord.acceleration - sin * square];
        Self { d: leibniz([link.u[0][0], link.du[0][0], link.ddu[0][0]], cosines), sines }
    }

    /// `∂β/∂q_j` with two time derivatives, for the column of the first pin and that of the chord's length:
    /// `D β_j = −(y_A,j + c_j sin β)`, differentiated twice.
    #[inline]
    pub(super) fn angle(&self, pin: [Vector; 3], chord: Option<[f64; 3]>) -> [f64; 3] {
        let cs = chord.map_or([0.0; 3], |chord| leibniz(chord, self.sines));
        let (d, per_d) = (self.d, 1.0 / self.d[0]);
        let first = -(pin[0][1] + cs[0]) * per_d;
        let second = -(pin[1][1] + cs[1] + d[1] * first) * per_d;
        let third = -(pin[2][1] + cs[2] + d[2] * first + 2.0 * d[1] * second) * per_d;
        [first, second, third]
    }
}

/// A product with its two time derivatives.
#[inline]
fn leibniz(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]]
}
