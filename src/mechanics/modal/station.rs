//! Places along a link where its field and its internal forces are published.

use super::shapes::Shapes;

/// Gauss's five points on (−1, 1) and their weights.
const GAUSS: [[f64; 2]; 5] = [
    [-0.906179845938664, 0.236926885056189],
    [-0.538469310105683, 0.478628670499366],
    [0.0, 0.568888888888889],
    [0.538469310105683, 0.478628670499366],
    [0.906179845938664, 0.236926885056189],
];
/// Intervals of the quadrature for each half-wave of the fastest function.
const INTERVALS: usize = 4;

/// The functions at one `ξ`, and their integrals from there to the link's end; tabulated once.
#[derive(Debug, Clone)]
pub(super) struct Station<const W: usize> {
    pub(super) xi: f64,
    /// `g_f(ξ)`.
    pub(super) value: [f64; W],
    /// `dg_f/dξ`.
    pub(super) slope: [f64; W],
    /// `∫_ξ^1 g_f`.
    pub(super) tail: [f64; W],
    /// `∫_ξ^1 g_f g_h`.
    pub(super) products: [[f64; W]; W],
}

impl<const W: usize> Station<W> {
    /// The station at `xi`.
    pub(super) fn new(shapes: &Shapes<W>, xi: f64) -> Self {
        let n = shapes.functions();
        let at = |x: f64, derivative: usize| -> [f64; W] {
            std::array::from_fn(|f| if f < n { shapes.at(f, x)[derivative] } else { 0.0 })
        };
        let (mut tail, mut products) = ([0.0; W], [[0.0; W]; W]);
        let intervals = INTERVALS * n;
        let half = 0.5 * (1.0 - xi) / intervals as f64;
        for interval in 0..intervals {
            for [point, weight] in GAUSS {
                let g = at(xi + half * (2.0 * interval as f64 + 1.0 + point), 0);
                for (f, gf) in g.iter().enumerate() {
                    tail[f] += weight * half * gf;
                    for (h, gh) in g.iter().enumerate() {
                        products[f][h] += weight * half * gf * gh;
                    }
                }
            }
        }
        Self { xi, value: at(xi, 0), slope: at(xi, 1), tail, products }
    }
}
