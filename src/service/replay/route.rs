//! Routes from recorded topics to keys: which topics are replayed, and under which names.

use std::collections::{BTreeSet, HashMap};
use std::str::FromStr;

use super::ReplayOptions;
use crate::bus::{self, BusError, Name, RawPublisher, Session, Topic, check_encoding};
use crate::recording::{Channel, RecordingFile};
use crate::service::ServiceError;
use crate::shown::shown_name;

/// Name of a replay whose recording names no service.
const NAMELESS: &str = "replay";
/// Topics that are never replayed: the replay publishes its own, or they are not on the bus.
const NEVER_REPLAYED: [&str; 6] = ["status", "checkpoint", "torque", "setpoint", "control", "replay"];

/// `OLD:=NEW`: renames a topic, or all topics that begin with `OLD/`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remap {
    old: String,
    new: String,
}

/// The text is not of the form `OLD:=NEW`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not of the form OLD:=NEW, as in flexcrank/crank:=flexcrank/ghost")]
pub struct BadRemap(String);

impl FromStr for Remap {
    type Err = BadRemap;

    fn from_str(text: &str) -> Result<Self, BadRemap> {
        let bad = || BadRemap(text.to_owned());
        let (old, new) = text.split_once(":=").ok_or_else(bad)?;
        let (old, new) = (old.trim_start_matches('/'), new.trim_start_matches('/'));
        if old.is_empty() || new.is_empty() {
            return Err(bad());
        }
        Ok(Remap { old: old.to_owned(), new: new.to_owned() })
    }
}

impl Remap {
    fn apply(&self, topic: &str) -> Option<String> {
        let rest = topic.trim_start_matches('/').strip_prefix(&self.old)?;
        (rest.is_empty() || rest.starts_with('/')).then(|| format!("{}{rest}", self.new))
    }
}

/// All routes, before the publishers are declared.
pub(super) struct RoutePlan {
    /// Name of the replay.
    pub name: Name,
    /// Names of all services whose topics are replayed.
    pub names: BTreeSet<Name>,
    /// Topics left out because their names are not valid keys, with the reason.
    pub left_out: Vec<String>,
    /// Recorded topics that are played, with their keys.
    pub channels: Vec<(Channel, String)>,
    commands: Commands,
}

/// Plans which topics are replayed under which keys.
pub(super) fn plan(replay: &ReplayOptions, source: &RecordingFile) -> Result<RoutePlan, ServiceError> {
    let recorded = source.channels().find_map(|channel| Name::split(&channel.topic)).map(|(name, _)| name);
    let own = recorded.clone().zip(replay.name.clone());
    let own = own.map(|(old, new)| Remap { old: old.presence(), new: new.presence() });
    let rename = |topic: &str| {
        let renamed = replay.remaps.iter().chain(&own).find_map(|remap| remap.apply(topic));
        renamed.unwrap_or_else(|| topic.to_owned())
    };
    let (mut channels, mut left_out, mut kept_back) = (Vec::new(), Vec::new(), BTreeSet::new());
    let is_asked = |topic: &str| selected(topic, &replay.topics) || replay.commands && is_of_commands(topic);
    for channel in source.channels().filter(|channel| is_asked(&channel.topic)) {
        let carried = check_encoding(&channel.message_encoding, schema_name(channel));
        match bus::key_of_topic(&rename(&channel.topic)).and_then(|key| carried.map(|()| key)) {
            // The recorded topic counts under any other key, too.
            Ok(key) => match why_kept_back(channel.topic.trim_start_matches('/'), replay.commands)
                .or_else(|| why_kept_back(&key, replay.commands))
            {
                None => channels.push((channel.clone(), key)),
                Some(reason) => _ = kept_back.insert(reason),
            },
            Err(reason) => left_out.push(format!("{}: {reason}", shown_name(&channel.topic))),
        }
    }
    if let Some(wanted) = missing(replay, source, recorded.as_ref()) {
        let there = source.channels().map(|channel| channel.topic.clone()).collect::<BTreeSet<_>>();
        return Err(ServiceError::NoTopic { wanted, there: there.into_iter().collect() });
    }
    if channels.is_empty() {
        left_out.extend(kept_back);
        return Err(ServiceError::NothingToReplay { path: source.path().to_owned(), left_out });
    }
    let mut names: BTreeSet<Name> = channels.iter().filter_map(|(_, key)| Name::split(key)).map(|(name, _)| name).collect();
    let name = match (&replay.name, channels.iter().find_map(|(_, key)| Name::split(key))) {
        (Some(name), _) => name.clone(),
        (None, Some((name, _))) => name,
        (None, None) => NAMELESS.parse()?,
    };
    names.insert(name.clone());
    let service = recorded.unwrap_or_else(|| name.clone());
    let commands = Commands {
        torque: rename(&service.torque()),
        setpoint: rename(&service.setpoint()),
        control: rename(&service.control()),
    };
    Ok(RoutePlan { name, names, left_out, channels, commands })
}

fn schema_name(channel: &Channel) -> Option<&str> {
    channel.schema.as_ref().map(|schema| schema.name.as_str())
}

/// The first topic to be played or renamed that the recording does not have.
fn missing(replay: &ReplayOptions, source: &RecordingFile, recorded: Option<&Name>) -> Option<String> {
    let topics = || source.channels().map(|channel| channel.topic.clone());
    // Recorded commands have a topic of their own; they are published on these keys.
    let command_keys = |name: &Name| [name.torque(), name.setpoint(), name.control()];
    let renamed: Vec<String> = topics().chain(recorded.into_iter().flat_map(command_keys)).collect();
    let asked = replay.topics.iter().find(|wanted| !topics().any(|topic| selected(&topic, std::slice::from_ref(wanted))));
    let unknown = replay.remaps.iter().find(|remap| !renamed.iter().any(|topic| remap.apply(topic).is_some()));
    asked.or(unknown.map(|remap| &remap.old)).cloned()
}

/// Whether a topic matches one of `wanted`, by full name or last chunks.
fn selected(topic: &str, wanted: &[String]) -> bool {
    let topic = topic.trim_start_matches('/');
    let is_end = |end: &str| topic.strip_suffix(end).is_some_and(|rest| rest.is_empty() || rest.ends_with('/'));
    wanted.is_empty() || wanted.iter().any(|wanted| is_end(wanted.trim_start_matches('/')))
}

/// Whether a topic holds the recorded commands of a service.
fn is_of_commands(topic: &str) -> bool {
    Name::split(topic.trim_start_matches('/')).is_some_and(|(_, chunk)| chunk == Topic::Commands.chunk())
}

/// Why a key is not played, though it was asked for; `None` if it is.
fn why_kept_back(key: &str, commands: bool) -> Option<String> {
    let (_, chunk) = Name::split(key)?;
    if NEVER_REPLAYED.contains(&chunk) {
        return Some(format!("{chunk} is never replayed"));
    }
    let is_unasked = !commands && chunk == Topic::Commands.chunk();
    is_unasked.then(|| "recorded commands are sent only with --commands".to_owned())
}

/// Keys that recorded commands are published on.
pub(super) struct Commands {
    pub torque: String,
    pub setpoint: String,
    pub control: String,
}

/// The publisher of a channel.
pub(super) struct Route {
    pub publisher: RawPublisher,
    /// The topic of the replay's own service, if it is one.
    pub topic: Option<Topic>,
}

/// Publishers of all replayed channels.
pub(super) struct Routes {
    routes: HashMap<u16, Route>,
    /// The keys.
    pub keys: Vec<String>,
    pub commands: Commands,
}

impl Routes {
    pub fn declare(session: &Session, plan: RoutePlan) -> Result<Self, ServiceError> {
        let mut routes = HashMap::new();
        let mut keys = Vec::new();
        for (channel, key) in plan.channels {
            let publisher = RawPublisher::declare(session, &key, &channel.message_encoding, schema_name(&channel))?;
            let chunk = Name::split(&key).filter(|(name, _)| *name == plan.name).map(|(_, chunk)| chunk);
            let topic = chunk.and_then(Topic::of_chunk);
            routes.insert(channel.id, Route { publisher, topic });
            keys.push(key);
        }
        Ok(Routes { routes, keys, commands: plan.commands })
    }

    /// The channels to which someone subscribes.
    pub fn subscribed(&self) -> Result<BTreeSet<u16>, BusError> {
        let mut subscribed = BTreeSet::new();
        for (channel, route) in &self.routes {
            if route.publisher.has_subscribers()? {
                subscribed.insert(*channel);
            }
        }
        Ok(subscribed)
    }

    /// The route of a channel, if it is replayed.
    pub fn of(&self, channel: u16) -> Option<&Route> {
        self.routes.get(&channel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_remap_renames_a_topic_or_all_below_it() -> Result<(), BadRemap> {
        let remap: Remap = "/old/a:=new".parse()?;
        for (topic, key) in [("/old/a", Some("new")), ("old/a/b", Some("new/b")), ("old/ab", None), ("old", None)] {
            assert_eq!(remap.apply(topic).as_deref(), key, "{topic}");
        }
        for text in ["a", "a:b", ":=b", "a:=", "/:=b"] {
            assert!(text.parse::<Remap>().is_err(), "{text}");
        }
        Ok(())
    }

    #[test]
    fn prop_topics_are_selected_whole_or_by_their_end() {
        let wanted = |text: &str| [text.to_owned()];
        for (topic, text, expected) in [
            ("flexcrank/crank/loads", "loads", true),
            ("flexcrank/crank/loads", "crank/loads", true),
            ("flexcrank/crank/loads", "oads", false),
            ("/camera/image", "/camera/image", true),
            ("/camera/image", "camera", false),
        ] {
            assert_eq!(selected(topic, &wanted(text)), expected, "{topic} {text}");
        }
        assert!(selected("anything", &[]));
    }

    #[test]
    fn prop_topics_of_the_replay_itself_are_never_replayed() {
        for chunk in NEVER_REPLAYED {
            let said = why_kept_back(&format!("flexcrank/crank/{chunk}"), true);
            assert_eq!(said, Some(format!("{chunk} is never replayed")));
        }
        assert_eq!(why_kept_back("flexcrank/crank/commands", true), None);
        assert!(why_kept_back("flexcrank/crank/commands", false).is_some_and(|said| said.contains("--commands")));
        assert_eq!(why_kept_back("robot/status", false), None);
    }
}
