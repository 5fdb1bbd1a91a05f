//! Nodes and tangents from the shape of another model's links.
//!
//! The membrane is a thousand times stiffer than bending: positions and directions taken from a line that is not quite of the same
//! length would make strains, and those would ring. So each element gets the strain that the link has in the mean, ε, at all three
//! points of Simpson's rule, which hold the whole membrane energy (`beam`): `|t₁| = |t₂| = |r′(½)| = 1 + ε`, and Simpson's rule for
//! the slope, which is exact for a cubic, gives the next node, `r₂ = r₁ + ℓ (t₁ + 4 r′(½) + t₂)/6`. Directions are the line's own, that of
//! the middle as its nodes ask for: `r′(½) ∝ 3(r₂ − r₁)/(2ℓ) − (t₁ + t₂)/4`.

use nalgebra::Vector2;

use super::FiniteElement;
use super::member::{Member, windows};
use crate::mechanics::chain_model::{LinkShape, ShapePoint};
use crate::mechanics::mechanism::Input;
use crate::scene::End;

/// Tangents at both ends of an element and the vector between them, in the frame of the chord.
struct Step {
    tangents: [Vector2<f64>; 2],
    along: Vector2<f64>,
}

impl Step {
    fn new(ends: &[ShapePoint; 2], stretch: f64, length_m: f64) -> Self {
        let strained = |direction: Vector2<f64>| direction * ((1.0 + stretch) / direction.norm());
        let tangents = ends.map(|end| strained(end.slope.into()));
        let [from, to]: [Vector2<f64>; 2] = ends.map(|end| end.position_m.into());
        let both = tangents[0] + tangents[1];
        let middle = strained((to - from) * (1.5 / length_m) - both * 0.25);
        Self { tangents, along: (both + middle * 4.0) * (length_m / 6.0) }
    }
}

fn steps(shape: &LinkShape, length_m: f64) -> impl Iterator<Item = Step> {
    shape.nodes.array_windows().map(move |ends| Step::new(ends, shape.stretch, length_m))
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
                    let element_m = length_m / elements as f64;
                    let chord: Vector2<f64> = steps(shape, element_m).map(|step| step.along).sum();
                    let start = steps(shape, element_m).next().map_or(0.0, |step| angle(&step.tangents[0]));
                    let turned = match (root, &self.chain.end) {
                        (Some(root), _) => root - start,
                        (None, End::Slider(_)) if i + 1 == self.members.len() => (-pin.y / chord.norm()).asin() - angle(&chord),
                        _ => shape.chord_rad - angle(&chord),
                    };
                    let (sin, cos) = turned.sin_cos();
                    let turn = |x: Vector2<f64>| Vector2::new(cos * x.x - sin * x.y, sin * x.x + cos * x.y);
                    for (window, step) in windows(first, elements, swapped).zip(steps(shape, element_m)) {
                        let [one, other] = step.tangents.map(turn);
                        let next = pin + turn(step.along);
                        window.set(&mut self.motion.p, [pin, one, next, other]);
                        pin = next;
                    }
                    self.motion.set_polar(first + 1, Vector2::new(1.0 + shape.stretch, turned + start));
                }
                Member::Rigid { first, .. } => {
                    let angle = root.unwrap_or(shape.chord_rad);
                    self.motion.p[first + 1] = Vector2::new(angle.cos(), angle.sin()) * length_m;
                    self.motion.set_polar(first + 1, Vector2::new(length_m, angle));
                    pin += self.motion.p[first + 1];
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
