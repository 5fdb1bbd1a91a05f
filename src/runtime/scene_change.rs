//! A change of the running scene, built off the stepping thread and swapped in between two steps.

use std::sync::Arc;

use crate::scene::{ModelKind, SceneSource};
use crate::simulation::{BuildError, NoRoute, NotChanged, Route, Simulation};
use crate::wire::TelemetryEncoder;

/// A scene in force, and the encoder of its samples.
pub struct SceneInForce {
    /// The scene.
    pub source: SceneSource,
    /// Encodes its samples.
    pub telemetry: Arc<TelemetryEncoder>,
}

/// A simulation that goes on where another stands, and the way there.
struct Successor {
    simulation: Simulation,
    route: Route,
}

/// Everything that a change of the scene needs.
pub struct PreparedChange {
    /// The scene in force after it.
    pub in_force: Arc<SceneInForce>,
    main: Successor,
    shadow: Option<Successor>,
}

impl Successor {
    fn new(before: &SceneSource, after: &SceneSource) -> Result<Self, NoRoute> {
        let simulation = Simulation::new(&after.scene)?;
        Ok(Successor { simulation, route: Route::new(&before.scene, &after.scene)? })
    }

    fn replace(&mut self, running: &mut Simulation) -> Result<f64, NotChanged> {
        running.change_to(&mut self.simulation, &mut self.route)
    }
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
        let after = before.changed(changes).map_err(|refused| refused.to_string())?;
        let refused = |refused: NoRoute| match refused {
            NoRoute::Build(BuildError { key, .. }) => after.refusal(key, refused.to_string()).to_string(),
            NoRoute::Transfer(_) => refused.to_string(),
        };
        let main = Successor::new(before, &after).map_err(refused)?;
        let shadow = shadow.map(|model| {
            let by_model = |source: &SceneSource| source.by_model(model).map_err(|refused| refused.to_string());
            Successor::new(&by_model(before)?, &by_model(&after)?).map_err(|refused| format!("the shadow: {refused}"))
        });
        let telemetry = Arc::new(TelemetryEncoder::new(&after.scene.system, main.simulation.start()));
        let in_force = Arc::new(SceneInForce { source: after, telemetry });
        Ok(PreparedChange { in_force, main, shadow: shadow.transpose()? })
    }

    /// Steps that `running` has to take before the change can hold; `None` if it never can.
    pub(super) fn steps_ahead(&self, running: &Simulation) -> Option<u64> {
        running.steps_to_change(&self.in_force.source.scene.solver)
    }

    /// Lets the changed scene go on where `running` stands. Returns the energy that the change brought in, J.
    ///
    /// # Errors
    /// [`NotChanged`]; `running` is as it was then.
    pub fn apply(&mut self, running: &mut Simulation) -> Result<f64, NotChanged> {
        self.main.replace(running)
    }

    /// Lets the changed shadow go on where `running` stands.
    pub(super) fn apply_to_shadow(&mut self, running: &mut Simulation) -> Result<(), NotChanged> {
        self.shadow.as_mut().map_or(Ok(()), |shadow| shadow.replace(running).map(|_| ()))
    }
}
