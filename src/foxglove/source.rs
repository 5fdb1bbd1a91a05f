//! The services whose topics are shown: those of this process, live or replayed.

use ::foxglove::Schema;

use crate::bus::{self, LogTime, Name};
use crate::recording::Channel;
use crate::service::ReplayStart;
use crate::wire;

/// A service of this process.
#[derive(Debug, Clone)]
pub struct Source {
    /// Its name on the bus.
    pub name: Name,
    /// The log time of the message that it publishes now.
    pub log_time: LogTime,
    /// Its topics.
    pub topics: Vec<Topic>,
}

/// A topic of a service, with the encoding and the schema that a recording has for it.
#[derive(Debug, Clone)]
pub struct Topic {
    /// Its key on the bus.
    pub key: String,
    /// Encoding of its messages.
    pub encoding: String,
    /// Schema of its messages.
    pub schema: Option<Schema>,
}

impl Source {
    /// A live service with all topics that it publishes.
    pub fn live(name: Name, log_time: LogTime) -> Self {
        let published = bus::Topic::ALL.iter().filter(|topic| topic.is_published());
        let topics = published.map(|topic| Topic::of_service(&name, *topic)).collect();
        Source { name, log_time, topics }
    }

    /// A replay with all topics that it plays, and a status of its own.
    pub fn replay(start: &ReplayStart<'_>, log_time: LogTime) -> Self {
        let mut topics: Vec<Topic> = start.channels.iter().map(|(channel, key)| Topic::recorded(channel, key)).collect();
        topics.push(Topic::of_service(start.name, bus::Topic::Status));
        Source { name: start.name.clone(), log_time, topics }
    }
}

impl Topic {
    fn of_service(name: &Name, topic: bus::Topic) -> Self {
        let schema = Schema::new(topic.schema(), "protobuf", wire::descriptor_set(topic.schema()));
        Topic { key: name.topic(topic), encoding: "protobuf".to_owned(), schema: Some(schema) }
    }

    fn recorded(channel: &Channel, key: &str) -> Self {
        let schema = channel.schema.as_ref();
        let schema = schema.map(|schema| Schema::new(schema.name.clone(), schema.encoding.clone(), schema.data.to_vec()));
        Topic { key: key.to_owned(), encoding: channel.message_encoding.clone(), schema }
    }
}
