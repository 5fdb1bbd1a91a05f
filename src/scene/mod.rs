//! Scenes: a TOML file is validated once, and becomes an immutable typed [`Scene`].
//!
//! ```
//! use flexcrank::scene::SceneSource;
//! let source = SceneSource::open("crank-slider", &["rod.length_m=1.2".to_owned()])?;
//! assert_eq!(source.scene.chain().map(|chain| chain.links[1].length_m), Some(1.2));
//!
//! let refused = SceneSource::open("crank-slider", &["rod.lenght_m=1.2".to_owned()]).unwrap_err();
//! assert!(refused.to_string().contains("did you mean `length_m`?"));
//! # Ok::<(), flexcrank::scene::SceneError>(())
//! ```

pub mod builtin;
mod change;
mod check;
mod document;
mod error;
mod key;
mod keys;
mod level;
mod level_text;
mod link;
mod oscillator;
mod parse;
mod raw;
mod syntax;
mod table;
mod types;
mod validate;

use std::io::ErrorKind;
use std::path::Path;

use crate::nearest::did_you_mean_file;

pub use error::SceneError;
pub use key::KeyRow;
pub use keys::{INTEGRATORS, MODELS, SHAPES, reference, reference_markdown};
pub use level::SceneAtLevel;
pub use level_text::level_tables;
#[cfg(feature = "service")]
pub(crate) use parse::describe as toml_problem;
#[cfg(feature = "service")]
pub(crate) use syntax::syntax_problem;
pub use types::*;

use crate::text_file;
use document::SceneText;

/// Size limit of a scene, bytes: parsing takes two hundred times the memory.
const SIZE_LIMIT: usize = 1024 * 1024;
/// First bytes of a recording.
const RECORDING: &[u8] = b"\x89MCAP";

/// A validated scene and the text it came from.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSource {
    /// The built-in name or file it was read from.
    pub origin: String,
    /// The TOML in force, overrides written into it.
    pub text: String,
    /// The validated scene.
    pub scene: Scene,
    /// The TOML as it was read, before any override. Refusals name its lines.
    pub(crate) as_read: String,
}

/// The commands for a scene or a campaign, if this file is one: a remedy where another file is needed.
#[cfg(feature = "service")]
pub(crate) fn toml_hint(path: &Path) -> Option<String> {
    let is_toml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) && path.is_file();
    let bytes = is_toml.then(|| text_file::beginning(path, SIZE_LIMIT))?.ok()?;
    let before_comment = |line: &str| line.split('#').next().unwrap_or_default().trim().to_owned();
    let has_mechanism = |line: &str| ["[crank]", "[beam]", "[oscillator]"].contains(&before_comment(line).as_str());
    let name = path.display();
    let text = String::from_utf8_lossy(&bytes);
    if is_campaign(&text) {
        return Some(format!("a campaign: `flexcrank sweep {name}` runs it"));
    }
    let hint = || format!("a scene: `flexcrank check {name}` checks it, `flexcrank run {name}` runs it");
    text.lines().any(has_mechanism).then(hint)
}

/// Whether a text has the keys that vary in a campaign. No scene has them.
fn is_campaign(text: &str) -> bool {
    toml::from_str::<toml::Table>(text).is_ok_and(|table| table.contains_key("vary"))
}

/// Tables of a scene that keys are written in.
const TABLES: [&str; 13] =
    ["crank", "rod", "beam", "slider", "base", "tip", "gravity", "start", "drive", "pulse", "torque", "commands", "solver"];

/// Whether a name is a change of a scene's key that lacks its option, such as `rod.length_m=0.3`.
pub(crate) fn is_key_of_a_scene(name: &str) -> bool {
    let key = name.split_once('=').map_or("", |(key, _)| key);
    let is_word = |word: &str| !word.is_empty() && word.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_');
    let is_table = key.split('.').next().is_some_and(|first| TABLES.contains(&first));
    is_table && key.contains('.') && key.split('.').all(is_word)
}

/// The refusal of a name that no scene has.
fn absent(name: &str) -> SceneError {
    let as_toml = Path::new(name).with_extension("toml");
    let near =
        if as_toml.is_file() { format!("; did you mean `{}`?", as_toml.display()) } else { did_you_mean_file(Path::new(name)) };
    match near {
        none if none.is_empty() => builtin::unknown(name, ", nor a file"),
        near => SceneError::whole(name, format!("not a built-in scene, nor a file{near}")),
    }
}

impl SceneSource {
    /// Reads and validates `name`, a built-in scene or a file, with `KEY=VALUE` overrides.
    ///
    /// # Errors
    /// [`SceneError`] when there is no such scene, the file cannot be read, or anything in it is refused.
    pub fn open(name: &str, overrides: &[String]) -> Result<Self, SceneError> {
        // A value that is a word of its own, `--set rod.length_m 0.3`, counts as the name.
        for given in overrides {
            document::key_and_value(given)?;
        }
        if let Ok(scene) = builtin::find(name) {
            return Self::parse(name, scene.text, overrides);
        }
        let bytes = text_file::beginning(Path::new(name), SIZE_LIMIT).map_err(|error| match error.kind() {
            ErrorKind::NotFound if is_key_of_a_scene(name) => {
                SceneError::whole(name, format!("not a scene: a key of one is changed with --set {name}"))
            }
            ErrorKind::NotFound => absent(name),
            _ => SceneError::whole(name, format!("cannot be read: {error}")),
        })?;
        if bytes.starts_with(RECORDING) {
            let problem = "is a recording, not a scene: `flexcrank scenes FILE > mine.toml` takes its scene out of it; play it with `flexcrank replay`, go on with `flexcrank run --resume`, or look at an instant: `flexcrank modes FILE@3.2`";
            return Err(SceneError::whole(name, problem));
        }
        if bytes.len() > SIZE_LIMIT {
            return Err(SceneError::whole(name, text_file::too_large(SIZE_LIMIT).to_string()));
        }
        let text = String::from_utf8(bytes).map_err(|error| {
            let (whole, _) = error.as_bytes().split_at(error.utf8_error().valid_up_to());
            let line = 1 + whole.iter().filter(|byte| **byte == b'\n').count();
            SceneError::whole(format!("{name}:{line}"), "not text in UTF-8; a scene is a TOML file")
        })?;
        Self::parse(name, &text, overrides).map_err(|refused| match is_campaign(&text) {
            true => SceneError::whole(name, format!("is a campaign, not a scene: `flexcrank sweep {name}` runs it")),
            false => refused,
        })
    }

    /// The same scene by another model, with the integrator that usually suits it.
    ///
    /// # Errors
    /// [`SceneError`] when the model does not suit the scene.
    pub fn by_model(&self, model: ModelKind) -> Result<Self, SceneError> {
        let integrator = model.usual_integrator().as_str();
        let mut overrides = vec![format!("solver.model={}", model.as_str()), format!("solver.integrator={integrator}")];
        match self.scene.solver.corrections {
            Some(0) if model.usually_iterates() => {
                let problem = format!("{} solves its steps by iteration, with {integrator}: leave the key out", model.as_str());
                return Err(self.refusal("solver.corrections", problem));
            }
            Some(_) if !model.usually_iterates() => overrides.push("solver.corrections=0".to_owned()),
            _ => {}
        }
        self.with(&overrides)
    }

    /// A refusal of the value of `key`, with the line that it was read from.
    pub fn refusal(&self, key: &str, problem: String) -> SceneError {
        match SceneText::new((&self.origin, &self.as_read), &self.text, &[]) {
            Ok(text) => text.refuse(key, problem),
            Err(error) => error,
        }
    }

    /// Validates `text`; `origin` names it in errors.
    ///
    /// # Errors
    /// [`SceneError`] when anything in it is refused.
    pub fn parse(origin: &str, text: &str, overrides: &[String]) -> Result<Self, SceneError> {
        check_size(origin, text)?;
        Self::of_text(SceneText::new((origin, text), text, overrides)?)?.with_checked_levels()
    }

    /// This scene with `KEY=VALUE` overrides.
    ///
    /// # Errors
    /// [`SceneError`] when anything in it is refused.
    pub fn with(&self, overrides: &[String]) -> Result<Self, SceneError> {
        self.rewritten(&self.text, overrides)
    }

    /// This scene as `text`, with overrides.
    fn rewritten(&self, text: &str, overrides: &[String]) -> Result<Self, SceneError> {
        check_size(&self.origin, text)?;
        Self::of_text(SceneText::new((&self.origin, &self.as_read), text, overrides)?)?.with_checked_levels()
    }

    /// This scene with overrides, validated except for its levels' changes.
    fn without_levels(&self, overrides: &[String]) -> Result<Self, SceneError> {
        Self::of_text(SceneText::new((&self.origin, &self.as_read), &self.text, overrides)?)
    }

    /// Validates a text except for its levels' changes.
    fn of_text(text: SceneText) -> Result<Self, SceneError> {
        let raw = parse::parse(&text)?;
        let scene = validate::validate(&raw, &text)?;
        Ok(SceneSource { origin: text.origin, text: text.merged, scene, as_read: text.as_read })
    }

    fn with_checked_levels(self) -> Result<Self, SceneError> {
        self.check_levels()?;
        Ok(self)
    }
}

/// Refuses a text that is too large for a scene.
fn check_size(origin: &str, text: &str) -> Result<(), SceneError> {
    if text.len() > SIZE_LIMIT {
        let problem = format!("a scene has at most {} KiB, and this has {}", SIZE_LIMIT / 1024, text.len() / 1024);
        return Err(SceneError::whole(origin, problem));
    }
    Ok(())
}
