//! Warnings of a campaign before it computes anything: values that are refused, numbers that look like mistakes, runs whose steps are too
//! long for their loads.

use crate::cli::failure::CommandResult;
use crate::cli::formatting::counted;
use crate::cli::short_load::{ShortLoad, resistance};
use crate::cli::sudden_start::sudden_start;
use crate::cli::suspect_numbers::{newly_suspect, suspect_numbers};
use crate::scene::{Link, ModelKind, Scene, SceneSource};
use crate::shown::shown_sentence;
use crate::study::sweep::{Campaign, RefusedRuns, RefusedValue};

/// Runs of a large campaign whose steps are looked at.
const LOOKED_AT: u64 = 500;

/// Warns of listed values and bounds that their keys never allow, before anything is computed.
pub(super) fn warn_of_refused_values(campaign: &Campaign) {
    for RefusedValue { reason, runs } in campaign.refused_values() {
        let runs = match runs {
            RefusedRuns::Counted(count) => format!("its {}", counted(count, "run")),
            RefusedRuns::WithValue => "its runs".to_owned(),
            RefusedRuns::BetweenBounds => "runs with values that it does not allow".to_owned(),
        };
        say!("warning: {}; {runs} will be refused", shown_sentence(&reason));
    }
}

/// Warns of numbers that look like mistakes: those of the scene, and those of listed values and of bounds; of each key, the first in full.
pub(super) fn warn_of_suspect_numbers(campaign: &Campaign) -> CommandResult<()> {
    let spec = campaign.spec();
    // Without the campaign's pulses, so that a built-in scene is known by its name.
    let base = SceneSource::open(&spec.scene, &spec.set)?;
    suspect_numbers(&base).iter().chain(&sudden_start(&base.scene)).for_each(|warning| say!("warning: {warning}"));
    let with_values = || spec.axes.iter().flat_map(|axis| campaign.with_given_values(axis).flatten());
    if sudden_start(&base.scene).is_empty() {
        let first = with_values().map(|changed| sudden_start(&changed.scene)).find(|warnings| !warnings.is_empty());
        first.iter().flatten().for_each(|warning| say!("warning: {warning}"));
    }
    warn_of_single_elements(&base, campaign);
    warn_of_short_loads(&base, campaign);
    for axis in &spec.axes {
        let of_values = campaign.with_given_values(axis).flatten().map(|changed| newly_suspect(&base.scene, &changed.scene));
        let mut suspect = of_values.filter(|warnings| !warnings.is_empty());
        suspect.next().iter().flatten().for_each(|warning| say!("warning: {warning}"));
        let more = suspect.count() as u64;
        if more > 0 {
            say!("warning: likewise {} of {}", counted(more, "more value"), axis.key);
        }
    }
    Ok(())
}

/// Warns of links that bend, and of whose peaks only what stands at their pins is seen: in every run, or in those with that value.
fn warn_of_single_elements(base: &SceneSource, campaign: &Campaign) {
    let is_single = |scene: &Scene, name: &str| {
        let bends = |link: &Link| !link.rigid && scene.solver.model != ModelKind::Rigid;
        let is_meant = |link: &Link| link.name.as_str() == name && bends(link) && link.elements == 1;
        scene.chain().is_some_and(|chain| chain.links.iter().any(is_meant))
    };
    for link in base.scene.chain().iter().flat_map(|chain| &chain.links) {
        let (name, key) = (link.name.as_str(), format!("{}.elements", link.name.as_str()));
        let (which, way) = match campaign.spec().axes.iter().find(|axis| axis.key == key) {
            None if is_single(&base.scene, name) => {
                ("", format!("set = [\"{key}=8\"] in the campaign shows them between the pins"))
            }
            Some(axis) if campaign.with_given_values(axis).flatten().any(|changed| is_single(&changed.scene, name)) => {
                ("runs with ", "only runs with more show them between the pins".to_owned())
            }
            _ => continue,
        };
        say!(
            "warning: {which}{key} = 1: the peaks of {name}'s deflection, moment and stress are those at its pins alone, and one axial \
             and one shear force stand for its whole length: {way}"
        );
    }
}

/// Warns of runs whose steps are too long for the resistance on the slider: the first of some of them.
fn warn_of_short_loads(base: &SceneSource, campaign: &Campaign) {
    if resistance(&base.scene).is_none() {
        return;
    }
    let every = usize::try_from(campaign.runs() / LOOKED_AT).unwrap_or(usize::MAX).max(1);
    let warning = |run: u64| Some((run, ShortLoad::warning_of_step(&campaign.scene_of(run).ok()?.scene)?));
    if let Some((run, warning)) = (0..campaign.runs()).step_by(every).find_map(warning) {
        say!("warning: run {run}: {warning}");
    }
}
