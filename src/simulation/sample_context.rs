//! Facts of a scene that its samples leave out.

use crate::mechanics::Observation;
use crate::scene::{Level, System};

/// Facts of a scene that its samples leave out, for whoever tells them to others: names, the state at the start, the level.
#[derive(Debug, Clone)]
pub struct SampleContext {
    /// Names of the links, in their order.
    pub names: Vec<&'static str>,
    /// Whether it is a chain of links, which has angles and loads; an oscillator has neither.
    pub turns: bool,
    /// The state at t = 0.
    pub start: Observation,
    /// The level of detail in force, if the scene has levels.
    pub level: Option<Level>,
}

impl SampleContext {
    /// For a scene whose state at t = 0 is `start`.
    pub fn new(system: &System, start: &Observation, level: Option<&Level>) -> Self {
        let names = match system {
            System::Chain(chain) => chain.links.iter().map(|link| link.name.as_str()).collect(),
            System::Oscillator(_) => vec!["mass"],
        };
        SampleContext { names, turns: matches!(system, System::Chain(_)), start: start.clone(), level: level.cloned() }
    }
}
