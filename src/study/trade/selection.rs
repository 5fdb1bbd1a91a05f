//! The families of configurations that suit a scene and are selected.

use super::configuration::{Family, is_rigid, rigid_links};
use crate::scene::{IntegratorKind, ModelKind, Scene, System};
use crate::simulation::Simulation;
use crate::study::{Shortening, shortenings};

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
/// Stretching changes the frequency of a vibration. Over some periods, the error adds up to this many times the part by which links shorten:
/// two links with a mass at the tip shortened by 0.2 % of their deflection, which erred by 1.8 %.
const PERIODS: f64 = 10.0;

impl Selection {
    /// Families that can compute the scene, the cheaper before the dearer. `modal` has up to three patterns of links that stretch: none,
    /// if one does in the scene; the scene's own; and all, if its loads shorten a link that does not stretch there by so much that it
    /// matters, or by more than a tenth of the tolerance `enough` of its deflection. Where loads shorten links by the tolerance, those
    /// patterns come first in which most stretch.
    ///
    /// Where no link bends, there is `rigid`, or else one mesh.
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
        // A longer step may be refused: Runge–Kutta's must be short where links stretch.
        let step_s = self.steps_s.iter().copied().fold(scene.solver.step_s, f64::min);
        families.retain(|family| suits(family, scene, step_s));
        without_repetition(families)
    }

    /// Patterns of rigid and of stretching links: the scene's own rigid links, with more of them if selected.
    fn patterns(&self, scene: &Scene, model: ModelKind, enough: Option<f64>) -> Vec<(Vec<bool>, Vec<bool>)> {
        let Some(chain) = scene.chain() else { return Vec::new() };
        let asked = rigid_links(chain);
        let meshed = matches!(model, ModelKind::Modal | ModelKind::FiniteElement);
        let mut patterns = vec![asked.clone()];
        if self.link_by_link && meshed && asked == [false, false] {
            patterns.splice(0..0, [vec![true, false], vec![false, true]]);
        }
        let own: Vec<bool> = chain.links.iter().map(|link| link.axial).collect();
        let mut stretching = vec![own.clone()];
        if model == ModelKind::Modal {
            if own.contains(&true) {
                stretching.insert(0, vec![false; own.len()]);
            }
            let shortened = shortened(scene, &own);
            if shorten(&shortened, enough.map(|enough| enough / PERIODS)) {
                stretching.push(vec![true; own.len()]);
            }
            // A budget that ends early then leaves out what does not suffice.
            let unstretched = own.contains(&true).then(|| self::shortened(scene, &vec![false; own.len()]));
            if shorten(unstretched.as_ref().unwrap_or(&shortened), enough) {
                stretching.reverse();
            }
        }
        let among_rigid = |rigid: Vec<bool>| {
            let stretch = |axial: &Vec<bool>| -> Vec<bool> {
                let links = axial.iter().zip(&own).zip(&rigid);
                links.map(|((axial, own), rigid)| if *rigid { *own } else { *axial }).collect()
            };
            let mut patterns: Vec<_> = stretching.iter().map(stretch).map(|axial| (rigid.clone(), axial)).collect();
            patterns.dedup();
            patterns
        };
        patterns.into_iter().flat_map(among_rigid).collect()
    }
}

/// The shortening of links that do not stretch, where those stretch that are `axial`.
fn shortened(scene: &Scene, axial: &[bool]) -> Vec<Shortening> {
    let mut scene = scene.clone();
    if let System::Chain(chain) = &mut scene.system {
        for (link, axial) in chain.links.iter_mut().zip(axial) {
            (link.rigid, link.axial) = (is_rigid(link), *axial);
        }
    }
    shortenings(&scene).unwrap_or_default()
}

/// Whether one of them matters, or is more than a part `enough` of the link's deflection.
fn shorten(shortened: &[Shortening], enough: Option<f64>) -> bool {
    shortened.iter().any(|link| link.matters() || enough.is_some_and(|enough| link.exceeds(enough)))
}

/// Leaves out finite elements without a flexible link: `rigid` gives the same for less. If nothing else remains, one mesh does.
fn without_repetition(families: Vec<Family>) -> Vec<Family> {
    let has_rigid = families.iter().any(|family| family.model == ModelKind::Rigid);
    let mut kept: Vec<Family> = Vec::new();
    for family in families {
        let is_same = |other: &Family| (other.model, other.integrator) == (family.model, family.integrator);
        let repeats = family.model != ModelKind::Rigid && family.is_rigid() && (has_rigid || kept.iter().any(is_same));
        if !repeats {
            kept.push(family);
        }
    }
    kept
}

/// Whether the scene takes a family. `modal` and `incremental` need a flexible link; otherwise `rigid` gives the same for less. A scene
/// of fixed cost whose own steps need no correction says nothing of the number that others need.
fn suits(family: &Family, scene: &Scene, step_s: f64) -> bool {
    let redundant = family.is_rigid() && matches!(family.model, ModelKind::Modal | ModelKind::Incremental);
    let incremental_with_rigid = family.model == ModelKind::Incremental && family.rigid.contains(&true);
    let family_scene = family.scene(scene, step_s);
    let uncorrected = family_scene.solver.iterates() && family_scene.solver.corrections == Some(0);
    !redundant && !incremental_with_rigid && !uncorrected && Simulation::new(&family_scene).is_ok()
}

fn asked<T: PartialEq>(list: &[T], item: T) -> bool {
    list.is_empty() || list.contains(&item)
}

fn or<'a>(list: &'a [usize], usual: &'a [usize]) -> &'a [usize] {
    if list.is_empty() { usual } else { list }
}

#[cfg(test)]
mod tests {
    use super::super::configuration::Configuration;
    use super::*;
    use crate::scene::SceneSource;

    /// The links that stretch in families of the default scene with `overrides`.
    fn stretching(overrides: &[&str], enough: Option<f64>) -> Vec<Vec<bool>> {
        let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
        let scene = SceneSource::open("crank-slider", &overrides).unwrap().scene;
        let selection = Selection {
            models: vec![ModelKind::Modal],
            integrators: vec![IntegratorKind::Esdirk],
            modes: vec![1],
            ..Selection::default()
        };
        selection.families(&scene, enough).into_iter().map(|family| family.axial).collect()
    }

    #[test]
    fn regress_links_stretch_where_they_shorten_by_more_than_the_tolerance() {
        let stiff = ["rod.axial=false", "crank.axial=false", "rod.section.height_m=0.03"];
        let [none, all] = [[false; 2], [true; 2]];
        // The rod shortens by a thousandth of its deflection, the crank by half of that.
        assert_eq!(stretching(&stiff, None), [none]);
        assert_eq!(stretching(&stiff, Some(2e-2)), [none]);
        assert_eq!(stretching(&stiff, Some(2e-3)), [none, all]);
        assert_eq!(stretching(&stiff, Some(8e-4)), [all, none]);
    }

    #[test]
    fn regress_links_stretch_where_they_change_a_short_stroke() {
        // The rod shortens by a two-hundredth of its deflection, and by more than a thousandth of the crank's length.
        let short = ["crank.length_m=0.1", "crank.rigid=true", "rod.axial=false", "slider.mass_kg=5", "pulse.0.torque_nm=3"];
        assert_eq!(stretching(&short, None), [[true, true], [true, false]]);
    }

    #[test]
    fn regress_a_chain_that_does_not_bend_is_computed_once() {
        let scene = SceneSource::open("thesis-compressor", &[]).unwrap().scene;
        let names = |models: &[ModelKind]| -> Vec<String> {
            let integrators = vec![IntegratorKind::TwoPoint, IntegratorKind::Esdirk];
            let selection = Selection { models: models.to_vec(), integrators, ..Selection::default() };
            selection.families(&scene, None).iter().map(ToString::to_string).collect()
        };
        let rigid = ["rigid, two-point", "rigid, esdirk"];
        assert_eq!(names(&[]), rigid);
        assert_eq!(names(&[ModelKind::Rigid, ModelKind::FiniteElement]), rigid);
        let alone = ["finite-element, two-point, rigid links", "finite-element, esdirk, rigid links"];
        assert_eq!(names(&[ModelKind::FiniteElement]), alone);
        assert_eq!(names(&[ModelKind::Modal]), Vec::<String>::new());
    }

    /// `incremental` was measured on scenes that start bent, with the start of straight links; the scene refused it once it was chosen.
    #[test]
    fn prop_every_setting_is_one_that_the_scene_takes() {
        let bent = "start.static_equilibrium=true";
        let selection = Selection { link_by_link: true, ..Selection::default() };
        for (name, overrides) in [
            ("crank-slider", &[][..]),
            ("crank-slider", &[bent]),
            ("crank-slider", &[bent, "gravity.y_m_per_s2=-9.81", "pulse=[]"]),
            ("crank-slider", &["rod.rigid=true"]),
            ("crank-slider", &["solver.corrections=2"]),
            ("crank-slider", &["solver.integrator=runge-kutta", "solver.step_s=1e-5", "solver.corrections=0"]),
            ("crank-slider", &["slider.resistance_table=[[0,0],[3,10]]"]),
            ("crank-slider", &["base.torsion_spring_nm_per_rad=10", "base.damper_nm_s_per_rad=1"]),
            ("crank-slider", &["pulse=[]", "drive.speed_rad_per_s=3"]),
            ("thesis-crank-slider", &[]),
            ("thesis-compressor", &[]),
            ("thesis-beam", &[]),
            ("thesis-beam-tip", &[]),
            ("ref-r1", &[]),
            ("ref-r2", &[]),
            ("ref-r3", &[]),
            ("ref-r4m", &[]),
            ("ref-r5-tip", &[bent, "gravity.y_m_per_s2=-9.81"]),
        ] {
            let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
            let scene = SceneSource::open(name, &overrides).unwrap().scene;
            for family in selection.families(&scene, Some(1e-3)) {
                let setting = Configuration { family, step_s: 1e-4 };
                let keys = setting.keys(&scene);
                let taken = SceneSource::open(name, &[&overrides[..], &keys].concat());
                assert!(taken.is_ok(), "{name} {overrides:?}, {setting}: {taken:?}");
            }
        }
    }

    #[test]
    fn regress_links_that_stretch_in_the_scene_are_tried_without() {
        assert_eq!(stretching(&[], None), [[false; 2], [true; 2]]);
        assert_eq!(stretching(&["crank.rigid=true"], None), [[true, false], [true; 2]]);
        assert_eq!(stretching(&["crank.rigid=true", "rod.axial=false"], None), [[true, false]]);
    }
}
