//! A scene's text with overrides applied, and the way back from a key to the line it stands in.

use std::ops::Range;

use toml_edit::{Document, DocumentMut, Item, TableLike, TomlError, Value};

use super::syntax::{number, syntax_problem};
use super::{SceneError, parse};
use crate::repeated_table::repeated_table;

/// The text of a scene, where it came from, and the overrides that changed it.
pub(super) struct SceneText {
    pub origin: String,
    /// The text as it was read. Refusals name its lines.
    pub as_read: String,
    /// The text before the overrides: as it was read, or as earlier overrides left it.
    before: String,
    overrides: Vec<(String, String)>,
    /// The text in force: the one before, with the overrides written into it.
    pub merged: String,
}

impl SceneText {
    /// Applies `KEY=VALUE` overrides to a scene that was read from `origin` as the text `as_read`, and is `text` by now. VALUE
    /// is TOML; a bare word is taken as a string.
    pub fn new((origin, as_read): (&str, &str), text: &str, overrides: &[String]) -> Result<Self, SceneError> {
        let mut document: DocumentMut = text.parse().map_err(|error: TomlError| not_toml(origin, text, &error))?;
        let mut applied = Vec::new();
        for given in overrides {
            let refuse = |problem: &str| SceneError::whole(format!("--set {given}"), problem);
            let (key, value) = key_and_value(given)?;
            let parsed = read(key, value).map_err(|problem| refuse(&problem))?;
            set(document.as_item_mut(), key, parsed).map_err(|problem| refuse(&problem))?;
            applied.push((key.to_owned(), value.to_owned()));
        }
        let [origin, as_read, before] = [origin, as_read, text].map(str::to_owned);
        Ok(SceneText { origin, as_read, before, overrides: applied, merged: document.to_string() })
    }

    /// The refusal of the value of `key`.
    pub fn refuse(&self, key: &str, problem: impl Into<String>) -> SceneError {
        let (place, value) = (self.place(key), written(&self.merged, key).1);
        SceneError { place, key: key.to_owned(), value, problem: problem.into(), never_allowed: false, further: Box::default() }
    }

    /// Whether the scene had `key` before the overrides.
    pub fn had(&self, key: &str) -> bool {
        written(&self.before, key).0
    }

    /// The override by which `key` came into the scene, as the key that it sets; `None` if the scene had `key` before.
    pub fn added(&self, key: &str) -> Option<&str> {
        let (set, _) = self.overrides.iter().rev().find(|(set, _)| is_within(set, key))?;
        (!self.had(key)).then_some(set.as_str())
    }

    /// Whether an override gave `key`, or a part of it.
    pub fn is_overridden(&self, key: &str) -> bool {
        self.overrides.iter().any(|(set, _)| is_within(key, set) || is_within(set, key))
    }

    /// Where `key` was given: `--set`, or file and line (of the nearest existing table). No line, if the file gave another value.
    fn place(&self, key: &str) -> String {
        let span = self.span(key);
        let is_new = !matches!(span, Some((_, true)));
        // A table that the text does not have stands there because one of its keys was set.
        let set = self.overrides.iter().rev().find(|(set, _)| is_within(key, set) || is_new && is_within(set, key));
        match set {
            Some((set, value)) => format!("--set {set}={value}"),
            None => place_at(&self.origin, &self.as_read, span.map(|(span, _)| span).filter(|_| self.is_as_read(key))),
        }
    }

    /// Refusals as one: the first by line, with the others.
    pub fn joined(&self, refused: SceneError, mut others: Vec<SceneError>) -> SceneError {
        others.push(refused);
        others.sort_by_cached_key(|refused| self.span(&refused.key).map_or(0, |(span, _)| span.start));
        let first = others.remove(0);
        SceneError { further: others.into_boxed_slice(), ..first }
    }

    /// Whether `key` is in force as it was read.
    fn is_as_read(&self, key: &str) -> bool {
        self.as_read == self.merged || written(&self.as_read, key) == written(&self.merged, key)
    }

    /// The span of `key` in the text as it was read, or of the nearest table above it, with whether it is the key's own.
    fn span(&self, key: &str) -> Option<(Range<usize>, bool)> {
        let document = Document::parse(self.as_read.as_str()).ok()?;
        let path: Vec<&str> = key.split('.').collect();
        let span = |parts: usize| Some((key_span(document.as_item(), &path[..parts])?, parts == path.len()));
        (1..=path.len()).rev().find_map(span)
    }
}

/// Whether a text has `key`, and the value given for it, as written.
fn written(text: &str, key: &str) -> (bool, Option<Box<str>>) {
    let Ok(document) = Document::parse(text) else { return (false, None) };
    let item = key.split('.').try_fold(document.as_item(), |item, part| child(item, part));
    let span = item.and_then(Item::as_value).and_then(|value| value.span());
    (item.is_some(), span.and_then(|span| text.get(span)).map(Box::from))
}

/// Key and value of an override.
///
/// # Errors
/// The refusal of a text without an equals sign.
pub(super) fn key_and_value(given: &str) -> Result<(&str, &str), SceneError> {
    let problem = "expected KEY=VALUE, such as slider.mass_kg=0.3";
    let (key, value) = given.split_once('=').ok_or_else(|| SceneError::whole(format!("--set {given}"), problem))?;
    Ok((key.trim(), value.trim()))
}

/// Whether a dotted key is `table` or stands in it.
pub(super) fn is_within(key: &str, table: &str) -> bool {
    key.strip_prefix(table).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// The dotted path of the innermost key or value that covers `offset` of a text.
pub(super) fn path_at(text: &str, offset: usize) -> String {
    let Ok(document) = Document::parse(text) else { return String::new() };
    let mut path = Vec::new();
    descend(document.as_item(), offset, &mut path);
    path.join(".")
}

/// A text without the key of a dotted path, or without the list that has it as an entry; `None` if it does not have that key.
pub(super) fn without(text: &str, path: &str) -> Option<String> {
    let mut document: DocumentMut = text.parse().ok()?;
    let (parents, last) = path.rsplit_once('.').unwrap_or(("", path));
    let mut parts = parents.split('.').filter(|part| !part.is_empty());
    let parent = parts.try_fold(document.as_item_mut(), |item, part| child_mut(item, part))?;
    if parent.is_array() {
        return without(text, parents);
    }
    parent.as_table_like_mut()?.remove(last)?;
    Some(document.to_string())
}

/// The refusal of a text that is no TOML.
fn not_toml(origin: &str, text: &str, error: &TomlError) -> SceneError {
    match repeated_table(text, (error.message(), error.span()), |name| parse::refused_list(name).is_none()) {
        Some((place, problem)) => SceneError::whole(place_at(origin, text, Some(place..place)), format!("not TOML: {problem}")),
        None => SceneError::whole(place_at(origin, text, error.span()), syntax_problem("", text, error)),
    }
}

/// The value of a key as TOML. Text that begins like no other value is a bare word: a string.
fn read(key: &str, text: &str) -> Result<Value, String> {
    if text.is_empty() {
        return Err("expected KEY=VALUE: the value is missing".to_owned());
    }
    let is_value = text.starts_with(|first: char| first.is_ascii_digit() || "[{\"'+-".contains(first));
    // `.3` and `−3` are numbers that TOML does not know.
    let is_word = !is_value && number(text).is_none();
    text.parse().or_else(|error: TomlError| match is_word {
        true => Ok(Value::from(text)),
        false => Err(syntax_problem(key, text, &error)),
    })
}

fn place_at(origin: &str, text: &str, span: Option<Range<usize>>) -> String {
    match span {
        Some(span) => format!("{origin}:{}", lines_before(text, &span) + 1),
        None => origin.to_owned(),
    }
}

/// Number of line ends before a span of a text.
fn lines_before(text: &str, span: &Range<usize>) -> usize {
    text[..span.start.min(text.len())].matches('\n').count()
}

fn child<'a>(item: &'a Item, part: &str) -> Option<&'a Item> {
    match part.parse::<usize>() {
        Ok(index) => item.get(index),
        Err(_) => item.get(part),
    }
}

fn child_mut<'a>(item: &'a mut Item, part: &str) -> Option<&'a mut Item> {
    match part.parse::<usize>() {
        Ok(index) => item.get_mut(index),
        Err(_) => item.get_mut(part),
    }
}

/// Most parts of a dotted key: more than any key has.
const MOST_PARTS: usize = 16;

/// Sets `path` (dotted, numbers index arrays of tables) in `item`, making tables on the way.
fn set(mut item: &mut Item, path: &str, value: Value) -> Result<(), String> {
    if path.split('.').count() > MOST_PARTS {
        return Err(format!("no key has more than {MOST_PARTS} parts"));
    }
    let mut parts = path.split('.').peekable();
    let mut passed = 0;
    while let Some(part) = parts.next() {
        let parent = path.get(..passed).unwrap_or_default();
        let indexed = part.parse::<usize>();
        if part.is_empty() || parent.is_empty() && indexed.is_ok() {
            return Err("expected KEY=VALUE with a KEY such as rod.length_m".to_owned());
        }
        let next = match indexed {
            Ok(index) => {
                let entries = entries(item);
                if parts.peek().is_none() && item.is_array_of_tables() && index < entries {
                    return Err(format!("{path} is a table: set one of its keys, such as {path}.KEY={value}"));
                }
                let missing = || match entries {
                    0 => parse::refused_list(parent).unwrap_or_else(|| {
                        let entry = if parse::LISTS_OF_TABLES.contains(&parent) { "{ … }" } else { "…" };
                        format!("`{parent}` has no entries; give all of them, as in '{parent}=[{entry}]'")
                    }),
                    entries => format!("`{parent}` has entries 0 to {}, and none numbered {index}", entries - 1),
                };
                item.get_mut(index).ok_or_else(missing)?
            }
            Err(_) => {
                let is_list = item.is_array_of_tables();
                let table = item.as_table_like_mut().ok_or_else(|| match is_list {
                    true => format!("`{parent}` is a list: number the entry, as in {parent}.0.{part}"),
                    false => format!("`{part}` is not in a table"),
                })?;
                if parts.peek().is_some() && !table.contains_key(part) {
                    table.insert(part, toml_edit::table());
                }
                table.entry(part).or_insert(Item::None)
            }
        };
        if parts.peek().is_none() {
            *next = Item::Value(value);
            return Ok(());
        }
        item = next;
        passed += usize::from(passed > 0) + part.len();
    }
    Err("expected KEY=VALUE".to_owned())
}

/// Number of entries of a list or of an array of tables; 0 for anything else.
fn entries(item: &Item) -> usize {
    item.as_array_of_tables().map(|tables| tables.len()).or(item.as_array().map(|list| list.len())).unwrap_or(0)
}

/// The entries of a list or of an array of tables, numbered from 0.
fn numbered(item: &Item) -> impl Iterator<Item = (usize, &Item)> {
    (0..entries(item)).filter_map(move |index| Some((index, item.get(index)?)))
}

fn key_span(item: &Item, path: &[&str]) -> Option<Range<usize>> {
    let (last, parents) = path.split_last()?;
    let parent = parents.iter().try_fold(item, |item, part| child(item, part))?;
    let table = parent.as_table_like();
    table
        .and_then(|table| table.key(last).and_then(|key| key.span()).filter(|_| table.contains_key(last)))
        .or_else(|| child(parent, last)?.span())
}

fn descend(item: &Item, offset: usize, path: &mut Vec<String>) {
    if let Some(table) = item.as_table_like() {
        return descend_table(table, offset, path);
    }
    if let Some((index, entry)) = numbered(item).find(|(_, entry)| covers(entry, offset)) {
        path.push(index.to_string());
        descend(entry, offset, path);
    }
}

fn descend_table(table: &dyn TableLike, offset: usize, path: &mut Vec<String>) {
    for (name, item) in table.iter() {
        let on_key = table.key(name).and_then(|key| key.span()).is_some_and(|span| span.contains(&offset));
        if on_key || covers(item, offset) {
            path.push(name.to_owned());
            return descend(item, offset, path);
        }
    }
}

/// Whether an item covers `offset` of the text, or a key, a value or an entry of it does.
fn covers(item: &Item, offset: usize) -> bool {
    item.span().is_some_and(|span| span.contains(&offset))
        || item.as_table_like().is_some_and(|table| covers_entry(table, offset))
        || numbered(item).any(|(_, entry)| covers(entry, offset))
}

fn covers_entry(table: &dyn TableLike, offset: usize) -> bool {
    table.iter().any(|(name, item)| {
        table.key(name).and_then(|key| key.span()).is_some_and(|span| span.contains(&offset))
            || item.span().is_some_and(|span| span.contains(&offset))
    })
}

#[cfg(test)]
mod tests {
    use crate::scene::{SceneSource, builtin};

    fn refused(text: &str, given: &[&str]) -> String {
        let overrides: Vec<String> = given.iter().map(|&given| given.to_owned()).collect();
        SceneSource::parse("scene.toml", text, &overrides).err().map(|refused| refused.to_string()).unwrap_or_default()
    }

    #[test]
    fn regress_a_table_before_the_entries_of_its_list_is_refused_by_its_line() {
        let said = refused("[pulse]\ntorque_nm = 1\n[[pulse]]\ntorque_nm = 2\n", &[]);
        assert_eq!(said, "scene.toml:1: not TOML: [pulse] is there twice: each entry of a list is a table [[pulse]]");
    }

    #[test]
    fn regress_a_mistake_in_a_list_of_one_line_names_entry_and_key() {
        let text = builtin::find(builtin::DEFAULT).map(|scene| scene.text).unwrap_or_default();
        let known = "(known here: start_s, torque_nm, duration_s, shape)";
        let unknown = format!("unknown key; did you mean `torque_nm`? {known}");
        let number = "must be a number without its unit, which the key names";
        for (given, said) in [
            ("pulse=[{start_s=0, torque=1, duration_s=1}]", format!("pulse.0.torque = 1: {unknown}")),
            ("pulse=[{}, {start_s=0, torque_nm=true}]", format!("pulse.1.torque_nm = true: {number}")),
            ("pulse=[{start_s=0, torque_nm=1, duration_s=1}, 3]", format!("pulse.1 = 3: must be a table {known}")),
            ("level=[{name='a', changes=[3]}]", "level.0.changes.0 = 3: must be a word in quotes".to_owned()),
            ("slider.resistance_table=[[0, 0], [1, 'a']]", format!("slider.resistance_table.1.1 = 'a': {number}")),
        ] {
            assert_eq!(refused(text, &[given]), format!("--set {given}: {said}"));
        }
        let lines = "pulse = [\n  3,\n  { torque = 1 },\n]\n[slider]\nresistance_table = [[0, 'a'], [1, 'b']]\nmas_kg = 1\n";
        let further = SceneSource::parse("scene.toml", lines, &[]).err().map(|refused| refused.in_full()).unwrap_or_default();
        let keys: Vec<&str> = further.lines().filter_map(|line| line.trim().split(" = ").next()).collect();
        let expected = ["scene.toml:2: pulse.0", "scene.toml:6: slider.resistance_table.0.1", "scene.toml:7: slider.mas_kg"];
        assert_eq!(keys, expected, "a refused entry goes with its list: {further}");
    }

    #[test]
    fn regress_commas_between_thousands_are_refused_with_the_number_to_write() {
        let text = builtin::find(builtin::DEFAULT).map(|scene| scene.text).unwrap_or_default();
        let problem = "not TOML: a number has no commas: 12_000_000_000 or 1.2e10";
        let given = "rod.youngs_modulus_pa=12,000,000,000";
        assert_eq!(refused(text, &[given]), format!("--set {given}: {problem}"));
        let said = refused(&text.replace("youngs_modulus_pa = 2.1e11", "youngs_modulus_pa = 12,000,000,000  # pine"), &[]);
        assert_eq!(said, format!("scene.toml:8: {problem}"));
        let said = refused(text, &["slider.mass_kg=1,500"]);
        assert!(said.ends_with("a number has no commas: 1_500 or 1.5e3, or with a decimal point 1.500"), "{said}");
    }

    /// `.3` was a text, and the number was refused for a unit that it does not have.
    #[test]
    fn regress_a_number_without_a_leading_zero_is_no_text() {
        let text = builtin::find(builtin::DEFAULT).map(|scene| scene.text).unwrap_or_default();
        for (value, number) in [(".3", "0.3"), (".8e-5", "8e-6"), ("−.3", "-0.3")] {
            let given = format!("slider.mass_kg={value}");
            let problem = format!("--set {given}: not TOML: {value} is written as {number}");
            assert_eq!(refused(text, &[&given]), problem);
        }
    }

    #[test]
    fn regress_a_share_in_per_cent_is_refused_with_the_number_to_write() {
        let text = builtin::find(builtin::DEFAULT).map(|scene| scene.text).unwrap_or_default();
        let said = refused(text, &["solver.balance_tolerance=1%"]);
        assert_eq!(said, "--set solver.balance_tolerance=1%: not TOML: 1% is written as 0.01");
        let said = refused(&text.replace("[solver]", "[solver]\nbalance_tolerance = 0.5 %  # strict"), &[]);
        assert!(said.ends_with(": not TOML: 0.5 % is written as 0.005"), "{said}");
    }

    #[test]
    fn regress_a_share_is_refused_where_the_key_has_a_unit() {
        let text = builtin::find(builtin::DEFAULT).map(|scene| scene.text).unwrap_or_default();
        let damping = "damping_s is in s: `flexcrank guide scenes` has its value for a damping ratio";
        let said = refused(text, &["rod.damping_s=0.5%"]);
        assert_eq!(said, format!("--set rod.damping_s=0.5%: not TOML: `0.5%` is a share, and rod.{damping}"));
        for (was, is, problem) in [
            ("damping_s = 1e-4", "damping_s = 2 %  # of critical", format!("`2 %` is a share, and {damping}")),
            ("width_m = 0.01", "width_m = 1%", "`1%` is a share, and width_m is in m".to_owned()),
            ("damping_s = 1e-4", "\"damping_s\" = 1%", format!("`1%` is a share, and {damping}")),
            ("modes = 4", "modes = 50%", "`50%` is a share, and modes is a whole number".to_owned()),
            ("modes = 4", "modes =\n5%", "5% is written as 0.05".to_owned()),
        ] {
            let said = refused(&text.replace(was, is), &[]);
            assert!(said.ends_with(&format!(": not TOML: {problem}")), "{said}");
        }
        let given = "pulse=[{start_s=0, torque_nm=5%}]";
        assert_eq!(refused(text, &[given]), format!("--set {given}: not TOML: `5%` is a share, and torque_nm is in N·m"));
    }
}
