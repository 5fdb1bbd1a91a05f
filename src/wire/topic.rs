//! The catalogue of a service's messages: the topic, the last chunk of its key, and the protobuf type.

use std::sync::LazyLock;

use prost::{DecodeError, Message as _, Name as _};

use super::foxglove::SceneUpdate;
use super::messages::{Angles, AppliedCommand, Checkpoint, Displacements, Energies, Gap, Loads, Overruns, Shadow, Stamp, Status};
use crate::simulation::PerTelemetry;

/// First chunk of every key.
pub const ROOT: &str = "flexcrank";

/// Declares topics with a stamped message each, and then topics with messages for viewers, which have no stamp.
macro_rules! catalogue {
    ($($(#[$doc:meta])* $topic:ident $chunk:literal $message:ty,)* ; $($(#[$viewer_doc:meta])* $viewer:ident $viewer_chunk:literal $viewer_message:ty,)*) => {
        /// A topic of a service.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Topic {
            $($(#[$doc])* $topic,)*
            $($(#[$viewer_doc])* $viewer,)*
        }

        impl Topic {
            /// All topics.
            pub const ALL: &[Topic] = &[$(Topic::$topic,)* $(Topic::$viewer),*];

            /// Last chunk of the topic's key.
            pub fn chunk(self) -> &'static str {
                match self {
                    $(Topic::$topic => $chunk,)*
                    $(Topic::$viewer => $viewer_chunk,)*
                }
            }

            /// Fully qualified name of the topic's protobuf type.
            pub fn schema(self) -> &'static str {
                static NAMES: LazyLock<Vec<String>> =
                    LazyLock::new(|| vec![$(<$message>::full_name(),)* $(<$viewer_message>::full_name()),*]);
                &NAMES[self as usize]
            }
        }

        /// A decoded message of a topic.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Message {
            $($(#[$doc])* $topic(Box<$message>),)*
        }

        impl Message {
            /// Decodes a message by the name of its schema; `None` if no topic has stamped messages of this schema.
            ///
            /// # Errors
            /// [`DecodeError`] if the payload does not fit the schema.
            pub fn decode(schema: &str, payload: &[u8]) -> Result<Option<Message>, DecodeError> {
                $(if schema == Topic::$topic.schema() {
                    return Ok(Some(Message::$topic(Box::new(<$message>::decode(payload)?))));
                })*
                Ok(None)
            }

            /// The message's topic.
            pub fn topic(&self) -> Topic {
                match self { $(Message::$topic(_) => Topic::$topic,)* }
            }

            /// The message's stamp.
            pub fn stamp(&self) -> Option<Stamp> {
                match self { $(Message::$topic(message) => message.stamp,)* }
            }

            /// The message with another stamp.
            pub fn with_stamp(mut self, stamp: Stamp) -> Self {
                match &mut self { $(Message::$topic(message) => message.stamp = Some(stamp),)* }
                self
            }

            /// Encodes the message.
            pub fn encode_to_vec(&self) -> Vec<u8> {
                match self { $(Message::$topic(message) => message.encode_to_vec(),)* }
            }
        }
    };
}

catalogue! {
    /// State of every node.
    Displacements "displacements" Displacements,
    /// Angles of the links.
    Angles "angles" Angles,
    /// Loads, joint forces, internal forces.
    Loads "loads" Loads,
    /// Energies, works and their balance.
    Energies "energies" Energies,
    /// State of the service.
    Status "status" Status,
    /// Commands that took effect.
    Commands "commands" AppliedCommand,
    /// Difference between shadow and main model.
    Shadow "shadow" Shadow,
    /// Messages dropped by full queues.
    Gaps "gaps" Gap,
    /// Missed deadlines.
    Overruns "overruns" Overruns,
    /// Full states, recorded but not published.
    Checkpoint "checkpoint" Checkpoint,
    ;
    /// The mechanism as shapes, for 3D viewers.
    SceneUpdates "scene_updates" SceneUpdate,
}

impl Topic {
    /// The topic whose key ends in `chunk`.
    pub fn of_chunk(chunk: &str) -> Option<Topic> {
        Topic::ALL.iter().copied().find(|topic| topic.chunk() == chunk)
    }

    /// The topic of a service's key: `flexcrank/crank/angles`. `None` of keys of other programs.
    pub fn of_key(key: &str) -> Option<Topic> {
        let (_, chunk) = key.strip_prefix(ROOT)?.strip_prefix('/')?.split_once('/')?;
        Topic::of_chunk(chunk)
    }

    /// Whether the topic's messages are encoded from samples.
    pub fn is_telemetry(self) -> bool {
        matches!(self, Topic::Displacements | Topic::Angles | Topic::Loads | Topic::Energies)
    }

    /// Whether the topic is published; a checkpoint is only recorded.
    pub fn is_published(self) -> bool {
        self != Topic::Checkpoint
    }
}

impl<T> PerTelemetry<T> {
    /// The values with their topics.
    pub fn by_topic(self) -> [(Topic, T); 4] {
        let PerTelemetry { displacements, angles, loads, energies } = self;
        [(Topic::Displacements, displacements), (Topic::Angles, angles), (Topic::Loads, loads), (Topic::Energies, energies)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_topic_has_a_chunk_and_a_schema_of_its_own() -> Result<(), DecodeError> {
        for &topic in Topic::ALL {
            let stamped = Message::decode(topic.schema(), &[])?;
            assert_eq!(stamped.map(|message| message.topic()), (topic != Topic::SceneUpdates).then_some(topic));
            assert_eq!(Topic::of_chunk(topic.chunk()), Some(topic));
            let keys = [format!("flexcrank/crank/{}", topic.chunk()), format!("robot/crank/{}", topic.chunk())];
            assert_eq!(keys.map(|key| Topic::of_key(&key)), [Some(topic), None]);
        }
        assert_eq!(
            (Topic::Commands.schema(), Topic::SceneUpdates.schema()),
            ("flexcrank.v1.AppliedCommand", "foxglove.SceneUpdate")
        );
        Ok(())
    }
}
