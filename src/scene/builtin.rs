//! The scenes that come with the program.

/// A scene that comes with the program.
#[derive(Debug, Clone, Copy)]
pub struct Builtin {
    /// What it is called on the command line.
    pub name: &'static str,
    /// Its TOML text; the first comment line says what it is.
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
];
