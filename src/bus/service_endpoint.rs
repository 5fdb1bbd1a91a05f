//! A service on the bus: it publishes topics, answers snapshot queries and receives commands.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use prost::Message as _;
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::key_expr::KeyExpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::BusError;
use super::keys::{Name, Topic};
use super::refusal_log::RefusalLog;
use super::snapshot_cache::{SnapshotCache, SnapshotEntry};
use super::subscription_state::SubscriptionState;
use crate::runtime::{Command, Inbox, ReplyTo, Request};
use crate::wire::{self, BadCommand, CommandReply, Control, Snapshot, TorquePulse};

/// The encoding `application/protobuf;flexcrank.v1.X`.
pub(super) fn protobuf(schema: &str) -> Encoding {
    Encoding::APPLICATION_PROTOBUF.with_schema(schema)
}

/// Size limit of a command, bytes.
const PAYLOAD_LIMIT: usize = 4096;
/// Time that routers have to answer.
const ROUTER_TIMEOUT: Duration = Duration::from_millis(500);
/// Length limit of a command's id, bytes: the reply cache keeps tens of thousands.
const ID_LIMIT: usize = 128;

/// A service on the bus. Dropping it leaves the bus; [`ServiceEndpoint::close`] does so in order.
pub struct ServiceEndpoint {
    publishers: BTreeMap<Topic, Publisher<'static>>,
    subscription_states: Arc<BTreeMap<Topic, SubscriptionState>>,
    latest: Arc<Mutex<SnapshotCache>>,
    queryables: Vec<Queryable<()>>,
    subscribers: Vec<Subscriber<()>>,
    presence: LivelinessToken,
}

impl ServiceEndpoint {
    /// Declares topics, scene, schema, snapshot and, given an inbox, commands; presence last.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses a declaration.
    pub fn declare(session: &Session, name: &Name, scene: &str, inbox: Option<&Inbox>) -> Result<Self, BusError> {
        let (mut publishers, mut subscription_states) = (BTreeMap::new(), BTreeMap::new());
        for topic in Topic::ALL {
            let publisher = session
                .declare_publisher(name.topic(topic))
                .encoding(protobuf(topic.schema()))
                .wait()
                .map_err(BusError::failed)?;
            subscription_states.insert(topic, SubscriptionState::of(&publisher)?);
            publishers.insert(topic, publisher);
        }
        let subscription_states = Arc::new(subscription_states);
        wait_for_routers(session, name)?;
        let latest: Arc<Mutex<SnapshotCache>> = Arc::default();
        let mut queryables = vec![
            fixed(session, name.scene(), scene.as_bytes().to_vec(), Encoding::TEXT_PLAIN.with_schema("toml"))?,
            fixed(session, name.schema(), wire::EVERY_DESCRIPTOR_SET.to_vec(), protobuf("google.protobuf.FileDescriptorSet"))?,
            snapshot(session, name.snapshot(), Arc::clone(&latest), Arc::clone(&subscription_states))?,
        ];
        let mut subscribers = Vec::new();
        if let Some(inbox) = inbox {
            for (key, decode) in [(name.torque(), torque as Decode), (name.control(), control as Decode)] {
                queryables.push(command_queryable(session, &key, decode, inbox.clone())?);
                subscribers.push(command_subscriber(session, &key, decode, inbox.clone())?);
            }
        }
        let presence = session.liveliness().declare_token(name.presence()).wait().map_err(BusError::failed)?;
        Ok(ServiceEndpoint { publishers, subscription_states, latest, queryables, subscribers, presence })
    }

    /// Publishes a message, and stores it for the snapshot.
    pub fn publish(&self, topic: Topic, payload: impl Into<ZBytes>) {
        let payload = payload.into();
        let (number, _) = self.keep(topic, payload.clone());
        if self.has_subscribers(topic) {
            self.put(topic, number, payload);
        }
    }

    /// Stores a message for the snapshot. This comes first, so that a client that subscribes too late for the message finds it in
    /// the snapshot. Returns its sequence number, which counts from 1, and the previous entry.
    pub fn keep(&self, topic: Topic, newest: impl Into<SnapshotEntry>) -> (u64, SnapshotEntry) {
        lock(&self.latest).keep(topic, newest.into())
    }

    /// Whether a topic has subscribers. Ask after a message is stored; if so, [`put`](ServiceEndpoint::put) it.
    ///
    /// A client that subscribes and then queries the snapshot is known here before the next message is stored.
    pub fn has_subscribers(&self, topic: Topic) -> bool {
        let state = self.subscription_states.get(&topic).zip(self.publishers.get(&topic));
        state.is_some_and(|(state, publisher)| state.has_subscribers(publisher))
    }

    /// Publishes a message with its sequence number.
    pub fn put(&self, topic: Topic, number: u64, payload: impl Into<ZBytes>) {
        let Some(publisher) = self.publishers.get(&topic) else { return };
        if let Err(error) = publisher.put(payload.into()).attachment(number.to_le_bytes().to_vec()).wait() {
            tracing::warn!(topic = topic.chunk(), %error, "could not publish");
        }
    }

    /// The newest message of every topic.
    pub fn snapshot(&self) -> Snapshot {
        lock(&self.latest).snapshot()
    }

    /// Leaves the bus: presence first, then commands, then topics.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn close(self) -> Result<(), BusError> {
        self.presence.undeclare().wait().map_err(BusError::failed)?;
        for subscriber in self.subscribers {
            subscriber.undeclare().wait().map_err(BusError::failed)?;
        }
        for queryable in self.queryables {
            queryable.undeclare().wait().map_err(BusError::failed)?;
        }
        for publisher in self.publishers.into_values() {
            publisher.undeclare().wait().map_err(BusError::failed)?;
        }
        Ok(())
    }
}

/// Waits until routers have announced existing subscriptions: the announcement precedes the answer to this query.
fn wait_for_routers(session: &Session, name: &Name) -> Result<(), BusError> {
    let answers = session.liveliness().get(name.presence()).timeout(ROUTER_TIMEOUT).wait().map_err(BusError::failed)?;
    while answers.recv().is_ok() {}
    Ok(())
}

fn lock(latest: &Mutex<SnapshotCache>) -> MutexGuard<'_, SnapshotCache> {
    latest.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A queryable with a constant answer.
fn fixed(session: &Session, key: String, payload: Vec<u8>, encoding: Encoding) -> Result<Queryable<()>, BusError> {
    let payload = ZBytes::from(payload);
    let answer_key = key.clone();
    session
        .declare_queryable(key)
        .callback(move |query| answer(&query, &answer_key, payload.clone(), encoding.clone()))
        .wait()
        .map_err(BusError::failed)
}

fn snapshot(
    session: &Session,
    key: String,
    latest: Arc<Mutex<SnapshotCache>>,
    subscription_states: Arc<BTreeMap<Topic, SubscriptionState>>,
) -> Result<Queryable<()>, BusError> {
    let answer_key = key.clone();
    let collect = move |query: Query| {
        let snapshot = {
            let latest = lock(&latest);
            // Messages stored from here on must reach the querying client, if it has subscribed.
            subscription_states.values().for_each(SubscriptionState::expire);
            latest.snapshot()
        };
        answer(&query, &answer_key, snapshot.encode_to_vec().into(), protobuf("flexcrank.v1.Snapshot"));
    };
    session.declare_queryable(key).callback(collect).wait().map_err(BusError::failed)
}

pub(super) fn answer(query: &Query, key: &str, payload: ZBytes, encoding: Encoding) {
    if let Err(error) = query.reply(key, payload).encoding(encoding).wait() {
        tracing::warn!(key, %error, "could not reply");
    }
}

/// Decodes a payload into an id and a request. On failure, returns the id as far as it was readable.
type Decode = fn(&[u8]) -> Result<(String, Request), (String, BadCommand)>;

fn torque(payload: &[u8]) -> Result<(String, Request), (String, BadCommand)> {
    let pulse: TorquePulse = decode(payload, "TorquePulse")?;
    let request = wire::pulse_request(&pulse).map_err(|bad| (pulse.id.clone(), bad))?;
    Ok((pulse.id, Request::Torque(request)))
}

fn control(payload: &[u8]) -> Result<(String, Request), (String, BadCommand)> {
    let Control { id, action } = decode(payload, "Control")?;
    match action {
        Some(action) => Ok((id, Request::Control(action))),
        None => Err((id, BadCommand::NoAction)),
    }
}

/// Checks that a message came under the exact key and within the size limit, and returns its payload.
///
/// A key with wildcards may pass access rules that would block the key itself.
pub(super) fn admitted(own_key: &str, key: &KeyExpr, payload: Option<&ZBytes>) -> Result<Vec<u8>, BadCommand> {
    let bytes = payload.map_or(0, ZBytes::len);
    if key.as_str() != own_key {
        return Err(BadCommand::Key { key: key.to_string(), own: own_key.to_owned() });
    }
    if bytes > PAYLOAD_LIMIT {
        return Err(BadCommand::TooLarge { bytes, limit: PAYLOAD_LIMIT });
    }
    Ok(payload.map(|payload| payload.to_bytes().into_owned()).unwrap_or_default())
}

pub(super) fn decode<M: prost::Message + Default>(payload: &[u8], expected: &'static str) -> Result<M, (String, BadCommand)> {
    let bad = |bad| (String::new(), bad);
    if payload.is_empty() {
        return Err(bad(BadCommand::Empty(expected)));
    }
    M::decode(payload).map_err(|error| bad(BadCommand::Undecodable { expected, cause: error.to_string() }))
}

fn submit(inbox: &Inbox, payload: Result<Vec<u8>, BadCommand>, decode: Decode, reply: ReplyTo) {
    match payload.map_err(|bad| (String::new(), bad)).and_then(|payload| decode(&payload)) {
        Ok((id, _)) if id.len() > ID_LIMIT => {
            let bad = BadCommand::Id { bytes: id.len(), limit: ID_LIMIT };
            inbox.refuse(String::new(), bad.to_string(), reply);
        }
        Ok((id, request)) => inbox.submit(Command { id, request, reply }),
        Err((id, bad)) => inbox.refuse(id, bad.to_string(), reply),
    }
}

fn command_queryable(session: &Session, key: &str, decode: Decode, inbox: Inbox) -> Result<Queryable<()>, BusError> {
    let answer_key = key.to_owned();
    let refusal_log = RefusalLog::default();
    let receive = move |query: Query| {
        let payload = admitted(&answer_key, query.key_expr(), query.payload());
        if let Err(bad) = &payload {
            refusal_log.record(&CommandReply { reason: bad.to_string(), ..CommandReply::default() });
        }
        let key = answer_key.clone();
        let reply = move |reply: CommandReply| {
            answer(&query, &key, reply.encode_to_vec().into(), protobuf("flexcrank.v1.CommandReply"));
        };
        submit(&inbox, payload, decode, Box::new(reply));
    };
    session.declare_queryable(key.to_owned()).callback(receive).wait().map_err(BusError::failed)
}

fn command_subscriber(session: &Session, key: &str, decode: Decode, inbox: Inbox) -> Result<Subscriber<()>, BusError> {
    let own_key = key.to_owned();
    let refusal_log = RefusalLog::default();
    let receive = move |sample: zenoh::sample::Sample| {
        let refusal_log = refusal_log.clone();
        let reply = move |reply: CommandReply| refusal_log.record(&reply);
        submit(&inbox, admitted(&own_key, sample.key_expr(), Some(sample.payload())), decode, Box::new(reply));
    };
    session.declare_subscriber(key.to_owned()).callback(receive).wait().map_err(BusError::failed)
}
