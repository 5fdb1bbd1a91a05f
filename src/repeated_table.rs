//! A table `[name]` beside another of its name, where a file has a list of tables `[[name]]`: it is refused by its line.

use std::ops::Range;

/// The place in `text` of a table `[name]` beside another of its name, and the problem with it, if that is the parser's error.
/// `is_list` tells whether the file has a list of a name.
pub(crate) fn repeated_table(
    text: &str,
    (message, span): (&str, Option<Range<usize>>),
    is_list: impl Fn(&str) -> bool,
) -> Option<(usize, String)> {
    let found = span.filter(|_| message.trim() == "duplicate key")?.start;
    let start = text.get(..found)?.rfind('\n').map_or(0, |line_break| line_break + 1);
    let (name, is_entry) = header(text.get(start..)?.lines().next()?)?;
    // Before `[[name]]`, the other one is wrong.
    let place = if is_entry { place_of_table(text.get(..start)?, name)? } else { start };
    is_list(name).then(|| (place, format!("[{name}] is there twice: each entry of a list is a table [[{name}]]")))
}

/// The name in a line that begins a table, and whether that is an entry of a list.
fn header(line: &str) -> Option<(&str, bool)> {
    let inner = line.trim_start().strip_prefix('[')?;
    let entry = inner.strip_prefix('[');
    let name = entry.unwrap_or(inner).split(']').next()?.trim();
    Some((name, entry.is_some()))
}

/// The first byte of the line `[name]`.
fn place_of_table(text: &str, name: &str) -> Option<usize> {
    let mut end = 0;
    text.split_inclusive('\n').find_map(|line| {
        let start = end;
        end += line.len();
        (header(line) == Some((name, false))).then_some(start)
    })
}

#[cfg(test)]
mod tests {
    use super::repeated_table;

    #[test]
    fn regress_a_table_before_the_entries_of_its_list_is_the_wrong_one() {
        let problem = "[pulse] is there twice: each entry of a list is a table [[pulse]]";
        for (text, line) in [
            ("a = 1\n[pulse]\nb = 2\n[[pulse]]\nb = 3\n", Some(2)),
            ("a = 1\n[[pulse]]\nb = 2\n[pulse]\nb = 3\n", Some(4)),
            ("[pulse] # first\nb = 2\n  [ pulse ]\nb = 3\n", Some(3)),
            ("[[pulse]]\nb = 2\n[[pulse]]\nb = 3\n", None),
            ("[gravity]\nb = 2\n[[gravity]]\nb = 3\n", None),
            ("a = 1\na = 2\n", None),
        ] {
            let error = toml::from_str::<toml::Table>(text).err();
            let found = error.and_then(|error| repeated_table(text, (error.message(), error.span()), |name| name == "pulse"));
            let found = found.map(|(place, said)| (1 + text[..place].matches('\n').count(), said));
            assert_eq!(found, line.map(|line| (line, problem.to_owned())), "{text}");
        }
    }
}
