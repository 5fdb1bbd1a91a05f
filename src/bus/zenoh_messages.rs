//! Plain text from zenoh's error messages.

/// Returns zenoh's error message without source locations such as ` at …/tcp.rs:61.`, which say nothing to a user.
pub(super) fn message_of(error: &zenoh::Error) -> String {
    let mut said = String::new();
    let text = error.to_string();
    for part in text.split(" at ") {
        let (place, rest) = part.split_at(part.find([' ', ']', ',', ';']).unwrap_or(part.len()));
        if !said.is_empty() && place.contains(".rs:") {
            said.push_str(rest);
        } else {
            said.push_str(if said.is_empty() { "" } else { " at " });
            said.push_str(part);
        }
    }
    said
}

/// Extracts message and line from a configuration error: `… { msg: "WORDS", location: Some(Location { line: 1, column: 3 }) }`.
pub(super) fn config_error_text(text: &str) -> String {
    let parts = text.split_once("msg: ").and_then(|(_, rest)| rest.rsplit_once(", location: Some(Location { line: "));
    match parts.and_then(|(words, place)| Some((words, place.split_once(',')?.0))) {
        Some((words, line)) => format!("line {line}: {}", words.trim_matches('"')),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_source_locations_are_removed_and_nothing_else() {
        for (text, wanted) in [
            ("no key `a//b` at /x/zenoh-1.0/src/key.rs:777.", "no key `a//b`"),
            ("tcp: [refused (error 99) at /x/tcp.rs:61.] at /x/unicast.rs:338.", "tcp: [refused (error 99)]"),
            ("a lock held at noon at /x/a.rs:1., and at night", "a lock held at noon, and at night"),
            ("nothing", "nothing"),
        ] {
            assert_eq!(message_of(&text.into()), wanted);
        }
    }
}
