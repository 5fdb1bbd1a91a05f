//! Why a text is no TOML, with hints at numbers, text and lists that are written otherwise there.

use toml_edit::TomlError;

use super::keys;
use crate::decimal_comma::{decimal_comma_hint, thousands_commas_hint};
use crate::percent::percent_hint;
use crate::shown::Shown;

/// Beginnings of the parser's messages about a value that is no number, no boolean and no text in quotes.
const OF_VALUES: [&str; 10] = [
    "invalid time",
    "invalid date",
    "string values must be quoted",
    "invalid boolean",
    "invalid float",
    "invalid mantissa",
    "invalid fraction",
    "invalid exponent",
    "unexpected leading zero",
    "`_` may only go between digits",
];
/// Beginnings of the parser's messages about a line that is no key with its value and no table.
const OF_LINES: [&str; 3] = ["key with no value", "invalid key-value pair", "missing table open"];

/// The reason why a file, or the value of `key`, is no TOML, with the remedy for common mistakes. The key is empty for a file.
pub(crate) fn syntax_problem(key: &str, text: &str, error: &TomlError) -> String {
    let message = error.message().trim().replace('\n', " ");
    let message = message.trim_end_matches(", expected nothing");
    let span = error.span().unwrap_or_default();
    let hint = match message {
        "duplicate key" => text.get(span).map(|key| format!("{} is there twice", key.trim())),
        _ => Fault::new(message, (key, text), span.start).hint(),
    };
    format!("not TOML: {}", hint.as_deref().unwrap_or(message))
}

/// The place at which the parser stopped.
struct Fault<'a> {
    /// The parser's message.
    message: &'a str,
    /// The key that the place belongs to; empty if there is none in the line.
    key: &'a str,
    /// The key whose value the text is; empty for a file.
    key_of_text: &'a str,
    line: &'a str,
    line_before: &'a str,
    /// The part of the line before the place.
    before: &'a str,
    /// The part of the line from the place on.
    after: &'a str,
}

impl<'a> Fault<'a> {
    /// The fault at byte `place` of a file, or of the value of `key`.
    fn new(message: &'a str, (key, text): (&'a str, &'a str), place: usize) -> Self {
        let line_break = text.get(..place).and_then(|before| before.rfind('\n'));
        let (above, rest) = text.split_at(line_break.map_or(0, |line_break| line_break + 1));
        let line = rest.lines().next().unwrap_or_default();
        let (before, after) = line.split_at_checked(place - above.len()).unwrap_or((line, ""));
        Fault {
            message,
            key: key_before(before).unwrap_or(key),
            key_of_text: key,
            line,
            line_before: above.lines().next_back().unwrap_or_default(),
            before,
            after,
        }
    }

    /// The value without quotes that covers the place.
    fn value(&self) -> &'a str {
        let start = self.before.rfind(['=', ',', '[', '{']).map_or(0, |delimiter| delimiter + 1);
        let length = self.after.find([',', ']', '}', '#']).unwrap_or(self.after.len());
        self.line.get(start..self.before.len() + length).unwrap_or_default().trim()
    }

    /// The remedy for a common mistake.
    fn hint(&self) -> Option<String> {
        comma_in(before_comment(self.line))
            .or_else(|| share_hint(self.key, self.value()))
            .or_else(|| unit_hint(self.value()))
            .or_else(|| range_hint(self.key, self.value()))
            .or_else(|| self.value_hint())
            .or_else(|| self.list_hint())
            .or_else(|| self.line_hint())
            .or_else(|| self.bracket_hint())
    }

    /// A hint at a value that is missing, or is no number, no boolean and no text in quotes.
    fn value_hint(&self) -> Option<String> {
        let value = self.value();
        if value.is_empty() {
            return self.before.trim_end().ends_with('=').then(|| of_key(self.key, "the value is missing"));
        }
        // In `set = solver.step_s=1`, the parser stops at the second equals sign.
        let is_change =
            self.message.starts_with("unexpected ") && self.after.starts_with('=') && !value.contains(char::is_whitespace);
        let is_of_value = OF_VALUES.into_iter().any(|beginning| self.message.starts_with(beginning));
        if !is_of_value && !is_change {
            return None;
        }
        let is_no_text = ["string", "invalid time", "invalid date"].into_iter().any(|word| self.message.starts_with(word));
        self.comma_hint()
            .or_else(|| number_hint(value))
            .or_else(|| keys::measure(self.key).map(|measure| format!("`{value}` is no number, and {} is {measure}", self.key)))
            .or_else(|| boolean_hint(value))
            .or_else(|| quotes_hint(self.key, value))
            .or_else(|| is_no_text.then(|| format!("`{value}` is neither a number nor text in quotes")))
    }

    /// A hint at the decimal point for `0,005` in a list, where the parser stopped at the zeros of the second number.
    fn comma_hint(&self) -> Option<String> {
        let (before, _) = self.before.rsplit_once(',')?;
        let after = self.line.get(before.len() + 1..).filter(|after| after.starts_with('0'))?;
        let is_part = |c: char| c.is_ascii_digit() || "+-".contains(c);
        let whole = &before[before.trim_end_matches(is_part).len()..];
        let decimals = &after[..after.find(|c: char| !c.is_ascii_digit() && !"eE+-".contains(c)).unwrap_or(after.len())];
        decimal_comma_hint(&format!("{whole},{decimals}"))
    }

    /// A hint at a list without its brackets, such as `1, 2` or `[0, 0], [1, 2]`, where the parser stopped at its comma.
    fn list_hint(&self) -> Option<String> {
        let further = before_comment(self.after.trim_start().strip_prefix(',')?).trim_end().trim_end_matches(',');
        let has_key = further.contains('=') && !further.contains('{');
        if !self.message.starts_with("unexpected ") || further.is_empty() || has_key {
            return None;
        }
        let (key, first) = match self.key_of_text {
            "" => self.before.split_once('=')?,
            key => (key, self.before),
        };
        let entries = format!("{},{further}", first.trim());
        let tuple = entries.strip_prefix('(').and_then(|entries| entries.strip_suffix(')'));
        let entries = tuple.unwrap_or(&entries);
        let words: Vec<&str> = entries.split(',').map(str::trim).collect();
        if keys::is_number(key.trim()) {
            return None;
        }
        let list =
            if words.iter().all(|word| is_word(word)) { format!("\"{}\"", words.join("\", \"")) } else { entries.to_owned() };
        let is_toml = format!("list = [{list}]").parse::<toml_edit::DocumentMut>().is_ok();
        is_toml.then(|| of_key(key.trim(), &format!("a list stands in brackets: [{list}]")))
    }

    /// A hint at a line, or the end of a line, that is no part of TOML: `model: "rigid"`, `// steel`.
    fn line_hint(&self) -> Option<String> {
        let is_of_line = OF_LINES.into_iter().any(|beginning| self.message.starts_with(beginning));
        let is_of_end = self.message.starts_with("unexpected key or value");
        let unexpected = if is_of_line { self.line } else { self.after };
        let unexpected = Shown(before_comment(unexpected).trim(), 60);
        let hint = || format!("unexpected `{unexpected}`: a line is one KEY = VALUE or one [TABLE]; a comment begins with #");
        (is_of_line || is_of_end).then(hint)
    }

    /// A hint at a list, a table or a text that the line before does not end.
    fn bracket_hint(&self) -> Option<String> {
        let missing = match self.message.split(',').next()? {
            _ if !self.before.trim().is_empty() => return None,
            "missing comma between array elements" => "`,` or `]`",
            "missing comma between key-value pairs" | "missing key for inline table element" => "`,` or `}`",
            _ => return None,
        };
        let line_before = before_comment(self.line_before);
        let missing = if is_in_quotes(line_before, line_before.len()) { "`\"`" } else { missing };
        Some(format!("a {missing} is missing before this line"))
    }
}

/// A problem of a key, or of a file.
fn of_key(key: &str, problem: &str) -> String {
    if key.is_empty() { problem.to_owned() } else { format!("{key}: {problem}") }
}

/// A hint at the first number with commas in a line of `KEY = VALUE`, or in a value.
fn comma_in(line: &str) -> Option<String> {
    let hint = |value: &str| {
        let value = value.trim_start();
        let end = value.find(|c: char| !c.is_ascii_digit() && !"+-.,eE".contains(c)).unwrap_or(value.len());
        let number = value[..end].trim_end_matches(',');
        thousands_commas_hint(number).or_else(|| decimal_comma_hint(number))
    };
    line.split('=').find_map(hint)
}

/// The name of the key whose value stands at the end of `before`, a part of a line.
fn key_before(before: &str) -> Option<&str> {
    let (end, _) = before.rmatch_indices('=').find(|(place, _)| !is_in_quotes(before, *place))?;
    let key = before.get(..end)?.trim_end().trim_end_matches('"');
    key.rsplit(|c: char| !c.is_ascii_alphanumeric() && c != '_').next()
}

/// A part of a line without its comment.
fn before_comment(line: &str) -> &str {
    let comment = line.match_indices('#').find(|(place, _)| !is_in_quotes(line, *place));
    comment.and_then(|(place, _)| line.get(..place)).unwrap_or(line)
}

/// Whether `place` in a line is after a quote that is not closed before it.
fn is_in_quotes(line: &str, place: usize) -> bool {
    line.get(..place).is_some_and(|before| before.matches('"').count() % 2 == 1)
}

/// The number of a text, which TOML may refuse: `.5`, `5.`, `−1`.
pub(super) fn number(text: &str) -> Option<f64> {
    text.replace(['−', '–'], "-").parse().ok().filter(|number: &f64| number.is_finite())
}

/// A hint at the number to write for one that only TOML refuses.
fn number_hint(value: &str) -> Option<String> {
    let number = number(value)?;
    if value.parse::<toml_edit::Value>().is_ok() {
        // One of another kind, as from a web page.
        return Some(format!("the space beside {value} is no ordinary one"));
    }
    let is_short = number == 0.0 || (1e-5..1e15).contains(&number.abs());
    let number = if is_short { number.to_string() } else { format!("{number:e}") };
    Some(format!("{value} is written as {number}"))
}

/// A hint at the boolean to write for `True` or `yes`.
fn boolean_hint(value: &str) -> Option<String> {
    let boolean = match value.to_ascii_lowercase().as_str() {
        "true" | "yes" | "on" => "true",
        "false" | "no" | "off" => "false",
        _ => return None,
    };
    Some(format!("{value} is written as {boolean}"))
}

/// A hint at the quotes of a text that has none, or curly ones.
fn quotes_hint(key: &str, value: &str) -> Option<String> {
    let text = value.trim_matches(['“', '”', '„', '‘', '’', '«', '»', '`']);
    if text.len() < value.len() {
        return Some(of_key(key, &format!("text must be in straight quotes: \"{text}\"")));
    }
    is_word(value).then(|| of_key(key, &format!("text must be quoted: \"{value}\"")))
}

/// Whether a value is text without quotes.
fn is_word(value: &str) -> bool {
    let begins_as_number = value.starts_with(|c: char| c.is_ascii_digit()) && !value.ends_with(".toml");
    !begins_as_number && value.contains(char::is_alphabetic) && !value.contains(['"', '\'', '[', ']', '{', '}'])
}

/// A hint at a value in per cent: the number to write, or why the key is no share.
fn share_hint(key: &str, value: &str) -> Option<String> {
    let number = percent_hint(value)?;
    let Some(measure) = keys::measure(key) else { return Some(number) };
    let is_damping = key.ends_with(keys::DAMPING.name);
    let formula = if is_damping { ": `flexcrank guide scenes` has its value for a damping ratio" } else { "" };
    Some(format!("`{value}` is a share, and {key} is {measure}{formula}"))
}

/// A hint at the unit of a value that is a number with one: `0.42 m`, `210GPa`.
fn unit_hint(value: &str) -> Option<String> {
    let number = value.trim_start_matches(['+', '-']);
    let unit = number.trim_start_matches(|c: char| c.is_ascii_digit() || "+-._eE".contains(c)).trim_start();
    let has_unit =
        number.starts_with(|c: char| c.is_ascii_digit()) && unit.starts_with(|c: char| c.is_alphabetic() || "%°".contains(c));
    let is_more = value.ends_with(".toml") || value.contains('=');
    (has_unit && !is_more).then(|| format!("`{value}`: write the number alone, as its key names the unit"))
}

/// Keys of lists that a range could stand for: of a campaign, and of an oscillator.
const OF_RANGES: [&str; 4] = ["values", "masses_kg", "forces_n", "start_m"];

/// A hint at the list to write for a range, `1:3:1`, which TOML takes for a time of the day.
fn range_hint(key: &str, value: &str) -> Option<String> {
    let is_range = value.contains(':') && value.split(':').all(|part| number(part.trim()).is_some());
    let is_of_list = OF_RANGES.contains(&key.rsplit('.').next().unwrap_or_default());
    (is_range && is_of_list).then(|| format!("`{value}` is no number; a list has each of its values, in brackets"))
}

#[cfg(test)]
mod tests {
    use crate::scene::{SceneSource, builtin};

    /// The problem with the default scene, with other text in place of its line `model = "modal"`.
    fn problem(line: &str) -> String {
        let text = builtin::find(builtin::DEFAULT).map(|scene| scene.text).unwrap_or_default();
        let text = text.replacen("model = \"modal\"", line, 1);
        let refused = SceneSource::parse("scene.toml", &text, &[]).err().map(|refused| refused.to_string()).unwrap_or_default();
        refused.split(": not TOML: ").last().unwrap_or_default().to_owned()
    }

    fn assert_problems(cases: &[(&str, &str)]) {
        for (line, said) in cases {
            assert_eq!(problem(line), *said, "{line}");
        }
    }

    #[test]
    fn regress_text_without_quotes_is_refused_with_the_text_to_write() {
        let words =
            "modal tube Tube two-point finite-element full ibeam newton nan-x inf-x t n _x -abc ./a.toml ~/a.toml 4bar.toml";
        for word in words.split(' ') {
            let quoted = format!("text must be quoted: \"{word}\"");
            assert_eq!(problem(&format!("model = {word}  # a comment")), format!("model: {quoted}"));
            assert_eq!(problem(&format!("section = {{ outer_m = 1, shape = {word} }}")), format!("shape: {quoted}"));
            assert_eq!(problem(&format!("changes = [\"a=1\", {word}]")), format!("changes: {quoted}"));
        }
        assert_problems(&[
            ("model = two point", "model: text must be quoted: \"two point\""),
            ("model = “modal”", "model: text must be in straight quotes: \"modal\""),
            ("changes = solver.step_s=1", "changes: text must be quoted: \"solver.step_s=1\""),
            ("changes = [\"a=1\", solver.step_s=1]", "changes: text must be quoted: \"solver.step_s=1\""),
            ("step_s = pi/2", "`pi/2` is no number, and step_s is in s"),
        ]);
    }

    #[test]
    fn regress_a_list_without_brackets_is_refused_with_the_list_to_write() {
        assert_problems(&[
            ("masses_kg = 1, 2", "masses_kg: a list stands in brackets: [1, 2]"),
            ("resistance_table = [0,0],[5.5,300]  # N", "resistance_table: a list stands in brackets: [[0,0],[5.5,300]]"),
            ("pulse = { a = 1 }, { a = 2 }", "pulse: a list stands in brackets: [{ a = 1 }, { a = 2 }]"),
            ("changes = \"a#1\", \"b\",", "changes: a list stands in brackets: [\"a#1\", \"b\"]"),
            ("changes = a, true, b", "changes: a list stands in brackets: [\"a\", \"true\", \"b\"]"),
            ("masses_kg = (1, 2)", "masses_kg: a list stands in brackets: [1, 2]"),
            ("masses_kg = 1,2.5", "masses_kg: a list stands in brackets: [1,2.5]"),
            ("masses_kg = 1,5", "a number has a decimal point, not a comma: 1.5"),
            ("masses_kg = 12,000,000", "a number has no commas: 12_000_000 or 1.2e7"),
            ("masses_kg = 10 000,5", "unexpected `,5`: a line is one KEY = VALUE or one [TABLE]; a comment begins with #"),
            ("step_s = 0, 25", "unexpected `, 25`: a line is one KEY = VALUE or one [TABLE]; a comment begins with #"),
            ("masses_kg = 1, 2 # x = 1,5", "masses_kg: a list stands in brackets: [1, 2]"),
            ("masses_kg = 1:3:1", "`1:3:1` is no number; a list has each of its values, in brackets"),
            ("step_s = 1:30", "`1:30` is no number, and step_s is in s"),
            ("rigid = 1:30", "`1:30` is neither a number nor text in quotes"),
            ("masses_kg = 0.1:0.5:0.1", "`0.1:0.5:0.1` is no number; a list has each of its values, in brackets"),
            ("masses_kg = 1 kg, 2 kg", "`1 kg`: write the number alone, as its key names the unit"),
        ]);
        let text = builtin::find(builtin::DEFAULT).map(|scene| scene.text).unwrap_or_default();
        let given = "slider.resistance_table=[0,0],[5.5,300]".to_owned();
        let refused = SceneSource::parse("scene.toml", text, &[given]).err().map(|refused| refused.problem).unwrap_or_default();
        assert_eq!(refused, "not TOML: slider.resistance_table: a list stands in brackets: [[0,0],[5.5,300]]");
    }

    #[test]
    fn regress_numbers_and_booleans_of_other_languages_are_refused_with_the_value_to_write() {
        assert_problems(&[
            ("step_s = .5", ".5 is written as 0.5"),
            ("step_s = 5.", "5. is written as 5"),
            ("values = [0,005, 0.01]", "a number has a decimal point, not a comma: 0.005"),
            ("values = [[0, 0], [1,05]]", "a number has a decimal point, not a comma: 1.05"),
            ("values = [1, 05]", "05 is written as 5"),
            ("step_s = −1", "−1 is written as -1"),
            ("step_s = .21e300", ".21e300 is written as 2.1e299"),
            ("step_s = \u{a0}2", "the space beside 2 is no ordinary one"),
            ("step_s = 10^-3", "`10^-3` is no number, and step_s is in s"),
            ("rho_infinity = 1/2", "`1/2` is neither a number nor text in quotes"),
            ("axial = True", "True is written as true"),
            ("axial = no", "no is written as false"),
            ("model = # which?", "model: the value is missing"),
            ("model = { shape = }", "shape: the value is missing"),
            ("model == \"modal\"", "extra `=`"),
            ("model = \"modal\"\nmodel = \"rigid\"", "model is there twice"),
        ]);
    }

    #[test]
    fn regress_lines_of_other_formats_are_refused_with_the_form_of_a_line() {
        let line = "a line is one KEY = VALUE or one [TABLE]; a comment begins with #";
        for (text, unexpected) in [
            ("model: modal", "model: modal"),
            ("// model = 1", "// model = 1"),
            ("{", "{"),
            ("time,torque", "time,torque"),
            ("model = \"modal\",", ","),
            ("model = \"modal\" // x = \"#\"  # comment", "// x = \"#\""),
            ("model = \"modal\" step_s = 1", "step_s = 1"),
            ("[model]]", "]"),
        ] {
            assert_eq!(problem(text), format!("unexpected `{unexpected}`: {line}"));
        }
    }

    #[test]
    fn regress_what_is_not_closed_is_missed_before_the_next_line() {
        assert_problems(&[
            ("changes = [1, 2", "a `,` or `]` is missing before this line"),
            ("changes = [1, 2 # 6\" rod", "a `,` or `]` is missing before this line"),
            ("section = { shape = \"tube\"", "a `,` or `}` is missing before this line"),
            ("section = { shape = \"tube }", "a `\"` is missing before this line"),
            ("section = { shape = \"tube\"\n[slider]", "a `,` or `}` is missing before this line"),
        ]);
    }
}
