//! Measured levels as a scene has them: named, and as changes of the first one.

use super::measured_level::MeasuredLevel;
use crate::scene::{Level, SceneError, SceneSource};

/// The levels, each with a comment, for a scene that has the keys of the first.
pub(super) fn level_tables(
    source: &SceneSource,
    first_keys: &[String],
    levels: &[MeasuredLevel],
) -> Result<Vec<(Level, String)>, SceneError> {
    let first = source.with_levels(first_keys, &[])?;
    let words: Vec<String> = levels.iter().map(|level| level.row.configuration.word()).collect();
    let table = |(index, level): (usize, &MeasuredLevel)| {
        let is_taken = words.iter().filter(|word| **word == words[index]).count() > 1;
        let name = match is_taken {
            true => format!("{}-{}", words[index], level.row.configuration.family.integrator.as_str()),
            false => words[index].clone(),
        };
        let mut changes = if index == 0 { Vec::new() } else { level.row.configuration.keys(&first.scene) };
        changes.retain(|change| differs(&first, change));
        changes.iter_mut().for_each(|change| change.retain(|letter| letter != '"'));
        (Level { name, changes, error_rad: Some(level.error_rad) }, level.comment())
    };
    Ok(levels.iter().enumerate().map(table).collect())
}

/// Whether the scene is another one with a change, or none by this change alone.
fn differs(source: &SceneSource, change: &str) -> bool {
    source.with(&[change.to_owned()]).map_or(true, |changed| changed.scene != source.scene)
}
