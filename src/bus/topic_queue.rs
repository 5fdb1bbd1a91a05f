//! The messages of several topics of one service, in the order in which they were published.

use zenoh::handlers::{IntoHandler, RingChannel, RingChannelHandler};
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::BusError;
use super::keys::Name;
use crate::wire::{Message, Topic};

/// Length of the queue; older messages are dropped.
const LENGTH: usize = 4096;

/// Subscriptions to several topics of one service with one queue: messages come in the order in which the service published them.
pub struct TopicQueue {
    queue: RingChannelHandler<Sample>,
    /// They fill the queue until they are dropped.
    _subscribers: Vec<Subscriber<()>>,
}

impl TopicQueue {
    /// Subscribes to the topics.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn subscribe(session: &Session, name: &Name, topics: &[Topic]) -> Result<Self, BusError> {
        let (callback, queue) = IntoHandler::<Sample>::into_handler(RingChannel::new(LENGTH));
        let subscribe = |topic: &Topic| {
            session.declare_subscriber(name.topic(*topic)).with(callback.clone()).wait().map_err(BusError::failed)
        };
        let subscribers = topics.iter().map(subscribe).collect::<Result<Vec<_>, _>>()?;
        Ok(TopicQueue { queue, _subscribers: subscribers })
    }

    /// Returns the messages that arrived since the last call, oldest first, without undecodable ones.
    pub fn new_messages(&self) -> impl Iterator<Item = Message> {
        std::iter::from_fn(move || self.queue.try_recv().ok().flatten()).filter_map(|sample| decode(&sample))
    }
}

fn decode(sample: &Sample) -> Option<Message> {
    let (_, chunk) = Name::split(sample.key_expr().as_str())?;
    let topic = Topic::of_chunk(chunk)?;
    Message::decode(topic.schema(), &sample.payload().to_bytes()).ok()?
}
