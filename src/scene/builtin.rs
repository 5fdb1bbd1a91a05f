//! The scenes that come with the program.

use super::SceneError;
use crate::nearest::did_you_mean;

/// A scene that comes with the program.
#[derive(Debug, Clone, Copy)]
pub struct Builtin {
    /// Name on the command line.
    pub name: &'static str,
    /// TOML text; its first comment line is the summary.
    pub text: &'static str,
}

impl Builtin {
    /// The first comment line of its text.
    pub fn summary(&self) -> &'static str {
        self.text.lines().next().unwrap_or_default().trim_start_matches(['#', ' '])
    }
}

/// The scene that runs when none is named.
pub const DEFAULT: &str = "crank-slider";

/// All built-in scenes.
pub const BUILTIN: &[Builtin] = &[
    Builtin { name: "crank-slider", text: include_str!("builtin/crank-slider.toml") },
    Builtin { name: "thesis-crank-slider", text: include_str!("builtin/thesis-crank-slider.toml") },
    Builtin { name: "thesis-beam", text: include_str!("builtin/thesis-beam.toml") },
    Builtin { name: "thesis-beam-tip", text: include_str!("builtin/thesis-beam-tip.toml") },
    Builtin { name: "thesis-oscillator", text: include_str!("builtin/thesis-oscillator.toml") },
    Builtin { name: "thesis-two-masses", text: include_str!("builtin/thesis-two-masses.toml") },
    Builtin { name: "thesis-two-masses-stiff", text: include_str!("builtin/thesis-two-masses-stiff.toml") },
    Builtin { name: "thesis-compressor", text: include_str!("builtin/thesis-compressor.toml") },
    Builtin { name: "ref-r1", text: include_str!("builtin/ref-r1.toml") },
    Builtin { name: "ref-r2", text: include_str!("builtin/ref-r2.toml") },
    Builtin { name: "ref-r2s", text: include_str!("builtin/ref-r2s.toml") },
    Builtin { name: "ref-r3", text: include_str!("builtin/ref-r3.toml") },
    Builtin { name: "ref-r4m", text: include_str!("builtin/ref-r4m.toml") },
    Builtin { name: "ref-r5", text: include_str!("builtin/ref-r5.toml") },
    Builtin { name: "ref-r5-tip", text: include_str!("builtin/ref-r5-tip.toml") },
];

/// Finds a built-in scene.
///
/// # Errors
/// [`SceneError`] with the nearest name if there is none.
pub fn find(name: &str) -> Result<&'static Builtin, SceneError> {
    BUILTIN.iter().find(|scene| scene.name == name).ok_or_else(|| unknown(name, ""))
}

pub(super) fn unknown(name: &str, nor: &str) -> SceneError {
    let hint = did_you_mean(name, BUILTIN.iter().map(|scene| scene.name));
    SceneError::whole(name, format!("not a built-in scene{nor}{hint} (`flexcrank scenes` lists them)"))
}
