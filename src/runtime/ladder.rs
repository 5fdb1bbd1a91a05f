//! The levels of a running scene: a simulation of each stands ready, so that a switch allocates nothing.

mod next_cheaper;

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::governor::LevelCost;

use crate::scene::{SceneAtLevel, SceneSource};
use crate::simulation::{BuildError, NoRoute, NotChanged, Route, SampleContext, Simulation};

/// A scene in force.
pub struct SceneInForce {
    /// The scene, at its level.
    pub scene: SceneAtLevel,
    /// Names, start and level for its samples.
    pub context: Arc<SampleContext>,
}

impl SceneInForce {
    /// The scene that `simulation` computes.
    pub fn new(scene: SceneAtLevel, simulation: &Simulation) -> Self {
        let context = SampleContext::new(&scene.source.scene.system, simulation.start(), scene.in_force());
        SceneInForce { scene, context: Arc::new(context) }
    }
}

/// Steps by which the cost of a level is measured, and the pause between two: a step after a pause takes longer, as in a run.
const MEASURED_STEPS: u32 = 20;
const PAUSE: Duration = Duration::from_millis(1);

/// A level.
struct Rung {
    in_force: Arc<SceneInForce>,
    /// Usual time to compute a step.
    cost: Duration,
    /// Ready to go on; `None` while it runs.
    spare: Option<Box<Simulation>>,
    /// Ways to the other levels.
    ways: Vec<Option<Route>>,
}

/// The levels of a scene, one of which runs; one for a scene without levels.
pub struct Ladder {
    rungs: Vec<Rung>,
    present: usize,
}

impl Ladder {
    /// For a simulation that runs at a level of its scene. Builds the other levels, if there are any.
    ///
    /// # Errors
    /// The reason why a level cannot be computed.
    pub fn of_running(scene: &SceneAtLevel, simulation: &Simulation) -> Result<Self, String> {
        if scene.base.scene.levels.is_empty() {
            let in_force = Arc::new(SceneInForce::new(scene.clone(), simulation));
            return Ok(Ladder {
                rungs: vec![Rung { in_force, cost: Duration::ZERO, spare: None, ways: vec![None] }],
                present: 0,
            });
        }
        let mut ladder = Ladder::new(&scene.base)?;
        ladder.present = scene.level;
        ladder.take_spare(scene.level);
        Ok(ladder)
    }

    /// Builds a simulation of each level of a scene, none of which runs, and the ways between them.
    ///
    /// # Errors
    /// The reason why a level cannot be computed.
    pub(super) fn new(base: &SceneSource) -> Result<Self, String> {
        let mut ladder = Ladder { rungs: Vec::new(), present: 0 };
        for level in 0..base.scene.levels.len().max(1) {
            let source = base.at_level(level).map_err(|refused| refused.to_string())?;
            let mut simulation = Simulation::new(&source.scene).map_err(|refused| of_build(&source, &refused))?;
            let cost = if base.scene.levels.len() > 1 { cost_of_step(&mut simulation) } else { Duration::ZERO };
            let scene = SceneAtLevel { base: base.clone(), level, source };
            let in_force = Arc::new(SceneInForce::new(scene, &simulation));
            ladder.rungs.push(Rung { in_force, cost, spare: Some(Box::new(simulation)), ways: Vec::new() });
        }
        let scenes: Vec<SceneSource> = ladder.rungs.iter().map(|rung| rung.in_force.scene.source.clone()).collect();
        for (from, rung) in ladder.rungs.iter_mut().enumerate() {
            let way = |(to, after): (usize, &SceneSource)| (to != from).then(|| route(&scenes[from], after)).transpose();
            rung.ways = scenes.iter().enumerate().map(way).collect::<Result<_, String>>()?;
        }
        Ok(ladder)
    }

    fn take_spare(&mut self, level: usize) -> Option<Box<Simulation>> {
        self.rungs.get_mut(level).and_then(|rung| rung.spare.take())
    }

    /// Lets `running` go on as the same level of this ladder, none of which runs yet, by the way `route`. Returns the energy that the
    /// change brought in, J, and the simulation that is left over, to be dropped elsewhere.
    pub(super) fn take_over(
        &mut self,
        running: &mut Simulation,
        level: usize,
        route: &mut Route,
    ) -> (Result<f64, NotChanged>, Option<Box<Simulation>>) {
        let Some(mut spare) = self.take_spare(level) else { return (Err(NotChanged::OtherState), None) };
        let changed = running.change_to(&mut spare, route);
        self.present = level;
        (changed, Some(spare))
    }

    /// The scene at a level.
    pub(super) fn scene(&self, level: usize) -> Option<&SceneAtLevel> {
        self.rungs.get(level).map(|rung| &rung.in_force.scene)
    }

    /// The scene in force.
    pub fn in_force(&self) -> &Arc<SceneInForce> {
        &self.rungs[self.present].in_force
    }

    /// The level that runs, from 0.
    pub fn present(&self) -> usize {
        self.present
    }

    /// The levels as a governor sees them, for steps at `factor` simulated seconds per wall second.
    pub fn costs(&self, factor: f64) -> Vec<LevelCost> {
        let cost = |rung: &Rung| {
            let period = Duration::from_secs_f64(rung.in_force.scene.source.scene.solver.step_s / factor);
            LevelCost { period, usual: rung.cost }
        };
        self.rungs.iter().map(cost).collect()
    }

    /// The name of a level; empty if there is none.
    pub fn name(&self, level: usize) -> &str {
        self.scene(level).and_then(SceneAtLevel::in_force).map_or("", |level| &level.name)
    }

    /// Number of levels; 1 for a scene without.
    pub fn count(&self) -> usize {
        self.rungs.len()
    }

    /// The level of this name.
    ///
    /// # Errors
    /// The reason: no such level.
    pub fn named(&self, name: &str) -> Result<usize, String> {
        let is_it = |rung: &Rung| rung.in_force.scene.in_force().is_some_and(|level| level.name == name);
        let found = self.rungs.iter().position(is_it);
        found.ok_or_else(|| SceneAtLevel::unknown(&self.in_force().scene.base, name))
    }

    /// Steps that `running` has to take before it can go on at a level; `None` if it never can.
    pub fn steps_ahead(&self, running: &Simulation, level: usize) -> Option<u64> {
        running.steps_to_change(&self.rungs.get(level)?.in_force.scene.source.scene.solver)
    }

    /// Lets `running` go on at another level. Returns the energy that the change brought in, J.
    ///
    /// # Errors
    /// [`NotChanged`]; `running` is as it was then.
    pub fn switch(&mut self, running: &mut Simulation, to: usize) -> Result<f64, NotChanged> {
        if to == self.present {
            return Ok(0.0);
        }
        let spare = self.take_spare(to);
        let way = self.rungs[self.present].ways.get_mut(to).and_then(Option::as_mut);
        let (Some(mut spare), Some(way)) = (spare, way) else { return Err(NotChanged::OtherState) };
        let switched = running.change_to(&mut spare, way);
        let free = if switched.is_ok() { std::mem::replace(&mut self.present, to) } else { to };
        self.rungs[free].spare = Some(spare);
        switched
    }
}

/// Usual time to compute a step of a simulation at its start, to which it returns.
fn cost_of_step(simulation: &mut Simulation) -> Duration {
    let step = |_| {
        std::thread::sleep(PAUSE);
        let begun = Instant::now();
        simulation.step().is_ok().then(|| begun.elapsed())
    };
    let mut costs: Vec<Duration> = (0..MEASURED_STEPS).map_while(step).collect();
    costs.sort_unstable();
    // It was built, so it begins.
    let _ = simulation.reset();
    costs.get(costs.len() / 2).copied().unwrap_or(Duration::MAX)
}

/// The way from one scene to another, or why there is none.
pub(super) fn route(before: &SceneSource, after: &SceneSource) -> Result<Route, String> {
    Route::new(&before.scene, &after.scene).map_err(|refused| match &refused {
        NoRoute::Build(build) => of_build(after, build),
        NoRoute::Transfer(_) => refused.to_string(),
    })
}

/// Says why a scene's simulation could not be built.
pub(super) fn of_build(source: &SceneSource, refused: &BuildError) -> String {
    source.refusal(refused.key, refused.to_string()).to_string()
}
