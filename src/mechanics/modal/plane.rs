//! Vectors of the plane.

/// `(x, y)`.
pub(super) type Vector = [f64; 2];

/// `a + b`.
#[inline(always)]
pub(super) fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1]]
}

/// `a − b`.
#[inline(always)]
pub(super) fn subtract(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}

/// `k a`.
#[inline(always)]
pub(super) fn scale(k: f64, a: Vector) -> Vector {
    [k * a[0], k * a[1]]
}

/// `a + k b`.
#[inline(always)]
pub(super) fn add_scaled(a: Vector, k: f64, b: Vector) -> Vector {
    [a[0] + k * b[0], a[1] + k * b[1]]
}

/// `a` turned a quarter counter-clockwise.
#[inline(always)]
pub(super) fn quarter(a: Vector) -> Vector {
    [-a[1], a[0]]
}

/// `a · b`.
#[inline(always)]
pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// `a × b`, out of the plane.
#[inline(always)]
pub(super) fn cross(a: Vector, b: Vector) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// A direction, by its cosine and sine.
#[derive(Debug, Clone, Copy)]
pub(super) struct Direction {
    pub(super) cos: f64,
    pub(super) sin: f64,
}

impl Direction {
    /// From the frame with this direction into the global one.
    #[inline(always)]
    pub(super) fn to_global(self, a: Vector) -> Vector {
        [self.cos * a[0] - self.sin * a[1], self.sin * a[0] + self.cos * a[1]]
    }

    /// From the global frame into the one with this direction.
    #[inline(always)]
    pub(super) fn to_local(self, a: Vector) -> Vector {
        [self.cos * a[0] + self.sin * a[1], self.cos * a[1] - self.sin * a[0]]
    }
}
