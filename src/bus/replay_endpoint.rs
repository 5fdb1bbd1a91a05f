//! A replay's commands on the bus: `…/replay`, and those of `…/control` that make sense for a replay.

use std::sync::Arc;

use prost::Message as _;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::BusError;
use super::keys::Name;
use super::refusal_log::RefusalLog;
use super::service_endpoint::{admitted, answer, decode, protobuf};
use crate::runtime::ReplyTo;
use crate::wire::{self, BadCommand, CommandReply, Control, ReplayControl, replay_control::Action};

/// Handles a command: its id, its action, and the callback for the reply.
pub type HandleCommand = Arc<dyn Fn(String, Action, ReplyTo) + Send + Sync>;

/// Decodes a payload into an id and an action. On failure, returns the id as far as it was readable.
type Decode = fn(&[u8]) -> Result<(String, Action), (String, BadCommand)>;

/// The command keys of a replay.
pub struct ReplayEndpoint {
    queryables: [Queryable<()>; 2],
    subscriber: Subscriber<()>,
}

impl ReplayEndpoint {
    /// Declares `…/replay` for queries and puts, and `…/control` for queries only: the replay itself puts recorded control
    /// commands there, for others.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn declare(session: &Session, name: &Name, handle: &HandleCommand) -> Result<Self, BusError> {
        let queryables =
            [queryable(session, name.replay(), replay, handle)?, queryable(session, name.control(), control, handle)?];
        let (own, own_key, refusal_log) = (Arc::clone(handle), name.replay(), RefusalLog::default());
        let receive = move |sample: Sample| {
            let refusal_log = refusal_log.clone();
            let reply = move |reply: CommandReply| refusal_log.record(&reply);
            submit(&own, admitted(&own_key, sample.key_expr(), Some(sample.payload())), replay, Box::new(reply));
        };
        let subscriber = session.declare_subscriber(name.replay()).callback(receive).wait().map_err(BusError::failed)?;
        Ok(ReplayEndpoint { queryables, subscriber })
    }

    /// Leaves the bus.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn close(self) -> Result<(), BusError> {
        self.subscriber.undeclare().wait().map_err(BusError::failed)?;
        for queryable in self.queryables {
            queryable.undeclare().wait().map_err(BusError::failed)?;
        }
        Ok(())
    }
}

fn queryable(session: &Session, key: String, decode: Decode, handle: &HandleCommand) -> Result<Queryable<()>, BusError> {
    let (own, answer_key) = (Arc::clone(handle), key.clone());
    let receive = move |query: Query| {
        let payload = admitted(&answer_key, query.key_expr(), query.payload());
        let key = answer_key.clone();
        let reply = move |reply: CommandReply| {
            answer(&query, &key, reply.encode_to_vec().into(), protobuf("flexcrank.v1.CommandReply"));
        };
        submit(&own, payload, decode, Box::new(reply));
    };
    session.declare_queryable(key).callback(receive).wait().map_err(BusError::failed)
}

fn submit(handle: &HandleCommand, payload: Result<Vec<u8>, BadCommand>, decode: Decode, reply: ReplyTo) {
    match payload.map_err(|bad| (String::new(), bad)).and_then(|payload| decode(&payload)) {
        Ok((id, action)) => handle(id, action, reply),
        Err((id, bad)) => reply(CommandReply { id, reason: bad.to_string(), ..CommandReply::default() }),
    }
}

fn replay(payload: &[u8]) -> Result<(String, Action), (String, BadCommand)> {
    let ReplayControl { id, action } = decode(payload, "ReplayControl")?;
    match action {
        Some(action) => Ok((id, action)),
        None => Err((id, BadCommand::NoReplayAction)),
    }
}

fn control(payload: &[u8]) -> Result<(String, Action), (String, BadCommand)> {
    let Control { id, action } = decode(payload, "Control")?;
    let understood = action.ok_or(BadCommand::NoAction).and_then(wire::replay_action);
    understood.map(|action| (id.clone(), action)).map_err(|bad| (id, bad))
}
