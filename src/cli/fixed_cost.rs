//! `run --fixed-cost`: finds the corrections that suffice, and sets them in the scene.

use super::failure::{CommandResult, Failure};
use super::progress::elapsed;
use super::run_conclusion::step_remedy;
use crate::scene::SceneSource;
use crate::study::fixed_cost::{NotRated, rate};

/// The scene with steps of fixed cost; prints how many corrections suffice, and what they add to the error.
pub(super) fn with_fixed_cost(source: &SceneSource) -> CommandResult<SceneSource> {
    let refused = |problem: &str| Err(Failure::Usage(format!("--fixed-cost: {}: {problem}", source.origin)));
    if source.scene.solver.corrections.is_some() {
        return refused("the scene names solver.corrections: leave one of them out");
    }
    if !source.scene.levels.is_empty() {
        return refused("the scene has [[level]] tables: name solver.corrections in the scene and in their changes");
    }
    let bar = elapsed("finding how many corrections suffice");
    let rating =
        rate(&source.scene, &mut |corrections| bar.set_message(format!("finding how many corrections suffice: {corrections}")));
    bar.finish_and_clear();
    let rating = rating.map_err(|not| match not {
        NotRated::Build(refused) => source.refusal(refused.key, refused.to_string()).into(),
        NotRated::Diverged(_) => Failure::Diverged(diverged(source, &not)),
        NotRated::Still { .. } => Failure::Usage(format!("--fixed-cost: {}: {not}", source.origin)),
        other => Failure::Failed(format!("--fixed-cost: {}: {other}", source.origin)),
    })?;
    let keys = rating.keys();
    say!("{rating}: --set {}", keys.join(" --set "));
    Ok(source.with(&keys)?)
}

/// The words of a run that diverged, with its remedy.
fn diverged(source: &SceneSource, why: &NotRated) -> String {
    let remedy = step_remedy(std::iter::once(&source.scene)).map(|remedy| format!("\n{remedy}"));
    format!("--fixed-cost: {}: {why}{}", source.origin, remedy.unwrap_or_default())
}
