//! All key expressions, formatted and parsed in one place.

use crate::shown::shown_name;
pub use crate::wire::ROOT;
use crate::wire::Topic;

/// A service's name: one chunk of a key.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Name(String);

/// The text is not a service name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{}` is not a name: one word without / * $ ? # and white space, not beginning with @", shown_name(.0))]
pub struct BadName(String);

impl std::str::FromStr for Name {
    type Err = BadName;

    fn from_str(text: &str) -> Result<Self, BadName> {
        let forbidden = |c: char| matches!(c, '/' | '*' | '$' | '?' | '#' | '\\') || c.is_whitespace() || c.is_control();
        if text.is_empty() || text.starts_with(['@', '.']) || text.len() > 128 || text.contains(forbidden) {
            return Err(BadName(text.to_owned()));
        }
        Ok(Name(text.to_owned()))
    }
}

impl std::fmt::Display for Name {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl Name {
    /// Key of the liveliness token, and prefix of all other keys.
    pub fn presence(&self) -> String {
        format!("{ROOT}/{self}")
    }
    /// Key of a published topic.
    pub fn topic(&self, topic: Topic) -> String {
        self.key(topic.chunk())
    }
    /// Key of torque commands.
    pub fn torque(&self) -> String {
        self.key("torque")
    }
    /// Key of setpoints.
    pub fn setpoint(&self) -> String {
        self.key("setpoint")
    }
    /// Key of lock-step.
    pub fn advance(&self) -> String {
        self.key("advance")
    }
    /// Key of control commands.
    pub fn control(&self) -> String {
        self.key("control")
    }
    /// Key of commands to a replay.
    pub fn replay(&self) -> String {
        self.key("replay")
    }
    /// Key of the scene.
    pub fn scene(&self) -> String {
        self.key("scene")
    }
    /// Key of the facts about the service.
    pub fn about(&self) -> String {
        self.key("about")
    }
    /// Key of questions for the modes.
    pub fn modes(&self) -> String {
        self.key("modes")
    }
    /// Key of the descriptor set.
    pub fn schema(&self) -> String {
        self.key("schema")
    }
    /// Key of the snapshot.
    pub fn snapshot(&self) -> String {
        self.key("snapshot")
    }
    /// The key that ends in `chunk`.
    pub fn key(&self, chunk: &str) -> String {
        format!("{ROOT}/{self}/{chunk}")
    }

    /// The name in a presence key.
    pub fn of_presence(key: &str) -> Option<Name> {
        key.strip_prefix(ROOT)?.strip_prefix('/')?.parse().ok()
    }

    /// Splits a service's key into its name and the rest.
    pub fn split(key: &str) -> Option<(Name, &str)> {
        let (name, rest) = key.strip_prefix(ROOT)?.strip_prefix('/')?.split_once('/')?;
        Some((name.parse().ok()?, rest))
    }
}

/// Length limit of a replayed key, bytes. zenoh carries 65,535, but overflows its stack at some 7,000 chunks.
const KEY_LIMIT: usize = 4096;

/// Returns the key of a topic of any recording: the topic without its leading slash.
///
/// # Errors
/// Returns why the topic is not a valid key.
pub fn key_of_topic(topic: &str) -> Result<String, String> {
    let key = topic.strip_prefix('/').unwrap_or(topic);
    if key.len() > KEY_LIMIT {
        return Err(format!("a key has at most {KEY_LIMIT} bytes, and this has {}", key.len()));
    }
    if key.starts_with('@') {
        return Err("keys that begin with @ are zenoh's own".to_owned());
    }
    match zenoh::key_expr::keyexpr::new(key) {
        Ok(valid) if valid.is_wild() => Err("a key without wildcards is needed".to_owned()),
        Ok(_) if key.contains('?') => Err("? is not allowed in a key".to_owned()),
        Ok(_) => Ok(key.to_owned()),
        Err(error) => Err(super::zenoh_messages::message_of(&error)),
    }
}

/// Matches the presence of every service.
pub fn every_presence() -> String {
    format!("{ROOT}/*")
}

/// Matches the key of every service that ends in `chunk`.
pub fn every(chunk: &str) -> String {
    format!("{ROOT}/*/{chunk}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_keys_are_parsed_as_formatted() -> Result<(), BadName> {
        let name: Name = "crank-7".parse()?;
        assert_eq!(Name::split(&name.topic(Topic::Loads)), Some((name.clone(), "loads")));
        assert_eq!(Name::of_presence(&name.presence()), Some(name));
        Ok(())
    }

    #[test]
    fn prop_topics_of_others_become_keys_or_are_refused() {
        for (topic, key) in [("/camera/image", "camera/image"), ("flexcrank/crank/loads", "flexcrank/crank/loads"), ("/tf", "tf")]
        {
            assert_eq!(key_of_topic(topic).as_deref(), Ok(key));
        }
        for topic in ["", "/", "a//b", "a/", "//a", "a/*", "a/**", "a/$*", "a/b#c", "a/b?c", "@/x"] {
            assert!(key_of_topic(topic).is_err(), "{topic:?}");
        }
    }

    #[test]
    fn prop_a_name_is_one_chunk() {
        for text in ["", "a/b", "a*", "$x", "a b", "@adv", "a?", "a#", "..", "x\n"] {
            assert!(text.parse::<Name>().is_err(), "{text:?}");
        }
    }
}
