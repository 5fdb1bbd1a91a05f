//! The linear beam element: a bar and an Euler–Bernoulli beam, uncoupled (thesis 5.3).
//!
//! Both matrices follow from linear shapes along the axis and, across it, `N₁ = 1 − 3ξ² + 2ξ³`, `N₂ = L (ξ − 2ξ² + ξ³)`,
//! `N₃ = 3ξ² − 2ξ³` (the thesis prints `3ξ² + 2ξ³`), `N₄ = L (ξ³ − ξ²)`: kinetic energy `½ ∫ ρA (u̇² + v̇²) dx` (it prints second
//! derivatives), strain energy `½ ∫ EA u′² + EJ v″² dx`. A uniform axial load, which no scene has, would put `f_x L/2` on each
//! node (it prints `f_x L/12`).

use nalgebra::{SMatrix, SVector};

/// A 6 × 6 element matrix over `(u₁, v₁, w₁, u₂, v₂, w₂)`, `w` the rotation.
pub(super) type Matrix6 = SMatrix<f64, 6, 6>;
/// Six nodal values of an element.
pub(super) type Vector6 = SVector<f64, 6>;

/// Consistent mass matrix in local axes, kg (and kg·m, kg·m² where rotations enter): `ρAL/6` and `ρAL/420` multiples.
pub(super) fn mass(mass_kg: f64, length_m: f64) -> Matrix6 {
    let (m, a, l) = (mass_kg / 6.0, mass_kg / 420.0, length_m);
    Matrix6::from_row_slice(&[
        2.0 * m,
        0.0,
        0.0,
        m,
        0.0,
        0.0,
        0.0,
        156.0 * a,
        22.0 * l * a,
        0.0,
        54.0 * a,
        -13.0 * l * a,
        0.0,
        22.0 * l * a,
        4.0 * l * l * a,
        0.0,
        13.0 * l * a,
        -3.0 * l * l * a,
        m,
        0.0,
        0.0,
        2.0 * m,
        0.0,
        0.0,
        0.0,
        54.0 * a,
        13.0 * l * a,
        0.0,
        156.0 * a,
        -22.0 * l * a,
        0.0,
        -13.0 * l * a,
        -3.0 * l * l * a,
        0.0,
        -22.0 * l * a,
        4.0 * l * l * a,
    ])
}

/// Stiffness matrix in local axes from `EA` (N) and `EJ` (N·m²): multiples of `EA/L` and `EJ/L³`.
pub(super) fn stiffness(axial_n: f64, bending_nm2: f64, length_m: f64) -> Matrix6 {
    let (n, d, l) = (axial_n / length_m, bending_nm2 / length_m.powi(3), length_m);
    Matrix6::from_row_slice(&[
        n,
        0.0,
        0.0,
        -n,
        0.0,
        0.0,
        0.0,
        12.0 * d,
        6.0 * l * d,
        0.0,
        -12.0 * d,
        6.0 * l * d,
        0.0,
        6.0 * l * d,
        4.0 * l * l * d,
        0.0,
        -6.0 * l * d,
        2.0 * l * l * d,
        -n,
        0.0,
        0.0,
        n,
        0.0,
        0.0,
        0.0,
        -12.0 * d,
        -6.0 * l * d,
        0.0,
        12.0 * d,
        -6.0 * l * d,
        0.0,
        6.0 * l * d,
        2.0 * l * l * d,
        0.0,
        -6.0 * l * d,
        4.0 * l * l * d,
    ])
}

/// `Tᵀ A T` of an element's matrix `A` in local axes, whose axial and transverse entries are not coupled: of each pair of nodes
/// `A = [p 0 0; 0 q r; 0 s t]` becomes `[c²p + s²q, cs (p − q), −s r; cs (p − q), s²p + c²q, c r; −s s, c s, t]`.
pub(super) fn to_global(local: &Matrix6, chord_rad: f64) -> Matrix6 {
    let (sin, cos) = chord_rad.sin_cos();
    let (cc, cs, ss) = (cos * cos, cos * sin, sin * sin);
    let mut global = Matrix6::zeros();
    for i in [0, 3] {
        for j in [0, 3] {
            let (p, q, right, below) = (local[(i, j)], local[(i + 1, j + 1)], local[(i + 1, j + 2)], local[(i + 2, j + 1)]);
            global[(i, j)] = cc * p + ss * q;
            global[(i + 1, j + 1)] = ss * p + cc * q;
            (global[(i, j + 1)], global[(i + 1, j)]) = (cs * (p - q), cs * (p - q));
            (global[(i, j + 2)], global[(i + 1, j + 2)]) = (-sin * right, cos * right);
            (global[(i + 2, j)], global[(i + 2, j + 1)]) = (-sin * below, cos * below);
            global[(i + 2, j + 2)] = local[(i + 2, j + 2)];
        }
    }
    global
}

/// The rotation `T` from global to local axes for a chord angle: `x_local = T x`.
pub(super) fn rotation(chord_rad: f64) -> Matrix6 {
    let (s, c) = chord_rad.sin_cos();
    let mut t = Matrix6::identity();
    for node in [0, 3] {
        t[(node, node)] = c;
        t[(node, node + 1)] = s;
        t[(node + 1, node)] = -s;
        t[(node + 1, node + 1)] = c;
    }
    t
}
