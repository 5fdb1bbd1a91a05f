//! Times of a recording's steps, through resets and changes of the scene.

use super::event::{new_level, new_scene, resets};
use super::recorded_session::RecordedSession;
use super::resimulator::EpochStep;
use crate::scene::{SceneAtLevel, SceneSource};
use crate::simulation::{EpochChanges, PublishRate, StepGrid};
use crate::wire::{self, Checkpoint, Message, Stamp};

/// Sizes of the steps at each level of a scene, s.
pub(super) fn steps_s(scene: &SceneSource) -> Vec<f64> {
    let at = |level: usize| scene.at_level(level).map_or(scene.scene.solver.step_s, |scene| scene.scene.solver.step_s);
    (0..scene.scene.levels.len().max(1)).map(at).collect()
}

/// The grids of steps that hold, each from an instant on.
pub(super) struct Timeline {
    /// The recording's own scene.
    recorded: SceneSource,
    /// The scene in force.
    scene: SceneAtLevel,
    sections: Vec<(EpochStep, StepGrid)>,
}

impl Timeline {
    pub(super) fn new(source: &RecordedSession) -> Self {
        let recorded = source.scene.clone();
        Timeline { scene: SceneAtLevel::first(recorded.clone()), recorded, sections: Vec::new() }
    }

    /// Follows a message that may begin another grid.
    pub(super) fn take(&mut self, event: &Message) {
        let Some(stamp) = event.stamp() else { return };
        let at = (stamp.epoch, stamp.step);
        match event {
            Message::Checkpoint(checkpoint) => self.checkpoint(checkpoint, at),
            // The first checkpoint tells the scene in force: before it, neither that nor a grid is known.
            _ if self.sections.is_empty() => {}
            Message::Commands(command) if resets(command) => self.begin((at.0 + 1, 0), StepGrid::new(self.step_s())),
            Message::Commands(command) => {
                let text = new_scene(command).map(|text| (text, self.scene.name_beside_first().to_owned()));
                let level = new_level(command).map(|level| (self.scene.base.text.as_str(), level.to_owned()));
                if let Some((text, level)) = text.or(level) {
                    let text = text.to_owned();
                    self.go_on_as(&text, &level);
                    self.begin(at, self.grid_at(at).with_step(at.1, self.step_s()));
                }
            }
            _ => {}
        }
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint, at: EpochStep) {
        let text = if checkpoint.scene.is_empty() { self.recorded.text.clone() } else { checkpoint.scene.clone() };
        self.go_on_as(&text, &checkpoint.level);
        let changes: Option<EpochChanges> = wire::recorded_checkpoint(checkpoint).ok().and_then(|state| state.changes);
        let grid = changes.map_or(StepGrid::new(self.step_s()), |changes| changes.grid);
        self.begin((at.0, grid.origin_step), grid);
    }

    /// Goes on with a scene at a level, or stays if it is none.
    fn go_on_as(&mut self, text: &str, level: &str) {
        if text == self.scene.base.text && level == self.scene.name_beside_first() {
            return;
        }
        let base = SceneSource::parse(&self.recorded.origin, text, &[]).ok();
        if let Some(scene) = base.and_then(|base| SceneAtLevel::named(&base, level).ok()) {
            self.scene = scene;
        }
    }

    /// The step in force, s.
    pub(super) fn step_s(&self) -> f64 {
        self.scene.source.scene.solver.step_s
    }

    fn begin(&mut self, at: EpochStep, grid: StepGrid) {
        if self.sections.last().is_none_or(|(from, present)| from.0 != at.0 || *present != grid) {
            self.sections.push((at, grid));
        }
    }

    /// The grid on which a step ends.
    fn grid_at(&self, at: EpochStep) -> StepGrid {
        let section = self.sections.iter().rev().find(|(from, _)| from.0 == at.0 && from.1 <= at.1);
        section.map_or(StepGrid::new(self.step_s()), |(_, grid)| *grid)
    }

    /// The shortest step so far, s.
    pub(super) fn shortest_step_s(&self) -> f64 {
        self.sections.iter().map(|(_, grid)| grid.step_s).fold(self.step_s(), f64::min)
    }

    /// Whether a stamp is consistent with `log_time`: its time equals that of its step, where the grid is known, and does not lie
    /// after it.
    pub(super) fn is_timely(&self, source: &RecordedSession, stamp: &Stamp, log_time_ns: u64) -> bool {
        let at = (stamp.epoch, stamp.step);
        let is_known = self.sections.first().is_some_and(|(first, _)| *first <= at);
        let is_of_step = !is_known || stamp.sim_time_s.to_bits() == self.grid_at(at).time_s(stamp.step).to_bits();
        is_of_step && source.log_time_ns(stamp.sim_time_s) <= log_time_ns
    }

    /// The step of an epoch, which began at `epoch_start_s`, at `log_time`; `None` if no step is at that time.
    pub(super) fn step_at(&self, source: &RecordedSession, log_time_ns: u64, (epoch, epoch_start_s): (u64, f64)) -> Option<u64> {
        let since_s = log_time_ns.checked_sub(source.log_time_ns(0.0))? as f64 * 1e-9 - epoch_start_s;
        let on = |grid: &StepGrid| {
            let step = grid.origin_step as f64 + ((since_s - grid.origin_s) / grid.step_s).round();
            (step >= 0.0).then_some(step as u64)
        };
        let is_there = |step: &u64| source.log_time_ns(epoch_start_s + self.grid_at((epoch, *step)).time_s(*step)) == log_time_ns;
        let of_epoch = self.sections.iter().rev().filter(|(from, _)| from.0 == epoch).map(|(_, grid)| *grid);
        of_epoch.chain([StepGrid::new(self.step_s())]).filter_map(|grid| on(&grid)).find(is_there)
    }

    /// Number of steps after `after` and before `before`, within an epoch, that are published at `rate`.
    pub(super) fn due_between(&self, rate: PublishRate, epoch: u64, after: u64, before: u64) -> u64 {
        let (mut due, mut until) = (0, before);
        for (from, grid) in self.sections.iter().rev().filter(|(from, _)| from.0 == epoch && from.1 < before) {
            if until <= after {
                return due;
            }
            due += rate.due_between(after.max(from.1), until, grid);
            until = until.min(from.1.saturating_add(1));
        }
        due + if until > after { rate.due_between(after, until, &StepGrid::new(self.step_s())) } else { 0 }
    }
}
