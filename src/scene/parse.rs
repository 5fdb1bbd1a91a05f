//! Parses text to raw structs: names and types, with the nearest valid key for an unknown name.

use super::{SceneError, document::SceneText, raw};
use crate::nearest::did_you_mean;

pub(super) fn parse(text: &SceneText) -> Result<raw::Scene, SceneError> {
    toml::from_str(&text.merged).map_err(|error| {
        let key = error.span().map(|span| text.path_at(span.start)).unwrap_or_default();
        let problem = describe(error.message());
        SceneError { place: text.place(&key), value: text.value(&key), key, problem }
    })
}

/// serde's message, with the nearest of the names it expected where one was unknown.
pub(crate) fn describe(message: &str) -> String {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match (message.starts_with("unknown"), quoted.split_first()) {
        (true, Some((given, expected))) => {
            let hint = did_you_mean(given, expected.iter().copied());
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
    let Some((_, expected)) = message.strip_prefix("invalid type: ").and_then(|rest| rest.rsplit_once(", expected ")) else {
        return message.to_owned();
    };
    let needed = match expected {
        "f64" => "a number without its unit, which the key names",
        "i64" => "a whole number",
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
