//! Simulations of scenes, refused with file, line and key.

use super::failure::CommandResult;
use crate::scene::SceneSource;
use crate::simulation::Simulation;

/// Builds the simulation of a scene.
pub(super) fn build(source: &SceneSource) -> CommandResult<Simulation> {
    Simulation::new(&source.scene).map_err(|refused| source.refusal(refused.key, refused.to_string()).into())
}
