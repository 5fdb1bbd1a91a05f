//! Levels of detail: the same scene with a few keys changed, for less cost and more error.

use super::check::Checker;
use super::types::Level;
use super::{SceneError, SceneSource, keys, raw};
use crate::nearest::nearest;

/// Most levels of a scene.
const MOST: usize = 16;
/// Rounding of a ratio of steps.
const ROUNDING: f64 = 1e-6;

/// Checks names and errors; [`SceneSource::parse`] checks the changes.
pub(super) fn levels(check: &Checker, levels: &[raw::Level]) -> Result<Vec<Level>, SceneError> {
    if levels.len() > MOST {
        return Err(check.refuse("level", format!("a scene has at most {MOST} levels")));
    }
    let mut checked: Vec<Level> = Vec::new();
    for (index, raw) in levels.iter().enumerate() {
        let level = check.noted(level(check, index, raw, &checked));
        checked.extend(level);
    }
    Ok(checked)
}

/// Checks the level of this index, which has others before it.
fn level(check: &Checker, index: usize, raw: &raw::Level, before: &[Level]) -> Result<Level, SceneError> {
    let raw::Level { name, changes, error_rad } = raw;
    let table = format!("level.{index}");
    let refuse = |key: &str, problem: &str| check.refuse(&format!("{table}.{key}"), problem);
    let error_rad = error_rad.map(|error| check.number(&keys::LEVEL_ERROR, &table, error));
    if index == 0 && !changes.is_empty() {
        check.note(|| refuse("changes", "the first level is the scene itself, without changes"));
    }
    if changes.iter().any(|change| change.trim_start().starts_with("level")) {
        check.note(|| refuse("changes", "a level does not change levels"));
    }
    let name = name.as_ref().ok_or_else(|| check.refuse(&table, "missing key `name`"))?;
    let is_word = !name.is_empty() && name.len() <= 64 && name.chars().all(|c| c.is_alphanumeric() || "-_.".contains(c));
    if !is_word {
        return Err(refuse("name", "must be a word of letters, digits, `-`, `_` and `.`"));
    }
    if before.iter().any(|level| level.name == *name) {
        return Err(refuse("name", "another level has this name"));
    }
    Ok(Level { name: name.clone(), changes: changes.clone(), error_rad })
}

impl SceneSource {
    /// Checks that a run of the scene can go on with each of its levels, from any other of them.
    pub(super) fn check_levels(&self) -> Result<(), SceneError> {
        let mut steps_s: Vec<f64> = Vec::new();
        for index in 0..self.scene.levels.len() {
            let step_s = self.at_level(index)?.scene.solver.step_s;
            if let Some(other) = steps_s.iter().position(|other_s| !meet(step_s, *other_s)) {
                let [one, two] = [index, other].map(|level| &self.scene.levels[level].name);
                let problem = format!(
                    "level `{one}`: a step of {step_s} s is neither a multiple nor a part of the step of level `{two}`, {} s",
                    steps_s[other]
                );
                return Err(self.refusal(&format!("level.{index}.changes"), problem));
            }
            steps_s.push(step_s);
        }
        Ok(())
    }

    /// The scene at a level, its changes written into it; the scene itself if it has no such level.
    ///
    /// # Errors
    /// [`SceneError`] if a change is refused.
    pub fn at_level(&self, index: usize) -> Result<SceneSource, SceneError> {
        let Some(level) = self.scene.levels.get(index).filter(|level| !level.changes.is_empty()) else { return Ok(self.clone()) };
        let changed = self.without_levels(&level.changes);
        changed.and_then(|changed| self.kept_by(changed, &level.changes)).map_err(|refused| {
            let key = format!("level.{index}.changes");
            self.refusal(&key, format!("level `{}`: {}", level.name, refused.reason()))
        })
    }
}

/// Whether one of two steps is a multiple of the other, but for rounding: then a run can change from one to the other.
fn meet(one_s: f64, other_s: f64) -> bool {
    let ratio = (one_s / other_s).max(other_s / one_s);
    (ratio - ratio.round()).abs() < ROUNDING
}

/// A scene at one of its levels.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneAtLevel {
    /// The scene at its first level.
    pub base: SceneSource,
    /// The level in force, from 0.
    pub level: usize,
    /// The scene in force: the base with the level's changes.
    pub source: SceneSource,
}

impl SceneAtLevel {
    /// The scene at its first level.
    pub fn first(base: SceneSource) -> Self {
        SceneAtLevel { source: base.clone(), base, level: 0 }
    }

    /// The scene at the level of this name, the first for an empty one.
    ///
    /// # Errors
    /// The reason: no such level, or one of its changes is refused.
    pub fn named(base: &SceneSource, name: &str) -> Result<Self, String> {
        let levels = &base.scene.levels;
        let index = if name.is_empty() { Some(0) } else { levels.iter().position(|level| level.name == name) };
        let level = index.ok_or_else(|| Self::unknown(base, name))?;
        let source = base.at_level(level).map_err(|refused| refused.to_string())?;
        Ok(SceneAtLevel { base: base.clone(), level, source })
    }

    /// The refusal of a level of this name.
    pub fn unknown(base: &SceneSource, name: &str) -> String {
        let names: Vec<&str> = base.scene.levels.iter().map(|level| level.name.as_str()).collect();
        let known = if names.is_empty() { "the scene has none".to_owned() } else { format!("known here: {}", names.join(", ")) };
        let hint = nearest(name, names.iter().copied()).map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
        format!("no level `{name}`{hint} ({known})")
    }

    /// The same level of the scene with `KEY=VALUE` changes.
    ///
    /// # Errors
    /// [`SceneError`] if a change is refused.
    pub fn changed(&self, changes: &[String]) -> Result<Self, SceneError> {
        let base = self.base.changed(changes)?;
        let source = base.at_level(self.level)?;
        Ok(SceneAtLevel { base, level: self.level, source })
    }

    /// The level in force; `None` if the scene has none.
    pub fn in_force(&self) -> Option<&Level> {
        self.base.scene.levels.get(self.level)
    }

    /// The name of the level in force; empty if it is the first.
    pub fn name_beside_first(&self) -> &str {
        self.in_force().filter(|_| self.level > 0).map_or("", |level| &level.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    fn with(levels: &str) -> Result<SceneSource, SceneError> {
        let text = builtin::find("crank-slider").map(|scene| scene.text).unwrap_or_default();
        SceneSource::parse("test.toml", &format!("{text}\n{levels}"), &[])
    }

    #[test]
    fn prop_a_level_is_the_scene_with_its_changes() -> Result<(), SceneError> {
        let source = with(
            "[[level]]\nname = \"fine\"\n[[level]]\nname = \"rigid\"\nerror_rad = 0.05\n\
             changes = [\"solver.model=rigid\", \"solver.integrator=runge-kutta\"]\n",
        )?;
        assert_eq!(source.at_level(0)?, source);
        let rigid = source.at_level(1)?;
        assert_eq!(rigid.scene.solver.model, crate::scene::ModelKind::Rigid);
        assert_eq!((rigid.scene.levels.len(), source.scene.levels[1].error_rad), (2, Some(0.05)));
        Ok(())
    }

    #[test]
    fn prop_levels_are_refused_by_key() {
        let first = "[[level]]\nname = \"fine\"\n";
        for (levels, reason) in [
            ("[[level]]\nname = \"a b\"\n", "level.0.name = \"a b\": must be a word"),
            ("[[level]]\nname = \"a\"\nchanges = [\"rod.modes=1\"]\n", "the first level is the scene itself"),
            ("[[level]]\nname = \"fine\"\n[[level]]\nname = \"fine\"\n", "another level has this name"),
            ("LEVEL\"rod.length_m=2\"]\n", "level `fast`: rod.length_m = 2: a running scene keeps its geometry"),
            ("LEVEL\"rod.lenght_m=2\"]\n", "did you mean `length_m`?"),
            ("LEVEL\"rod.modes\"]\n", "expected KEY=VALUE"),
            (
                "LEVEL\"solver.step_s=0.003\"]\n",
                "a step of 0.003 s is neither a multiple nor a part of the step of level `fine`, 0.002 s",
            ),
            ("LEVEL]\nerror_rad = -1.0\n", "level.1.error_rad = -1.0: must be a number"),
        ] {
            let levels = levels.replace("LEVEL", &format!("{first}[[level]]\nname = \"fast\"\nchanges = ["));
            let refused = with(&levels).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(refused.contains(reason), "{levels}: {refused}");
        }
    }

    #[test]
    fn regress_a_refused_level_hides_no_other() {
        let levels = "[[level]]\nname = \"a b\"\n[[level]]\nerror_rad = -1.0\n\
                      [[level]]\nname = \"fast\"\nchanges = [\"level.0.name=slow\"]\n";
        let refused = with(levels).err().map(|error| error.in_full()).unwrap_or_default();
        let expected = ["level.0.name = ", "level.1: missing key `name`", "level.1.error_rad = -1.0: ", "level.2.changes = "];
        assert_eq!(refused.lines().count(), expected.len(), "{refused}");
        assert!(refused.lines().zip(expected).all(|(line, expected)| line.contains(expected)), "{refused}");
    }
}
