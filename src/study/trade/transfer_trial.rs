//! A run that switches between two levels in mid-motion, both ways.

use super::grid::Grid;
use crate::scene::Scene;
use crate::simulation::{BuildError, Diverged, NoRoute, NotChanged, Route, Simulation};

/// Why a run cannot switch between two levels.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoSwitch {
    /// A model cannot compute its level.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A state cannot go from one level to the other.
    #[error(transparent)]
    Route(#[from] NoRoute),
    /// The change failed.
    #[error(transparent)]
    NotChanged(#[from] NotChanged),
    /// The run diverged before or after a change.
    #[error(transparent)]
    Diverged(#[from] Diverged),
}

/// Parts of the run after each of which it switches to the other level, and back one instant later.
const PARTS: usize = 4;

/// Runs `one`, and switches to `other` and back at a few instants. The steps of both divide the grid's interval.
pub(super) fn switch_both_ways(one: &Scene, other: &Scene, grid: &Grid) -> Result<(), NoSwitch> {
    let mut running = Simulation::new(one)?;
    for _ in 1..PARTS {
        advance(&mut running, grid, grid.count / PARTS)?;
        switch(&mut running, one, other)?;
        advance(&mut running, grid, 1)?;
        switch(&mut running, other, one)?;
    }
    Ok(advance(&mut running, grid, 1)?)
}

fn advance(running: &mut Simulation, grid: &Grid, instants: usize) -> Result<(), Diverged> {
    let steps = grid.steps(running.step_s()) * instants.max(1) as u64;
    (0..steps).try_for_each(|_| running.step())
}

fn switch(running: &mut Simulation, before: &Scene, after: &Scene) -> Result<(), NoSwitch> {
    let mut next = Simulation::new(after)?;
    running.change_to(&mut next, &mut Route::new(before, after)?)?;
    Ok(())
}
