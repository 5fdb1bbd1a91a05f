//! Finds the number of Newton corrections that suffices for each configuration of a study, with steps of fixed cost.

use std::ops::ControlFlow;

use super::run::run;
use super::{Configuration, Study};
use crate::scene::Scene;
use crate::study::fixed_cost::rate;

/// The Newton corrections in a stage that suffice for steps of fixed cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corrections {
    /// The question was not asked.
    NotAsked,
    /// This number suffices.
    Suffice(usize),
    /// No number does.
    NoneSuffice,
}

impl Study {
    /// Finds how many corrections suffice for each configuration that ran, as [`rate`] does, and whether steps of fixed cost keep the
    /// energy balance, too. `progress` is called before each; [`ControlFlow::Break`] leaves the others unasked.
    pub fn rate_fixed_cost(&mut self, scene: &Scene, progress: &mut dyn FnMut(&Configuration) -> ControlFlow<()>) {
        for row in &mut self.rows {
            let Ok(measured) = &mut row.outcome else { continue };
            if progress(&row.configuration).is_break() {
                self.interrupted = true;
                return;
            }
            let rating = rate(&row.configuration.scene(scene), &mut |_| {});
            let Ok(rating) = rating else {
                measured.corrections = Corrections::NoneSuffice;
                continue;
            };
            measured.corrections = Corrections::Suffice(rating.corrections);
            // They do not cut steps at the edges of pulses, whose work is then off.
            let mut scene = scene.clone();
            scene.solver.corrections = Some(rating.corrections);
            let ran = run(&row.configuration, &scene, &self.grid);
            measured.balance_kept &= ran.is_ok_and(|(ran, _)| ran.balance_kept);
        }
    }

    /// Whether it says how many corrections suffice.
    pub fn is_rated(&self) -> bool {
        self.measured().any(|(_, measured)| measured.corrections != Corrections::NotAsked)
    }
}
