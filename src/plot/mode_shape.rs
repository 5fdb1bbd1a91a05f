//! Shapes of modes on the mechanism.

use nalgebra::Complex;

use super::figure::{Axis, Figure, Mark};
use crate::small_motion::LinkShape;

/// Largest displacement drawn, as a part of the mechanism's size.
const LARGEST: f64 = 0.12;
/// Parts in which the curve between two nodes is drawn.
const BETWEEN: usize = 8;

/// The links at rest, dashed, and displaced as a mode displaces them, to both sides. The largest displacement is drawn as an eighth
/// of the mechanism's size, and the title says that it was chosen: a mode has no amplitude of its own. Between nodes runs the cubic
/// that has their displacements and turns.
pub fn mode_shape(title: &str, links: &[LinkShape]) -> Figure {
    let places = || links.iter().flat_map(|link| &link.at_m);
    let size = places().fold(0.0, |most: f64, at| most.max(at[0].hypot(at[1])));
    let largest = links.iter().flat_map(|link| &link.displacement).map(|[u, w]| u.re.hypot(w.re)).fold(0.0, f64::max);
    let scale = if largest > 0.0 { LARGEST * size / largest } else { 0.0 };
    let title = format!("{title}; amplitude chosen for the picture");
    let mut figure = Figure::new(title, Axis::new("x", "m"), Axis::new("y", "m"));
    figure.equal_aspect = true;
    let [still, ahead, behind] = [0.0, scale, -scale].map(|scale| curve(links, scale));
    figure = figure.series("at rest", &still.0, &still.1, Mark::Dashes);
    figure.line("one way", &ahead.0, &ahead.1).line("the other way", &behind.0, &behind.1)
}

/// The links one after another, displaced by so many times the mode.
fn curve(links: &[LinkShape], scale: f64) -> (Vec<f64>, Vec<f64>) {
    links.iter().flat_map(|link| link_curve(link, scale)).map(|[x, y]| (x, y)).unzip()
}

fn link_curve(link: &LinkShape, scale: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = link.chord_rad.sin_cos();
    let fine = link.on_nodes(BETWEEN * link.at_m.len().saturating_sub(1) + 1);
    let displaced = |([x, y], displacement): (&[f64; 2], &[Complex<f64>; 2])| {
        let [along, across] = displacement.map(|part| scale * part.re);
        [x + along * cos - across * sin, y + along * sin + across * cos]
    };
    fine.at_m.iter().zip(&fine.displacement).map(displaced).collect()
}
