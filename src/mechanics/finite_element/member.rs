//! The links as the equations of motion see them, each with its slots.

use super::beam::Beam;
use super::layout::{Layout, PIVOT};
use super::motion::Window;
use super::rigid::{self, GuidedRod, Masses};
use crate::scene::{Chain, End, Link};

/// A link.
#[derive(Debug, Clone)]
pub(super) enum Member {
    /// Equal beam elements, the first with its first pin in slot `first`.
    Flexible {
        /// Each of them.
        beam: Beam,
        /// Slot of the link's first pin.
        first: usize,
        /// Number of elements.
        elements: usize,
        /// Whether the last element's last two slots stand in the other order.
        swapped: bool,
    },
    /// A rigid link whose first pin is in slot `first` and whose vector is in the slot after.
    Rigid {
        /// Slot of the link's first pin.
        first: usize,
        /// Its masses.
        masses: Masses,
    },
    /// A rigid rod to a slider, whose first pin is in slot `first`.
    Guided {
        /// Slot of the crank pin.
        first: usize,
        /// The rod.
        rod: GuidedRod,
    },
}

impl Member {
    /// The chain's links.
    pub(super) fn all(chain: &Chain, layout: &Layout) -> Vec<Self> {
        let starts = [Some(PIVOT), layout.pin].into_iter().flatten();
        let count = chain.links.len();
        starts.zip(&chain.links).enumerate().map(|(i, (first, link))| Self::new(link, first, i + 1 == count, chain)).collect()
    }

    fn new(link: &Link, first: usize, last: bool, chain: &Chain) -> Self {
        if let (false, Some(bar)) = (link.rigid, &link.bar) {
            let beam = Beam::new(link.length_m / link.elements as f64, bar, link.damping_s);
            return Self::Flexible { beam, first, elements: link.elements, swapped: !last };
        }
        let masses = rigid::masses(link);
        match chain.end {
            End::Slider(_) if last && first != PIVOT => {
                Self::Guided { first, rod: GuidedRod { length_m: link.length_m, masses } }
            }
            End::Free { tip_mass_kg } if last => Self::Rigid { first, masses: rigid::with_tip(masses, tip_mass_kg) },
            _ => Self::Rigid { first, masses },
        }
    }
}

/// The windows of a flexible link's elements.
pub(super) fn windows(first: usize, elements: usize, swapped: bool) -> impl Iterator<Item = Window> {
    (0..elements).map(move |k| Window { first: first + 2 * k, swapped: swapped && k + 1 == elements })
}

/// The window of a flexible link's first element, if the link is the one at the pivot.
pub(super) fn hub(first: usize, elements: usize, swapped: bool) -> Option<Window> {
    windows(first, elements, swapped).next().filter(|window| window.at_hub())
}
