//! The publishers of a node, declared when a topic is first used.

use std::collections::HashMap;
use std::time::SystemTime;

use zenoh::bytes::Encoding;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::{Session, Wait};

use super::keys::{Attachment, Endpoint, Gid, NodeKeys, gid, topic_key};
use super::messages::RosMessage;
use super::types::RosType;
use crate::bus::BusError;

/// Depth that publishers announce: the default of ROS.
const DEPTH: usize = 10;
/// The same for frames: the default of `tf2`.
const TF_DEPTH: usize = 100;

/// The publishers of a node.
pub(super) struct Publishers {
    session: Session,
    keys: NodeKeys,
    by_topic: HashMap<String, RosPublisher>,
    /// Number of the next endpoint of the node.
    next_id: usize,
}

struct RosPublisher {
    publisher: Publisher<'static>,
    gid: Gid,
    sequence: i64,
    /// Announces the publisher as long as it lives.
    _token: LivelinessToken,
}

impl Publishers {
    pub(super) fn new(session: &Session, keys: NodeKeys, next_id: usize) -> Self {
        Publishers { session: session.clone(), keys, by_topic: HashMap::new(), next_id }
    }

    /// Declares a topic's publisher, unless it is declared already.
    pub(super) fn declare(&mut self, topic: &str, of: RosType) -> Result<(), BusError> {
        if self.by_topic.contains_key(topic) {
            return Ok(());
        }
        let depth = if topic == "/tf" { TF_DEPTH } else { DEPTH };
        let token_key = self.keys.endpoint(Endpoint::Publisher, self.next_id, (topic, of), depth);
        let publisher = self
            .session
            .declare_publisher(topic_key(self.keys.domain, topic, of))
            .encoding(Encoding::APPLICATION_CDR)
            .wait()
            .map_err(BusError::failed)?;
        let gid = gid(&token_key);
        let token = self.session.liveliness().declare_token(token_key).wait().map_err(BusError::failed)?;
        self.next_id += 1;
        self.by_topic.insert(topic.to_owned(), RosPublisher { publisher, gid, sequence: 0, _token: token });
        Ok(())
    }

    /// Publishes a message.
    pub(super) fn publish(&mut self, message: &RosMessage) {
        let RosMessage { topic, of, value } = message;
        let payload = match of.encode(value) {
            Ok(payload) => payload,
            Err(error) => return tracing::error!(topic, %error, "could not encode a ROS message"),
        };
        if let Err(error) = self.declare(topic, *of) {
            return tracing::warn!(topic, %error, "could not declare a ROS topic");
        }
        let Some(to) = self.by_topic.get_mut(topic) else { return };
        to.sequence += 1;
        let attachment = Attachment { sequence: to.sequence, time_ns: now_ns(), gid: to.gid };
        if let Err(error) = to.publisher.put(payload).attachment(attachment.encode()).wait() {
            tracing::warn!(topic, %error, "could not publish");
        }
    }
}

/// Wall clock, ns since 1970.
pub(super) fn now_ns() -> i64 {
    i64::try_from(crate::recording::nanoseconds(SystemTime::now())).unwrap_or(i64::MAX)
}
