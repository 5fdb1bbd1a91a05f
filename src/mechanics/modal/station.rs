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
pub(super) struct Station {
    pub(super) xi: f64,
    /// `g_f(ξ)`.
    pub(super) value: Vec<f64>,
    /// `dg_f/dξ`.
    pub(super) slope: Vec<f64>,
    /// `∫_ξ^1 g_f`.
    pub(super) tail: Vec<f64>,
    /// `∫_ξ^1 g_f g_h`, row-major.
    pub(super) products: Vec<f64>,
}

impl Station {
    /// The station at `xi`.
    pub(super) fn new(shapes: &Shapes, xi: f64) -> Self {
        let n = shapes.functions();
        let at = |x: f64, derivative: usize| -> Vec<f64> { (0..n).map(|f| shapes.at(f, x)[derivative]).collect() };
        let (mut tail, mut products) = (vec![0.0; n], vec![0.0; n * n]);
        let intervals = INTERVALS * n;
        let half = 0.5 * (1.0 - xi) / intervals as f64;
        for interval in 0..intervals {
            for [point, weight] in GAUSS {
                let g = at(xi + half * (2.0 * interval as f64 + 1.0 + point), 0);
                for (f, gf) in g.iter().enumerate() {
                    tail[f] += weight * half * gf;
                    for (h, gh) in g.iter().enumerate() {
                        products[f * n + h] += weight * half * gf * gh;
                    }
                }
            }
        }
        Self { xi, value: at(xi, 0), slope: at(xi, 1), tail, products }
    }
}
