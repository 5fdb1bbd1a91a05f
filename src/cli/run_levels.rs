//! Checks of the options of `run` that concern the levels of a scene.

use std::num::NonZeroUsize;
use std::thread::available_parallelism;

use super::failure::{CommandResult, Failure};
use super::run_args::{Args, BEST, Overruns};
use crate::runtime::Pace;
use crate::scene::{Scene, SceneSource};

/// Processors that a run with `--spare` needs: for the level in force, the spare, and the output.
const SPARE_PROCESSORS: usize = 3;

/// Checks that the options suit the levels of a scene.
pub(super) fn check_levels(args: &Args, scene: &SceneSource) -> CommandResult<()> {
    let levels = scene.scene.levels.len();
    let at_best = args.shadow.as_deref().map(|model| model == BEST);
    let degrades = matches!(args.overrun, Overruns::Degrade);
    let problem = if at_best == Some(false) && levels > 0 {
        "--shadow MODEL follows the steps of one level, and the scene has [[level]] tables: --shadow best follows at the best of them"
            .to_owned()
    } else if at_best == Some(true) && levels < 2 {
        needs_levels("--shadow best", &scene.scene)
    } else if degrades && levels < 2 {
        needs_levels("--overrun degrade", &scene.scene)
    } else if degrades && let Some(pace) = without_deadlines(args.pace) {
        return Err(Failure::Usage(format!("--overrun degrade keeps deadlines, and --pace {pace} has none")));
    } else {
        return Ok(());
    };
    Err(Failure::Usage(format!("{}: {problem}", scene.origin)))
}

/// The refusal of an option for a scene with fewer than two levels, with the way to them: `trade` takes no oscillator.
fn needs_levels(option: &str, scene: &Scene) -> String {
    let way = match scene.chain() {
        Some(_) => "`flexcrank trade SCENE --levels 4 --write FILE` writes them",
        None => "those of an oscillator are written by hand (`flexcrank guide scenes`)",
    };
    format!("{option} needs a scene with [[level]] tables: {way}")
}

/// The word for a pace at which no step has a deadline.
fn without_deadlines(pace: Pace) -> Option<&'static str> {
    match pace {
        Pace::Max => Some("max"),
        Pace::Lockstep => Some("lockstep"),
        Pace::Factor(_) => None,
    }
}

/// Checks that the options suit a spare. That `--overrun degrade` has levels and deadlines is checked already.
pub(super) fn check_spare(args: &Args, services: usize) -> CommandResult<()> {
    if !args.spare {
        return Ok(());
    }
    let problem = if !matches!(args.overrun, Overruns::Degrade) {
        "--spare takes over when a step would be late: it needs --overrun degrade"
    } else if services > 1 {
        "--spare needs a processor more for each service: run one service"
    } else {
        warn_of_few_processors();
        return Ok(());
    };
    Err(Failure::Usage(problem.to_owned()))
}

/// Warns of fewer processors than the level in force, its spare and the output need at the same time.
fn warn_of_few_processors() {
    let count = available_parallelism().map_or(1, NonZeroUsize::get);
    if count < SPARE_PROCESSORS {
        tracing::warn!("--spare computes two levels at once: {SPARE_PROCESSORS} processors are needed, {count} available");
    }
}
