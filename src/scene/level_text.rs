//! Writes `[[level]]` tables into a scene's text.

use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, Value};

use super::types::Level;
use super::{SceneError, SceneSource};

/// Comment above the first level.
const HEAD: &str = "# Levels of detail, from the best to the cheapest, as `flexcrank trade --levels` measured them.\n";

impl SceneSource {
    /// The scene with these levels instead of its own, each with a comment, and with `KEY=VALUE` changes for all of them. Everything else
    /// in its text is kept.
    ///
    /// # Errors
    /// [`SceneError`] if a change or a level is refused.
    pub fn with_levels(&self, changes: &[String], levels: &[(Level, String)]) -> Result<SceneSource, SceneError> {
        let changed = self.without_levels(changes)?;
        let not_toml = |error: toml_edit::TomlError| self.refusal("", format!("not TOML: {}", error.message()));
        let mut document: DocumentMut = changed.text.parse().map_err(not_toml)?;
        replace(&mut document, levels);
        self.rewritten(&document.to_string(), &[])
    }
}

/// The tables as they stand in a scene.
pub fn level_tables(levels: &[(Level, String)]) -> String {
    let mut document = DocumentMut::new();
    replace(&mut document, levels);
    document.to_string()
}

/// Puts tables where the levels of the document stood, or at its end.
fn replace(document: &mut DocumentMut, levels: &[(Level, String)]) {
    if levels.is_empty() {
        document.remove("level");
        return;
    }
    let old = document.get("level").and_then(Item::as_array_of_tables).and_then(|old| old.get(0)).cloned();
    let before = match old {
        Some(old) => {
            let above = old.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or("\n");
            // The comment of a level that was written here goes with it.
            let end = above.find(HEAD).map_or(above.len(), |head| head + HEAD.len());
            above[..end].to_owned()
        }
        None => {
            // An inline list of levels, too, gives way to tables at the end.
            document.remove("level");
            // Comments at the end of the text belong to what stands there now.
            let end = document.trailing().as_str().unwrap_or_default().to_owned();
            let gap = if end.is_empty() && document.is_empty() { "" } else { "\n" };
            document.set_trailing("");
            format!("{end}{gap}{HEAD}")
        }
    };
    let mut tables = ArrayOfTables::new();
    for (index, level) in levels.iter().enumerate() {
        let mut table = table(level);
        let gap = if index == 0 { before.as_str() } else { "\n" };
        table.decor_mut().set_prefix(format!("{gap}# {}\n", level.1));
        tables.push(table);
    }
    document.insert("level", Item::ArrayOfTables(tables));
}

fn table((level, _): &(Level, String)) -> Table {
    let mut table = Table::new();
    table.insert("name", toml_edit::value(&level.name));
    if !level.changes.is_empty() {
        table.insert("changes", toml_edit::value(level.changes.iter().collect::<Array>()));
    }
    if let Some(error_rad) = level.error_rad.and_then(|error_rad| format!("{error_rad:.2e}").parse::<Value>().ok()) {
        table.insert("error_rad", toml_edit::value(error_rad));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    fn levels() -> Vec<(Level, String)> {
        let level = |name: &str, changes: &[&str], error_rad| Level {
            name: name.to_owned(),
            changes: changes.iter().map(|change| (*change).to_owned()).collect(),
            error_rad: Some(error_rad),
        };
        vec![
            (level("fine", &[], 1.5e-5), "4 times real time".to_owned()),
            (level("coarse", &["solver.step_s=0.01", "rod.modes=1"], 0.02), "300 times real time".to_owned()),
        ]
    }

    #[test]
    fn prop_the_rest_of_the_text_is_kept() -> Result<(), SceneError> {
        let text = builtin::find("crank-slider").map(|scene| scene.text).unwrap_or_default();
        let text = format!("{text}# step_s = 0.001\n");
        let source = SceneSource::parse("test.toml", &text, &[])?;
        let with = source.with_levels(&["solver.step_s=0.005".to_owned()], &levels())?;
        let (before, tables) = with.text.split_once("\n# Levels of detail").unwrap_or_default();
        assert_eq!(before, text.replace("step_s = 0.002", "step_s = 0.005"));
        assert_eq!(format!("# Levels of detail{tables}"), level_tables(&levels()));
        assert_eq!(with.scene.levels, levels().into_iter().map(|(level, _)| level).collect::<Vec<_>>());
        assert_eq!(with.at_level(1)?.scene.solver.step_s, 0.01);
        assert_eq!(with.with_levels(&[], &levels())?.text, with.text);
        Ok(())
    }

    #[test]
    fn prop_levels_are_replaced_where_they_stand() -> Result<(), SceneError> {
        let text = builtin::find("crank-slider").map(|scene| scene.text).unwrap_or_default();
        let old = "# Mine.\n[[level]]\nname = \"a\"\n[[level]]\nname = \"b\"\nchanges = [\"rod.modes=2\"]\n\n";
        let (links, rest) = text.split_at(text.find("[slider]").unwrap_or_default());
        let source = SceneSource::parse("test.toml", &format!("{links}{old}{rest}"), &[])?;
        let new = level_tables(&levels());
        let expected = format!("{links}{}\n{rest}", new.replace(HEAD, "# Mine.\n"));
        assert_eq!(source.with_levels(&[], &levels())?.text, expected);
        assert_eq!(source.with_levels(&[], &[])?.text, format!("{links}{rest}"));
        // A level that the changes no longer suit does not matter: it is replaced.
        let unsuited = source.text.replace("rod.modes=2", "solver.integrator=runge-kutta");
        assert!(
            SceneSource::parse("test.toml", &unsuited, &[])?.with_levels(&["solver.model=rigid".to_owned()], &levels()).is_ok()
        );
        let inline = format!("level = [{{ name = \"a\" }}]\n{text}");
        let with = SceneSource::parse("test.toml", &inline, &[])?.with_levels(&[], &levels())?;
        assert!(with.text.ends_with(&new) && with.scene.levels.len() == 2, "{}", with.text);
        Ok(())
    }
}
