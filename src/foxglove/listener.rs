//! Receives the messages of viewers: subscriptions, torque pulses, requests of the timeline.

use std::sync::Arc;

use ::foxglove::websocket::{ChannelView, Client, ClientChannel, PlaybackControlRequest, PlaybackState, ServerListener, Status};
use prost::{Message as _, Name as _};

use super::commander::{Commander, Done};
use super::playback::Timeline;
use super::requests;
use super::services::JSON;
use crate::bus::Name;
use crate::wire::TorquePulse;

/// Receives the viewers' messages, and returns at once.
pub(super) struct Listener {
    pub commander: Commander,
    pub names: Arc<[Name]>,
    /// The timeline of a replay.
    pub timeline: Option<Arc<Timeline>>,
}

impl Listener {
    /// The service whose torque key is the topic of a viewer's channel.
    ///
    /// # Errors
    /// Why nothing can be published there.
    fn target(&self, channel: &ClientChannel) -> Result<&Name, String> {
        let topic = channel.topic.trim_start_matches('/');
        let target = self.names.iter().find(|name| name.torque() == topic);
        let target = target.ok_or_else(|| {
            let keys: Vec<String> = self.names.iter().map(Name::torque).collect();
            format!("`{topic}` refuses: viewers publish {} on {}, and nothing else", TorquePulse::full_name(), keys.join(", "))
        })?;
        match self.commander.refusal(topic) {
            Some(why) => Err(why),
            None => Ok(target),
        }
    }
}

/// Decodes a pulse that a viewer publishes.
fn pulse(channel: &ClientChannel, payload: &[u8]) -> Result<TorquePulse, String> {
    match channel.encoding.as_str() {
        JSON => requests::pulse(payload),
        "protobuf" => TorquePulse::decode(payload).map_err(|error| format!("not a {}: {error}", TorquePulse::full_name())),
        other => Err(format!("the encoding `{other}` is not read: use protobuf or json")),
    }
}

impl ServerListener for Listener {
    fn on_message_data(&self, client: Client, channel: &ClientChannel, payload: &[u8]) {
        let target = match self.target(channel) {
            Ok(target) => target,
            Err(why) => return client.send_status(Status::error(why)),
        };
        let key = target.torque();
        match pulse(channel, payload) {
            Ok(pulse) => {
                let done: Done = Box::new(move |reply| match reply {
                    Ok(reply) if reply.accepted => {}
                    Ok(reply) => client.send_status(Status::error(format!("`{key}` refuses: {}", reply.reason))),
                    Err(why) => client.send_status(Status::error(why)),
                });
                self.commander.pulse(target, pulse, done);
            }
            Err(why) => client.send_status(Status::error(format!("`{key}` refuses: {why}"))),
        }
    }

    fn on_client_advertise(&self, client: Client, channel: &ClientChannel) {
        if let Err(why) = self.target(channel) {
            client.send_status(Status::error(why));
        }
    }

    fn on_subscribe(&self, _: Client, _: ChannelView) {
        self.commander.jobs().wake();
    }

    fn on_unsubscribe(&self, _: Client, _: ChannelView) {
        self.commander.jobs().wake();
    }

    fn on_playback_control_request(&self, request: PlaybackControlRequest) -> Option<PlaybackState> {
        self.timeline.as_ref().map(|timeline| timeline.request(&request))
    }
}
