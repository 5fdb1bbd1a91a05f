//! Parses text to raw structs: names and types, with the nearest valid key for an unknown name.

use super::document::{self, SceneText};
use super::error::MOST_FURTHER;
use super::{SceneError, keys, raw, validate};
use crate::nearest::did_you_mean_key;

pub(super) fn parse(text: &SceneText) -> Result<raw::Scene, SceneError> {
    let scene = toml::from_str(&text.merged).map_err(|error| {
        let first = refusal(text, &text.merged, &error);
        let others = others(text, &first);
        text.joined(first, others)
    })?;
    let mut listed = tables_as_lists(text);
    match listed.pop() {
        None => Ok(scene),
        Some(refused) => Err(text.joined(refused, listed)),
    }
}

/// Lists whose entries are tables.
pub(super) const LISTS_OF_TABLES: [&str; 2] = ["pulse", "level"];
/// Keys of other lists.
const LISTS: [&str; 7] = ["resistance_table", "table", "changes", "masses_kg", "springs", "forces_n", "start_m"];

/// The refusals of lists in place of tables. serde would take the values of `gravity = [0, 0, -9.81]` for those of the table's keys in
/// their order, and drop what is left.
fn tables_as_lists(text: &SceneText) -> Vec<SceneError> {
    let mut found = Vec::new();
    if !text.merged.split('=').skip(1).any(|value| value.trim_start().starts_with('[')) {
        return found;
    }
    let mut places: Vec<(String, toml::Value)> = Vec::new();
    let scene: toml::Table = toml::from_str(&text.merged).unwrap_or_default();
    places.extend(scene);
    while let Some((path, value)) = places.pop() {
        let key = path.rsplit('.').next().unwrap_or(&path);
        let below = |name: &dyn std::fmt::Display, value| (format!("{path}.{name}"), value);
        match value {
            toml::Value::Table(table) => places.extend(table.into_iter().map(|(name, value)| below(&name, value))),
            toml::Value::Array(entries) if LISTS_OF_TABLES.contains(&path.as_str()) => {
                places.extend(entries.into_iter().enumerate().map(|(place, entry)| below(&place, entry)));
            }
            toml::Value::Array(_) if !LISTS.contains(&key) && found.len() < MOST_FURTHER => {
                found.push(text.refuse(&path, format!("must be a table{}", known_keys(&path))));
            }
            _ => {}
        }
    }
    found
}

/// The other names and types that are wrong: what remains of the text without the refused keys is read again. The name of a model
/// that does not exist is one of them.
fn others(text: &SceneText, first: &SceneError) -> Vec<SceneError> {
    let mut found = Vec::new();
    let mut read = document::without(&text.merged, &first.key);
    while let Some(rest) = read.filter(|_| found.len() < MOST_FURTHER) {
        match toml::from_str::<raw::Scene>(&rest) {
            Ok(scene) => {
                found.extend(validate::unknown_model(text, &scene));
                break;
            }
            Err(error) => {
                let refused = refusal(text, &rest, &error);
                read = document::without(&rest, &refused.key);
                found.push(refused);
            }
        }
    }
    found
}

/// The refusal of the key at which reading `read`, a part of the text, ended.
fn refusal(text: &SceneText, read: &str, error: &toml::de::Error) -> SceneError {
    let mut key = error.span().map(|span| document::path_at(read, span.start)).unwrap_or_default();
    // Of a list whose name is unknown, and not of its first entry.
    if let Some(list) = key.strip_suffix(".0").filter(|_| error.message().starts_with("unknown field ")) {
        key = list.to_owned();
    }
    let problem = match describe(error.message()).as_str() {
        "must be a table" => format!("must be a table{}", known_keys(&key)),
        "must be a list" if !key.contains('.') => format!("must be a list, each entry in a table [[{key}]]"),
        problem => match key.strip_suffix(".0").filter(|table| is_single_table(table)) {
            Some(table) => return text.refuse(table, format!("must be a single table [{table}]")),
            None if problem.contains("did you mean") => problem.to_owned(),
            None => format!("{problem}{}", elsewhere(&key, error.message())),
        },
    };
    let is_of_value = ["invalid type: ", "unknown variant "].into_iter().any(|beginning| error.message().starts_with(beginning));
    SceneError { never_allowed: is_of_value, ..text.refuse(&key, problem) }
}

/// The refusal of a list under a dotted path, where a scene has no list: its key is unknown, or holds something else.
pub(super) fn refused_list(path: &str) -> Option<String> {
    // `pulse.0.name` becomes `"pulse" = [{ "name" = [] }]`.
    let nested = path.rsplit('.').fold("[]".to_owned(), |inner, part| match part.parse::<usize>() {
        Ok(_) => format!("[{inner}]"),
        Err(_) => format!("{{ {part:?} = {inner} }}"),
    });
    let text = nested.strip_prefix('{')?.strip_suffix('}')?.trim();
    let error = toml::from_str::<raw::Scene>(text).err()?;
    let problem = describe(error.message());
    if let Some(given) = error.message().strip_prefix("unknown field `").and_then(|rest| rest.split('`').next()) {
        return Some(format!("{given}: {problem}"));
    }
    let is_of_list = error.span().and_then(|span| text.get(span.start..)).is_some_and(|rest| rest.starts_with("[]"));
    is_of_list.then(|| format!("{path}: {problem}"))
}

/// Whether a scene has a table of this name, and no list.
fn is_single_table(name: &str) -> bool {
    keys::reference().iter().any(|row| !row.table.contains("[[") && row.table.split(['[', ']']).any(|title| title == name))
}

/// The keys of a table of the scene, or of an entry of a list such as `pulse.0`, as a hint.
fn known_keys(table: &str) -> String {
    let list = table.rsplit_once('.').filter(|(_, entry)| entry.parse::<usize>().is_ok()).map(|(list, _)| list);
    let title = format!("[{}]", list.unwrap_or(table));
    let names: Vec<&str> = keys::reference().iter().filter(|row| row.table.contains(&title)).map(|row| row.key).collect();
    if names.is_empty() { String::new() } else { format!(" (known here: {})", names.join(", ")) }
}

/// Keys by which other formats name and describe a whole file.
const OF_THE_FILE: [&str; 3] = ["name", "title", "description"];

/// The other tables that have an unknown key, and that which is named by its first word: `[torque]` for `drive.torque_nm`.
fn elsewhere(path: &str, message: &str) -> String {
    let Some(given) = message.strip_prefix("unknown field `").and_then(|rest| rest.split('`').next()) else {
        return String::new();
    };
    if path == given && OF_THE_FILE.contains(&given) {
        return "; a scene has the name of its file, and comments stand after #".to_owned();
    }
    let rows = keys::reference();
    let tables: Vec<&str> = rows.iter().filter(|row| row.key == given).map(|row| row.table).collect();
    let first_word = given.split('_').next().unwrap_or_default();
    let is_inside = path.split('.').next() == Some(first_word);
    let named = rows.iter().map(|row| row.table).find(|table| !is_inside && *table == format!("[{first_word}]"));
    let keys = if tables.is_empty() { String::new() } else { format!("; it is a key of {}", tables.join(", ")) };
    let table = named.map(|table| format!("; {table} is a table by itself")).unwrap_or_default();
    keys + &table
}

/// serde's message, with the nearest of the names it expected where one was unknown.
pub(crate) fn describe(message: &str) -> String {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match (message.starts_with("unknown"), quoted.split_first()) {
        (true, Some((given, expected))) => {
            let hint = did_you_mean_key(given, expected);
            format!("unknown {}{hint} (known here: {})", kind(message), expected.join(", "))
        }
        _ => in_words(&message.trim().replace('\n', " ")),
    }
}

/// Wrong types and missing keys in the words of scene files; other messages stay as they are.
fn in_words(message: &str) -> String {
    if let Some(key) = message.strip_prefix("missing field ") {
        return format!("missing key {key}");
    }
    if message == "wanted string or table" {
        return "must be a word in quotes".to_owned();
    }
    // An empty list in place of a table has an invalid length; a negative count has an invalid value.
    let beginnings = ["invalid type: ", "invalid length ", "invalid value: "];
    let mismatch = beginnings.into_iter().find_map(|beginning| message.strip_prefix(beginning));
    let Some((_, expected)) = mismatch.and_then(|rest| rest.rsplit_once(", expected ")) else {
        return message.to_owned();
    };
    let needed = match expected {
        "f32" | "f64" => "a number without its unit, which the key names",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number from 0",
        "a nonzero u64" => "a whole number from 1",
        "a boolean" => "true or false",
        "a string" => "a word in quotes",
        "a sequence" => "a list",
        other if other.contains("array") || other.contains("tuple") => "a list of lists of numbers",
        other if other.contains("struct") || other.contains("enum") || other.contains("map") => "a table",
        other => other,
    };
    format!("must be {needed}")
}

fn kind(message: &str) -> &'static str {
    if message.starts_with("unknown variant") { "value" } else { "key" }
}

#[cfg(test)]
mod tests {
    use super::describe;
    use crate::scene::SceneSource;

    fn refused(text: &str, overrides: &[&str]) -> String {
        let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
        SceneSource::parse("scene.toml", text, &overrides).err().map(|refused| refused.in_full()).unwrap_or_default()
    }

    /// Values were taken for those of the keys in their order, and the others dropped: this scene had no gravity.
    #[test]
    fn regress_a_list_in_place_of_a_table_is_refused() {
        let beam = "[beam]\nlength_m = 1.0\nmass_kg = 2.0\nrigid = true\n";
        for (list, table) in [
            ("gravity = [0, 0, -9.81]", "gravity = [0, 0, -9.81]: must be a table (known here: x_m_per_s2, y_m_per_s2)"),
            ("gravity = [0, -9.81]", "gravity = [0, -9.81]: must be a table"),
            ("tip = [3]", "tip = [3]: must be a table (known here: mass_kg)"),
            ("start = [1.0, 2.0, false]", "must be a table"),
            ("pulse = [[0, 1, 0.2, \"rectangular\"]]", "must be a table (known here: start_s"),
            ("level = [[\"a\", [], 0.1]]", "must be a table (known here: name"),
        ] {
            let said = refused(&format!("{list}\n{beam}"), &[]);
            assert!(said.starts_with("scene.toml:1: ") && said.contains(table), "{said}");
        }
        let said = refused(beam, &["gravity=[0,0,-9.81]"]);
        assert!(said.starts_with("--set gravity=[0,0,-9.81]: gravity = [0,0,-9.81]: must be a table"), "{said}");
        // Lists that are meant.
        assert_eq!(
            refused(
                "pulse = [{ start_s = 0, torque_nm = 1, duration_s = 0.1 }]\nlevel = []\n[beam]\nlength_m = 1\nmass_kg = 2\nrigid = true\n",
                &[]
            ),
            ""
        );
    }

    #[test]
    fn regress_an_oscillator_has_nothing_that_acts_on_links() {
        let masses = "[oscillator]\nmasses_kg = [1.0]\nsprings = [[0, 1, 4.0]]\n";
        for (table, key) in [
            ("gravity", "x_m_per_s2 = -9.81"),
            ("start", "rate_rad_per_s = 3.0"),
            ("base", "damper_nm_s_per_rad = 5.0"),
            ("commands", "torque_limit_nm = 5.0"),
        ] {
            let said = refused(&format!("{masses}[{table}]\n{key}\n"), &[]);
            assert_eq!(said, format!("scene.toml:4: {table}: does not go with an [oscillator]"));
        }
        assert_eq!(refused(masses, &[]), "");
    }

    /// The line that nobody had touched was blamed.
    #[test]
    fn regress_an_override_that_breaks_a_rule_is_blamed_itself() {
        let text = crate::scene::builtin::find("crank-slider").map(|scene| scene.text).unwrap_or_default();
        for (given, said) in [
            ("crank.length_m=2", "crank.length_m = 2: must be shorter than rod.length_m = 1.5, or the crank cannot turn"),
            (
                "rod.section.shape=round",
                "this shape has only diameter_m, and the section has width_m: set the whole of rod.section",
            ),
            (
                "rod.mass_kg=1",
                "only for a rigid link (rigid = true, or model \"rigid\"): a flexible one has its mass from section",
            ),
        ] {
            let refused = refused(text, &[given]);
            assert!(refused.starts_with(&format!("--set {given}: ")) && refused.contains(said), "{refused}");
        }
        let given = ["rod.section={shape=\"round\",diameter_m=0.01}"];
        assert_eq!(refused(text, &given), "");
    }

    #[test]
    fn regress_all_that_a_link_lacks_is_named_at_once() {
        let said = refused("[beam]\nlength_m = 1.0\n", &[]);
        for key in ["`area_m2` and `second_moment_m4` (or `section`)", "`density_kg_per_m3`", "`youngs_modulus_pa`"] {
            assert!(said.contains(key), "{said}");
        }
        let said = refused("[beam]\nlength_m = 1.0\nrigid = true\n", &[]);
        let missing = "missing key `mass_kg`, or `section` (or `area_m2`) and `density_kg_per_m3`";
        assert_eq!(said, format!("scene.toml:1: beam: {missing}"));
    }

    #[test]
    fn regress_integer_types_are_whole_numbers_in_words() {
        for (given, expected, said) in [
            ("invalid type: floating point `4.5`", "i32", "must be a whole number"),
            ("invalid type: floating point `4.5`", "u64", "must be a whole number from 0"),
            ("invalid value: integer `-4`", "u64", "must be a whole number from 0"),
            ("invalid type: string \"a\"", "usize", "must be a whole number from 0"),
        ] {
            assert_eq!(describe(&format!("{given}, expected {expected}")), said);
        }
    }

    #[test]
    fn regress_a_key_of_another_table_is_told_with_that_table() {
        let beam = "[beam]\nlength_m = 1.0\nmass_kg = 2.0\nrigid = true\n";
        let text = crate::scene::builtin::find("crank-slider").map(|scene| scene.text).unwrap_or_default();
        for (given, said) in [
            ("drive.torque_nm=1", "ramp, table); it is a key of [[pulse]]; [torque] is a table by itself"),
            ("crank.rate_rad_per_s=1", "); it is a key of [start]"),
            ("solver.gravity=1", "); [gravity] is a table by itself"),
            ("resistance_n=1", "); it is a key of [slider]"),
            ("rod.colour=1", "axial, damping_s)"),
            ("name=press", "); a scene has the name of its file, and comments stand after #"),
            // A key near at hand is enough.
            ("start.rate=1", "did you mean `rate_rad_per_s`? (known here: angle_rad, rate_rad_per_s, static_equilibrium)"),
            ("torque.torque_xy=1", "(known here: constant_nm)"),
        ] {
            let refused = refused(text, &[given]);
            assert!(refused.starts_with(&format!("--set {given}: ")) && refused.trim_end().ends_with(said), "{given}: {refused}");
        }
        let said = refused(&format!("mass_kg = 1\n{beam}"), &[]);
        assert!(said.ends_with("it is a key of [crank], [rod] or [beam], [slider], [tip]"), "{said}");
    }

    #[test]
    fn regress_a_key_is_near_whatever_its_unit_is() {
        let known = "expected `torsion_spring_nm_per_rad` or `damper_nm_s_per_rad`";
        let said = describe(&format!("unknown field `damping`, {known}"));
        assert!(said.starts_with("unknown key; did you mean `damper_nm_s_per_rad`? (known here: "), "{said}");
        let said = describe(&format!("unknown field `mass`, {known}"));
        assert!(said.starts_with("unknown key (known here: "), "{said}");
    }

    /// Only a rigid link may give its mass: that is no mistake of a scene whose model is unknown.
    #[test]
    fn regress_an_unknown_model_is_refused_with_the_other_mistakes_and_none_that_follow_from_it() {
        let links = "[crank]\nlength_m = 0.5\nmass_kg = 1.0\n[rod]\nlength_m = 1.5\nmass_kg = 1.0\n[slider]\n";
        let rigid = "solver.model = \"rigd\": must be one of rigid, ";
        for (text, expected) in [
            (format!("{links}mas_kg = 1.0\n[solver]\nmodel = \"rigd\"\n"), &["slider.mas_kg = 1.0: unknown key", rigid][..]),
            (format!("{links}mass_kg = -1.0\n[solver]\nmodel = \"rigd\"\n"), &["slider.mass_kg = -1.0: must be a number", rigid]),
            ("[oscillator]\nmasses_kg = [1.0]\n[solver]\nmodel = \"sprng\"\n".to_owned(), &["solver.model = \"sprng\": must be"]),
            // An unknown list hid what sorts behind it.
            (
                format!("{links}[[pulze]]\nstart_s = 0\n[tipp]\nmass_kg = 1.0\n[solver]\nstp_s = 1e-3\n"),
                &["pulze: unknown key; did you mean `pulse`?", "tipp: unknown key", "solver.stp_s"],
            ),
            ("[oscilator]\nmasses_kg = [1.0]\n[solver]\nmodel = \"mass-spring\"\n".to_owned(), &["oscilator: unknown key"]),
        ] {
            let refused = SceneSource::parse("scene.toml", &text, &[]).err().map(|refused| refused.in_full()).unwrap_or_default();
            let lines: Vec<&str> = refused.lines().collect();
            assert_eq!(lines.len(), expected.len(), "{refused}");
            assert!(lines.iter().zip(expected).all(|(line, expected)| line.contains(*expected)), "{refused}");
        }
    }
}
