//! A change of the running scene, built off the stepping thread and swapped in between two steps.

use super::ladder::{Ladder, of_build, route};
use crate::scene::{ModelKind, SceneError, SceneSource};
use crate::simulation::{NotChanged, Route, Simulation};

/// A simulation that goes on where another stands, and the way there.
pub struct Successor {
    simulation: Box<Simulation>,
    route: Route,
}

impl Successor {
    /// The simulation of `after`, for one of `before` to go on as.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn new(before: &SceneSource, after: &SceneSource) -> Result<Self, String> {
        let simulation = Simulation::new(&after.scene).map_err(|refused| of_build(after, &refused))?;
        Ok(Successor { simulation: Box::new(simulation), route: route(before, after)? })
    }

    /// Lets `running` go on as this one. Returns the energy that the change brought in, J.
    ///
    /// # Errors
    /// [`NotChanged`]; `running` is as it was then.
    pub fn replace(&mut self, running: &mut Simulation) -> Result<f64, NotChanged> {
        running.change_to(&mut self.simulation, &mut self.route)
    }
}

/// A refusal in words for whoever asked over the bus: the key is the place, so `--set` is left out.
fn in_words(refused: SceneError) -> String {
    let text = refused.to_string();
    let option = if refused.key.is_empty() { "--set ".to_owned() } else { format!("{}: ", refused.place) };
    match text.strip_prefix(&option) {
        Some(rest) if refused.place.starts_with("--set ") => rest.to_owned(),
        _ => text,
    }
}

/// Everything that a change of the scene needs, at whatever level the run is when it holds.
pub struct PreparedChange {
    /// The scene after it, at its first level.
    pub base: SceneSource,
    /// The levels after the change; before it, once it holds.
    ladder: Ladder,
    /// The way from each level to the same one after the change.
    routes: Vec<Route>,
    /// The simulation that was replaced, until this is dropped off the stepping thread.
    replaced: Option<Box<Simulation>>,
    shadow: Option<Successor>,
}

impl PreparedChange {
    /// Builds the simulations of the scene `before` with `KEY=VALUE` changes; with a shadow, that of the same scene by its model.
    ///
    /// # Errors
    /// Why the change is refused.
    pub fn new(before: &SceneSource, changes: &[String], shadow: Option<ModelKind>) -> Result<Self, String> {
        if changes.is_empty() {
            return Err("no change given: KEY=VALUE, such as slider.mass_kg=0.3".to_owned());
        }
        let base = before.changed(changes).map_err(in_words)?;
        let shadow = shadow.map(|model| {
            let by_model = |source: &SceneSource| source.by_model(model).map_err(in_words);
            Successor::new(&by_model(before)?, &by_model(&base)?).map_err(|refused| format!("the shadow: {refused}"))
        });
        let ladder = Ladder::new(&base)?;
        let way = |level: usize| {
            let after = ladder.scene(level).map_or(&base, |scene| &scene.source);
            route(&before.at_level(level).map_err(in_words)?, after)
        };
        let routes = (0..ladder.count()).map(way).collect::<Result<_, String>>()?;
        Ok(PreparedChange { base, ladder, routes, replaced: None, shadow: shadow.transpose()? })
    }

    /// Steps that `running`, at this level, has to take before the change can hold; `None` if it never can.
    pub(super) fn steps_ahead(&self, running: &Simulation, level: usize) -> Option<u64> {
        self.ladder.steps_ahead(running, level)
    }

    /// Lets the changed scene go on where `running` stands, at the level of `present`, which becomes that of the changed scene.
    /// Returns the energy that the change brought in, J.
    ///
    /// # Errors
    /// [`NotChanged`]; everything is as it was then.
    pub fn apply(&mut self, running: &mut Simulation, present: &mut Ladder) -> Result<f64, NotChanged> {
        let level = present.present();
        let route = self.routes.get_mut(level).ok_or(NotChanged::OtherState)?;
        let (changed_j, left_over) = self.ladder.take_over(running, level, route);
        self.replaced = left_over;
        if changed_j.is_ok() {
            std::mem::swap(&mut self.ladder, present);
        }
        changed_j
    }

    /// Lets the changed shadow go on where `running` stands.
    pub(super) fn apply_to_shadow(&mut self, running: &mut Simulation) -> Result<(), NotChanged> {
        self.shadow.as_mut().map_or(Ok(()), |shadow| shadow.replace(running).map(|_| ()))
    }
}
