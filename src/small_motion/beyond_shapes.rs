//! Vibrations that a link of few bending shapes has too high.

use serde::{Deserialize, Serialize};

use super::linearised::tangent;
use super::mode::{Kind, Mode};
use super::point::Point;
use super::subject::Subject;
use crate::mechanics::Weights;
use crate::scene::ModelKind;

/// Part of a vibration's strain energy in the shape of a moment at its link's root from which it is named: it has 0.97 or more, those that
/// are right within some percent have 0.45 or less.
const STANDS_IN: f64 = 0.9;

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

/// Those among the modes of `modal` about a point. Where the crank is held, such a frequency is right within some percent.
///
/// The crank has a shape χ beside its sines, of a moment at its root (`modal/shapes.rs`), which takes what is left of all higher sines.
/// Shapes are orthogonal in stiffness, so that `K_χχ |φ_χ|² / Σ Kᵢᵢ |φᵢ|²` is its part of a mode's strain energy.
pub fn beyond_shapes(subject: &Subject, point: &Point, modes: &[Mode]) -> Vec<BeyondShapes> {
    let chain = subject.chain().filter(|_| subject.model() == ModelKind::Modal && !subject.is_held());
    let Some(chain) = chain else { return Vec::new() };
    let mut mechanism = subject.mechanism();
    let names = mechanism.coordinates();
    let position = Weights { acceleration: 0.0, velocity: 0.0, position: 1.0 };
    let stiffness = tangent(mechanism.as_mut(), point, position);
    let diagonal: Vec<f64> = stiffness.iter().filter(|(i, j, _)| i == j).map(|(_, _, value)| value).collect();
    let mut found = Vec::new();
    for link in &chain.links {
        let root = format!("{}_root_bending_m", link.name.as_str());
        let Some(root) = names.iter().position(|name| name.name == root) else { continue };
        let stands_in = |mode: &&Mode| {
            let energies = || diagonal.iter().zip(mode.shape.iter()).map(|(stiffness, x)| stiffness * x.norm_sqr());
            let is_vibration = matches!(mode.kind, Kind::Vibration(_)) && mode.eigenvalue.im > 0.0;
            is_vibration && energies().nth(root).is_some_and(|own| own > STANDS_IN * energies().sum::<f64>())
        };
        let named = modes.iter().filter(stands_in).map(|mode| BeyondShapes {
            mode: mode.name(),
            link: link.name.as_str().to_owned(),
            shapes: link.modes,
        });
        found.extend(named);
    }
    found
}
