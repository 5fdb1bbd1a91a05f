//! Facts about a service that stay the same while it is on the bus.

use serde::{Deserialize, Serialize};

/// Facts about a service, answered on `…/about` as JSON. What an older service does not answer is empty.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct About {
    /// The scene, a built-in one by name or a file; or the recording that a replay plays.
    pub scene: String,
    /// Endpoints that the service listens on, such as `tcp/127.0.0.1:7447`.
    pub endpoints: Vec<String>,
    /// Version of the program.
    pub version: String,
}

impl About {
    /// The facts of a service of this program.
    pub fn new(scene: impl Into<String>, endpoints: &[String]) -> Self {
        About { scene: scene.into(), endpoints: endpoints.to_vec(), version: env!("CARGO_PKG_VERSION").to_owned() }
    }
}
