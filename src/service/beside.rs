//! Computations beside the run.

use std::sync::Arc;

use super::best_level::BestLevelThread;
use super::live_modes::ModesService;

/// Computed beside the run, on other threads.
pub(super) struct Beside {
    /// Answers questions for the modes.
    pub modes: Arc<ModesService>,
    /// The shadow at the best level.
    pub best_level: Option<BestLevelThread>,
}
