//! Where the unknowns of a chain stand.
//!
//! The chain is a row of plane vectors, its *slots*, in such an order that every member touches neighbours only:
//!
//! ```text
//! flexible link   r₀ t₀ | r₁ t₁ | … | rₙ tₙ       the first of two: … | tₙ rₙ, so that its last position is the pin of
//! the next link   (pin) t₀ | r₁ t₁ | …            rigid link: p a, its first pin and the vector to its second pin
//! ```
//!
//! Slot 0 is the pivot. The vector after a link's first pin is polar (see [`super::polar`]). A rigid rod to a slider has no slot.

use crate::scene::{Chain, End};

/// The pivot.
pub(super) const PIVOT: usize = 0;
/// The first link's polar vector, which torque and prescribed motion act on.
pub(super) const ROOT: usize = 1;

/// Whether a slot's force is a force or a moment, or a pair of a held radius and an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A position: its unknowns take forces.
    Position,
    /// A tangent, or a rigid link's vector in polar coordinates: its unknowns take moments.
    Direction,
}

/// Numbers of slots and unknowns.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    /// Kinds of all slots.
    pub(super) kinds: Vec<Kind>,
    /// The unknown that is the root's angle, unless it is prescribed.
    pub(super) root: Option<usize>,
    /// End of the first link when it is the first of two.
    pub(super) pin: Option<usize>,
    /// The second link's polar vector.
    pub(super) second: Option<usize>,
    /// Where the last link ends, if it is flexible.
    pub(super) end: Option<usize>,
    /// `2 slot + component` of each unknown, in order.
    pub(super) active: Vec<usize>,
    /// `2 slot + component` of all others.
    pub(super) held: Vec<usize>,
    /// The unknown at each `2 slot + component`.
    unknowns: Vec<Option<usize>>,
}

impl Layout {
    /// For this chain, its root's angle prescribed or not.
    pub(super) fn new(chain: &Chain, prescribed: bool) -> Self {
        let slider = matches!(chain.end, End::Slider(_));
        let mut kinds = vec![Kind::Position, Kind::Direction];
        let mut held = vec![0, 1];
        let (mut pin, mut second, mut end) = (None, None, None);
        let mut start = PIVOT;
        for (number, link) in chain.links.iter().enumerate() {
            let last = number + 1 == chain.links.len();
            if number == 1 {
                start = kinds.len() - 1;
                pin = Some(start);
                if link.rigid && slider {
                    break;
                }
                second = Some(kinds.len());
                kinds.push(Kind::Direction);
            }
            if link.rigid {
                held.push(2 * (start + 1));
                continue;
            }
            for _ in 0..link.elements {
                kinds.extend([Kind::Position, Kind::Direction]);
            }
            if last {
                end = Some(kinds.len() - 2);
            } else {
                let slots = kinds.len();
                kinds.swap(slots - 2, slots - 1);
            }
        }
        if let (Some(end), true) = (end, slider) {
            held.push(2 * end + 1);
        }
        if prescribed {
            held.push(2 * ROOT + 1);
        }
        let active: Vec<usize> = (0..2 * kinds.len()).filter(|place| !held.contains(place)).collect();
        let root = active.iter().position(|place| *place == 2 * ROOT + 1);
        let mut unknowns = vec![None; 2 * kinds.len()];
        active.iter().enumerate().for_each(|(unknown, place)| unknowns[*place] = Some(unknown));
        Self { kinds, root, pin, second, end, active, held, unknowns }
    }

    /// The unknown that stands at `2 slot + component`.
    pub(super) fn unknown(&self, place: usize) -> Option<usize> {
        self.unknowns[place]
    }

    /// Number of slots.
    pub(super) fn slots(&self) -> usize {
        self.kinds.len()
    }
}
