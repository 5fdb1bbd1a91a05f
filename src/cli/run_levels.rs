//! Checks of the options of `run` that concern the levels of a scene.

use std::num::NonZeroUsize;
use std::thread::available_parallelism;

use super::failure::{CommandResult, Failure};
use super::run_args::{Args, BEST, Overruns};
use crate::runtime::Pace;
use crate::scene::SceneSource;

/// Processors that a run with `--spare` needs: for the level in force, the spare, and the output.
const SPARE_PROCESSORS: usize = 3;

/// Checks that the options suit the levels of a scene.
pub(super) fn check_levels(args: &Args, scene: &SceneSource) -> CommandResult<()> {
    let levels = scene.scene.levels.len();
    let at_best = args.shadow.as_deref().map(|model| model == BEST);
    let problem = if at_best == Some(false) && levels > 0 {
        "--shadow MODEL follows the steps of one level, and the scene has [[level]] tables: --shadow best follows at the best of them"
    } else if at_best == Some(true) && levels < 2 {
        "--shadow best needs a scene with [[level]] tables: `flexcrank trade SCENE --levels 4 --write FILE` writes them"
    } else if matches!(args.overrun, Overruns::Degrade) && levels < 2 {
        "--overrun degrade needs a scene with [[level]] tables: `flexcrank trade SCENE --levels 4 --write FILE` writes them"
    } else if matches!(args.overrun, Overruns::Degrade) && args.pace == Pace::Max {
        return Err(Failure::Usage("--overrun degrade keeps deadlines, and --pace max has none".to_owned()));
    } else {
        return Ok(());
    };
    Err(Failure::Usage(format!("{}: {problem}", scene.origin)))
}

/// Checks that the options suit a spare.
pub(super) fn check_spare(args: &Args, services: usize) -> CommandResult<()> {
    if !args.spare {
        return Ok(());
    }
    let problem = if !matches!(args.overrun, Overruns::Degrade) {
        "--spare takes over when a step would be late: it needs --overrun degrade"
    } else if !matches!(args.pace, Pace::Factor(_)) {
        "--spare keeps deadlines, and this --pace has none"
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
