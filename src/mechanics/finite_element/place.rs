//! Nodes and tangents from the shape of another model's links.
//!
//! The membrane is a thousand times stiffer than bending: positions and directions taken from a line that is not quite of the same
//! length would make strains, and those would ring. So each element gets the strain that the link has in the mean, ε, at all three
//! points of Simpson's rule, which hold the whole membrane energy (`beam`): `|t₁| = |t₂| = 1 + ε`, `|r′(½)| = 1 + ε + 3/160 |c|²`, and
//! Simpson's rule for the slope, which is exact for a cubic, gives the next node, `r₂ = r₁ + ℓ (t₁ + 4 r′(½) + t₂)/6`. Directions are the
//! line's own, that of the middle as its nodes ask for: `r′(½) ∝ 3(r₂ − r₁)/(2ℓ) − (t₁ + t₂)/4`. At the pivot `|t₁| = 1 + ε + g` (`hub`).

use nalgebra::Vector2;

use super::FiniteElement;
use super::hub;
use super::member::{Member, windows};
use super::strain::Middle;
use crate::mechanics::chain_line::{LinkShape, ShapePoint};
use crate::mechanics::mechanism::Input;
use crate::scene::End;

/// Tangents at both ends of an element and the vector between them, in the frame of the chord.
struct Step {
    tangents: [Vector2<f64>; 2],
    along: Vector2<f64>,
}

impl Step {
    fn new(ends: &[ShapePoint; 2], stretch: f64, length_m: f64, at_hub: bool) -> Self {
        let strained = |direction: Vector2<f64>, shift: f64| direction * ((1.0 + stretch + shift) / direction.norm());
        let mut tangents = ends.map(|end| strained(end.slope.into(), 0.0));
        let [from, to]: [Vector2<f64>; 2] = ends.map(|end| end.position_m.into());
        let mut middle = strained((to - from) * (1.5 / length_m) - (tangents[0] + tangents[1]) * 0.25, 0.0);
        // c follows the lengths, which follow c by a few hundredths of its own change.
        for _ in 0..4 {
            let both = tangents[0] + tangents[1];
            let c = (middle * 2.0 - both) * (2.0 / 3.0);
            middle = strained(middle, Middle::shift(&c));
            if at_hub {
                tangents[0] = strained(tangents[0], hub::shift(&(tangents[1] - tangents[0]), &c));
            }
        }
        Self { tangents, along: (tangents[0] + tangents[1] + middle * 4.0) * (length_m / 6.0) }
    }
}

/// A link's length and elements, and whether it is the one at the pivot.
#[derive(Debug, Clone, Copy)]
struct Line {
    length_m: f64,
    elements: usize,
    at_pivot: bool,
}

/// The link's elements, with so much bow added as turns the first tangent by `bow_rad` and leaves the chord: the static shape of a moment
/// at the first end, `y = bow L (ξ − 3ξ²/2 + ξ³/2)`.
fn steps(shape: &LinkShape, line: Line, bow_rad: f64) -> impl Iterator<Item = Step> {
    let Line { length_m, elements, at_pivot } = line;
    let bowed = move |point: ShapePoint| {
        let ShapePoint { xi, position_m: [x, y], slope: [dx, dy], .. } = point;
        let (sin, cos) = (bow_rad * (1.0 + xi * (1.5 * xi - 3.0))).sin_cos();
        let y = y + bow_rad * length_m * xi * (1.0 - xi) * (1.0 - 0.5 * xi);
        ShapePoint { position_m: [x, y], slope: [cos * dx - sin * dy, sin * dx + cos * dy], ..point }
    };
    let element_m = length_m / elements as f64;
    let each = shape.nodes.array_windows().enumerate();
    each.map(move |(k, ends)| Step::new(&ends.map(bowed), shape.stretch, element_m, at_pivot && k == 0))
}

/// Angles of the first tangent and of the chord, and the chord's length.
fn ends(steps: impl Iterator<Item = Step>) -> [f64; 3] {
    let (mut first, mut chord) = (None, Vector2::zeros());
    for step in steps {
        first.get_or_insert(step.tangents[0]);
        chord += step.along;
    }
    [first.as_ref().map_or(0.0, angle), angle(&chord), chord.norm()]
}

fn angle(vector: &Vector2<f64>) -> f64 {
    vector.y.atan2(vector.x)
}

impl FiniteElement {
    /// Sets positions and tangents of all slots.
    pub(super) fn place(&mut self, input: &Input, shapes: &[LinkShape]) {
        let mut pin: Vector2<f64> = Vector2::zeros();
        for (i, shape) in shapes.iter().enumerate() {
            let root = input.motion.filter(|_| i == 0).map(|[angle, ..]| angle);
            let length_m = self.chain.links[i].length_m;
            match &self.members[i] {
                Member::Flexible { first, elements, swapped, .. } => {
                    let (first, elements, swapped) = (*first, *elements, *swapped);
                    let closes = self.slides() && i + 1 == shapes.len();
                    let line = Line { length_m, elements, at_pivot: i == 0 };
                    let placed = Placed::new(shape, line, root, closes.then_some(pin.y));
                    for (window, step) in windows(first, elements, swapped).zip(placed.steps(shape, line)) {
                        let next = pin + step.along;
                        window.set(&mut self.motion.p, [pin, step.tangents[0], next, step.tangents[1]]);
                        pin = next;
                    }
                    let stretched = self.motion.p[first + 1].norm();
                    self.motion.set_polar(first + 1, Vector2::new(stretched, placed.tangent_rad));
                }
                Member::Rigid { first, .. } => {
                    let angle = root.unwrap_or(shape.chord_rad);
                    let along = Vector2::new(angle.cos(), angle.sin()) * length_m;
                    self.motion.p[first + 1] = along;
                    self.motion.set_polar(first + 1, Vector2::new(length_m, angle));
                    pin += along;
                }
                Member::Guided { .. } => {}
            }
        }
        if let (Some(end), true) = (self.layout.end, self.slides()) {
            self.motion.p[end].y = 0.0;
        }
    }

    /// Whether the chain's end slides.
    pub(super) fn slides(&self) -> bool {
        matches!(self.chain.end, End::Slider(_))
    }
}

/// A link's shape, bowed and turned to where it belongs.
struct Placed {
    bow_rad: f64,
    turn_rad: f64,
    /// Angle of the first tangent, whole turns counted.
    tangent_rad: f64,
}

impl Placed {
    /// The chord stands as the shape has it; a prescribed tangent `root` bows the link; an end that slides turns it, so that from a
    /// pin at this height it reaches y = 0.
    fn new(shape: &LinkShape, line: Line, root: Option<f64>, slides_from: Option<f64>) -> Self {
        let [mut tangent, mut chord, chord_m] = ends(steps(shape, line, 0.0));
        let mut bow_rad = 0.0;
        if let Some(root) = root {
            bow_rad = root - shape.chord_rad - (tangent - chord);
            [tangent, chord, _] = ends(steps(shape, line, bow_rad));
        }
        let chord_rad = slides_from.map_or(shape.chord_rad, |y| (-y / chord_m).asin());
        let turn_rad = chord_rad - chord;
        Self { bow_rad, turn_rad, tangent_rad: root.unwrap_or(turn_rad + tangent) }
    }

    fn steps(&self, shape: &LinkShape, line: Line) -> impl Iterator<Item = Step> {
        let (sin, cos) = self.turn_rad.sin_cos();
        let turn = move |x: Vector2<f64>| Vector2::new(cos * x.x - sin * x.y, sin * x.x + cos * x.y);
        let turned = move |step: Step| Step { tangents: step.tangents.map(turn), along: turn(step.along) };
        steps(shape, line, self.bow_rad).map(turned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element placed on a line whose curvature grows, turned by half a radian, has the link's strain at its nodes and in its middle, by
    /// the measures of `beam` and `hub`.
    #[test]
    fn val_a_placed_element_is_strained_alike_in_all_its_points() {
        const STRETCH: f64 = 3e-4;
        let at = |xi: f64| {
            let (sin, cos) = (0.5 * xi * xi).sin_cos();
            ShapePoint { xi, position_m: [xi - xi.powi(5) / 40.0, xi.powi(3) / 6.0], slope: [cos, sin], ..ShapePoint::default() }
        };
        for at_hub in [false, true] {
            let step = Step::new(&[at(0.0), at(1.0)], STRETCH, 1.0, at_hub);
            let (b, c) = (step.tangents[1] - step.tangents[0], step.along * 2.0 - step.tangents[0] - step.tangents[1]);
            let middle = (step.along + c * 0.25).norm() - 1.0 - Middle::shift(&c);
            let [first, last] = step.tangents.map(|tangent| tangent.norm() - 1.0);
            let shift = if at_hub { hub::shift(&b, &c) } else { 0.0 };
            assert!(Middle::shift(&c) > 1e-5 && hub::shift(&b, &c).abs() > 1e-5, "the line says nothing of the shifts");
            for strain in [first - shift, middle, last] {
                assert!((strain - STRETCH).abs() < 1e-12, "{strain}");
            }
        }
    }
}
