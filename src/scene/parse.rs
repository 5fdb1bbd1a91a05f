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
fn describe(message: &str) -> String {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match (message.starts_with("unknown"), quoted.split_first()) {
        (true, Some((given, expected))) => {
            let hint = did_you_mean(given, expected.iter().copied());
            format!("unknown {}{hint} (known here: {})", kind(message), expected.join(", "))
        }
        _ => message.trim().replace('\n', " "),
    }
}

fn kind(message: &str) -> &'static str {
    if message.starts_with("unknown variant") { "value" } else { "key" }
}
