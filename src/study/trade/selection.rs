//! The families of configurations that suit a scene and are selected.

use super::configuration::{Axial, Family};
use crate::scene::{IntegratorKind, Link, ModelKind, Scene};
use crate::simulation::Simulation;
use crate::study::{MATTERS, shortenings};

/// The selected families; an empty list selects everything that suits.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Selection {
    /// Models.
    pub models: Vec<ModelKind>,
    /// Integrators.
    pub integrators: Vec<IntegratorKind>,
    /// Elements a link, even, for `finite-element`.
    pub elements: Vec<usize>,
    /// Modes a link, for `modal`.
    pub modes: Vec<usize>,
    /// Steps, s.
    pub steps_s: Vec<f64>,
    /// Whether links are made rigid one by one, too.
    pub link_by_link: bool,
}

const MODELS: [ModelKind; 4] = [ModelKind::Rigid, ModelKind::Incremental, ModelKind::Modal, ModelKind::FiniteElement];
const MODES: [usize; 4] = [1, 2, 3, 4];
const ELEMENTS: [usize; 4] = [2, 4, 8, 16];

impl Selection {
    /// Families that can compute the scene, the cheaper before the dearer. Links stretch, too, where their loads shorten them by more
    /// than the tolerance `enough`, or a tenth, of their deflection.
    pub(super) fn families(&self, scene: &Scene, enough: Option<f64>) -> Vec<Family> {
        let mut families = Vec::new();
        for model in MODELS.into_iter().filter(|model| asked(&self.models, *model)) {
            let sizes: &[usize] = match model {
                ModelKind::Modal => or(&self.modes, &MODES),
                ModelKind::FiniteElement => or(&self.elements, &ELEMENTS),
                _ => &[0],
            };
            for (rigid, axial) in self.patterns(scene, model, enough) {
                for integrator in model.integrators().iter().filter(|integrator| asked(&self.integrators, **integrator)) {
                    let family = |size: &usize| {
                        let (rigid, axial) = (rigid.clone(), axial.clone());
                        Family { model, integrator: *integrator, resolution: *size, rigid, axial }
                    };
                    families.extend(sizes.iter().map(family));
                }
            }
        }
        families.retain(|family| suits(family, scene));
        families
    }

    /// Patterns of rigid and of stretching links: the scene's own, with more rigid links if selected; and of all these those with links that
    /// stretch because their loads would shorten them too much otherwise.
    fn patterns(&self, scene: &Scene, model: ModelKind, enough: Option<f64>) -> Vec<(Vec<bool>, Vec<Axial>)> {
        let Some(chain) = scene.chain() else { return Vec::new() };
        let asked: Vec<bool> = chain.links.iter().map(|link| link.rigid).collect();
        let meshed = matches!(model, ModelKind::Modal | ModelKind::FiniteElement);
        let mut patterns = vec![asked.clone()];
        if self.link_by_link && meshed && asked == [false, false] {
            patterns.splice(0..0, [vec![true, false], vec![false, true]]);
        }
        let own = Axial::of(chain);
        let mut patterns: Vec<_> = patterns.into_iter().map(|rigid| (rigid, own.clone())).collect();
        if model == ModelKind::Modal {
            let shortened = shortenings(scene).unwrap_or_default();
            let part = enough.unwrap_or(MATTERS).min(MATTERS);
            let is_short = |link: &Link| shortened.iter().any(|shortened| shortened.link == link.name && shortened.exceeds(part));
            let stretching = |(rigid, axial): &(Vec<bool>, Vec<Axial>)| {
                let links = chain.links.iter().zip(rigid).zip(axial);
                let axial: Vec<Axial> =
                    links.map(|((link, rigid), own)| if !rigid && is_short(link) { Axial::Added } else { *own }).collect();
                (rigid.clone(), axial)
            };
            let added: Vec<_> = patterns.iter().map(stretching).filter(|(_, axial)| axial.contains(&Axial::Added)).collect();
            patterns.extend(added);
        }
        patterns
    }
}

/// Flexible models need a flexible link; otherwise `rigid` gives the same for less.
fn suits(family: &Family, scene: &Scene) -> bool {
    let all_rigid = family.rigid.iter().all(|rigid| *rigid);
    let redundant = all_rigid && matches!(family.model, ModelKind::Modal | ModelKind::Incremental);
    let incremental_with_rigid = family.model == ModelKind::Incremental && family.rigid.contains(&true);
    !redundant && !incremental_with_rigid && Simulation::new(&family.scene(scene, scene.solver.step_s)).is_ok()
}

fn asked<T: PartialEq>(list: &[T], item: T) -> bool {
    list.is_empty() || list.contains(&item)
}

fn or<'a>(list: &'a [usize], usual: &'a [usize]) -> &'a [usize] {
    if list.is_empty() { usual } else { list }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    #[test]
    fn regress_links_stretch_where_they_shorten_by_more_than_the_tolerance() {
        let stiff = ["rod.axial=false", "crank.axial=false", "rod.section.height_m=0.03"].map(str::to_owned);
        let scene = SceneSource::open("crank-slider", &stiff).unwrap().scene;
        let selection = Selection {
            models: vec![ModelKind::Modal],
            integrators: vec![IntegratorKind::Esdirk],
            modes: vec![1],
            ..Selection::default()
        };
        // The rod shortens by a thousandth of its deflection, the crank by half of that.
        for (enough, rods) in [(None, 0), (Some(2e-3), 0), (Some(8e-4), 1)] {
            let families = selection.families(&scene, enough);
            let stretching = families.iter().filter(|family| family.axial[1] == Axial::Added);
            assert_eq!((stretching.count(), families.len()), (rods, 1 + rods), "{enough:?}");
        }
    }
}
