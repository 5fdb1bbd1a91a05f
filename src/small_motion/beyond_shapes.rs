//! Vibrations that a link of few bending shapes has too high.

use serde::{Deserialize, Serialize};

use super::mode::{Kind, Mode};
use super::parts::Part;
use super::subject::Subject;
use crate::scene::ModelKind;

/// A vibration that stands for all those which the bending shapes of its link cannot take.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BeyondShapes {
    /// The mode's name.
    pub mode: String,
    /// The scene's name of the link.
    pub link: String,
    /// Bending shapes of the link.
    pub shapes: usize,
}

/// Those among the lowest modes of `modal`. Where the crank is held, such a frequency is right within some percent.
///
/// A base spring adds a vibration to those of the first link, whichever part it is named after. Modes that only decay do not count: a
/// strong damper at the pivot makes one of a vibration.
pub fn beyond_shapes(subject: &Subject, modes: &[Mode]) -> Vec<BeyondShapes> {
    let chain = subject.chain().filter(|_| subject.model() == ModelKind::Modal && !subject.is_held());
    let links = chain.iter().flat_map(|chain| &chain.links).enumerate();
    links
        .flat_map(|(number, link)| {
            let is_sprung = number == 0 && subject.has_base_spring();
            let is_own = move |mode: &&Mode| match mode.kind {
                Kind::Vibration(part) => part == Part::Bending(link.name) || is_sprung && part == Part::Base,
                _ => false,
            };
            let own = modes.iter().filter(is_own).filter(|mode| mode.eigenvalue.im > 0.0);
            own.skip(link.modes + usize::from(is_sprung)).map(|mode| BeyondShapes {
                mode: mode.name(),
                link: link.name.as_str().to_owned(),
                shapes: link.modes,
            })
        })
        .collect()
}
