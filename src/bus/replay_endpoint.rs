//! A replayer's side of its remote control: `…/replay`, and what makes sense of `…/control`.

use std::sync::Arc;

use prost::Message as _;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::BusError;
use super::keys::Name;
use super::service_endpoint::{admitted, answer, decode, protobuf};
use crate::runtime::ReplyTo;
use crate::wire::{self, BadCommand, CommandReply, Control, ReplayControl, replay_control::Action};

/// Takes an order: its id, what it asks for, and where the answer goes.
pub type Take = Arc<dyn Fn(String, Action, ReplyTo) + Send + Sync>;

/// From a payload to an id and an order; on failure, the id as far as it could be read.
type Decode = fn(&[u8]) -> Result<(String, Action), (String, BadCommand)>;

/// A replayer's controls on the bus.
pub struct ReplayEndpoint {
    queryables: [Queryable<()>; 2],
    subscriber: Subscriber<()>,
}

impl ReplayEndpoint {
    /// Declares `…/replay`, for queries and puts, and `…/control`, for queries only: what a recording says there when it is
    /// replayed with its commands is meant for others.
    ///
    /// # Errors
    /// [`BusError`] when zenoh refuses.
    pub fn declare(session: &Session, name: &Name, take: &Take) -> Result<Self, BusError> {
        let queryables = [queryable(session, name.replay(), replay, take)?, queryable(session, name.control(), control, take)?];
        let own = Arc::clone(take);
        let reply = |reply: CommandReply| {
            if !reply.accepted {
                tracing::warn!(id = reply.id, reason = reply.reason, "a command was refused");
            }
        };
        let own_key = name.replay();
        let hear = move |sample: Sample| {
            submit(&own, admitted(&own_key, sample.key_expr(), Some(sample.payload())), replay, Box::new(reply));
        };
        let subscriber = session.declare_subscriber(name.replay()).callback(hear).wait().map_err(BusError::failed)?;
        Ok(ReplayEndpoint { queryables, subscriber })
    }

    /// Leaves the bus.
    ///
    /// # Errors
    /// [`BusError`] when zenoh refuses.
    pub fn close(self) -> Result<(), BusError> {
        self.subscriber.undeclare().wait().map_err(BusError::failed)?;
        for queryable in self.queryables {
            queryable.undeclare().wait().map_err(BusError::failed)?;
        }
        Ok(())
    }
}

fn queryable(session: &Session, key: String, decode: Decode, take: &Take) -> Result<Queryable<()>, BusError> {
    let (own, answer_key) = (Arc::clone(take), key.clone());
    let hear = move |query: Query| {
        let payload = admitted(&answer_key, query.key_expr(), query.payload());
        let key = answer_key.clone();
        let reply = move |reply: CommandReply| {
            answer(&query, &key, reply.encode_to_vec().into(), protobuf("flexcrank.v1.CommandReply"));
        };
        submit(&own, payload, decode, Box::new(reply));
    };
    session.declare_queryable(key).callback(hear).wait().map_err(BusError::failed)
}

fn submit(take: &Take, payload: Result<Vec<u8>, BadCommand>, decode: Decode, reply: ReplyTo) {
    match payload.map_err(|bad| (String::new(), bad)).and_then(|payload| decode(&payload)) {
        Ok((id, action)) => take(id, action, reply),
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
