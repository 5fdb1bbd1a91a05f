//! The feed of one topic: a subscription on the bus that lasts while a viewer subscribes.

use std::sync::Arc;

use ::foxglove::{Context, PartialMetadata, RawChannel};

use super::FoxgloveError;
use super::source::Topic;
use crate::bus::{BusError, LogTime, OwnSubscription, Session};

/// A topic on its way from the bus to the viewers.
pub(super) struct Feed {
    key: String,
    channel: Arc<RawChannel>,
    log_time: LogTime,
    subscription: Option<OwnSubscription>,
}

impl Feed {
    /// Offers a topic to viewers.
    ///
    /// # Errors
    /// [`FoxgloveError`] if the topic cannot be offered.
    pub fn new(context: &Arc<Context>, topic: Topic, log_time: LogTime) -> Result<Self, FoxgloveError> {
        let Topic { key, encoding, schema } = topic;
        let channel = context.channel_builder(key.as_str()).message_encoding(encoding).schema(schema).build_raw()?;
        Ok(Feed { key, channel, log_time, subscription: None })
    }

    /// Begins or ends the subscription on the bus, as the viewers' subscriptions ask for.
    pub fn follow_viewers(&mut self, session: &Session) {
        let changed = match (self.channel.has_sinks(), self.subscription.take()) {
            (true, None) => self.subscribe(session),
            (false, Some(subscription)) => subscription.close(),
            (_, unchanged) => {
                self.subscription = unchanged;
                Ok(())
            }
        };
        if let Err(error) = changed {
            tracing::warn!(key = self.key, %error, "foxglove: could not follow the topic");
        }
    }

    fn subscribe(&mut self, session: &Session) -> Result<(), BusError> {
        let (channel, log_time) = (Arc::clone(&self.channel), self.log_time.clone());
        let forward = move |payload: &[u8]| channel.log_with_meta(payload, PartialMetadata { log_time: Some(log_time.get()) });
        self.subscription = Some(OwnSubscription::declare(session, &self.key, forward)?);
        Ok(())
    }
}
