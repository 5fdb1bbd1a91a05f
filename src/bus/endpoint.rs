//! A service's side of the bus: its publishers, its command queryables, its presence.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use prost::Message as _;
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::key_expr::KeyExpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::BusError;
use super::complaints::Complaints;
use super::keys::{Name, Topic};
use crate::runtime::{Command, Inbox, ReplyTo, Request};
use crate::wire::{self, BadCommand, CommandReply, Control, TorquePulse};

/// `application/protobuf;flexcrank.v1.X`.
pub(super) fn protobuf(schema: &str) -> Encoding {
    Encoding::APPLICATION_PROTOBUF.with_schema(schema)
}

/// Largest command, bytes.
const PAYLOAD_LIMIT: usize = 4096;
/// Longest id of a command, bytes: tens of thousands of them are remembered.
const ID_LIMIT: usize = 128;

/// The latest message of every topic and its number, for the snapshot.
#[derive(Debug, Default)]
struct Latest {
    messages: BTreeMap<Topic, (u64, ZBytes)>,
}

/// A service on the bus. Dropping it leaves the bus; [`Endpoint::close`] does so in order.
pub struct Endpoint {
    publishers: BTreeMap<Topic, Publisher<'static>>,
    latest: Arc<Mutex<Latest>>,
    queryables: Vec<Queryable<()>>,
    subscribers: Vec<Subscriber<()>>,
    presence: LivelinessToken,
}

impl Endpoint {
    /// Declares everything a service has: topics, scene, schema, snapshot and, given an inbox, commands; presence last.
    ///
    /// # Errors
    /// [`BusError`] when zenoh refuses a declaration.
    pub fn declare(session: &Session, name: &Name, scene: &str, inbox: Option<&Inbox>) -> Result<Self, BusError> {
        let mut publishers = BTreeMap::new();
        for topic in Topic::ALL {
            let publisher = session
                .declare_publisher(name.topic(topic))
                .encoding(protobuf(topic.schema()))
                .wait()
                .map_err(BusError::failed)?;
            publishers.insert(topic, publisher);
        }
        let latest: Arc<Mutex<Latest>> = Arc::default();
        let mut queryables = vec![
            fixed(session, name.scene(), scene.as_bytes().to_vec(), Encoding::TEXT_PLAIN.with_schema("toml"))?,
            fixed(session, name.schema(), wire::EVERY_DESCRIPTOR_SET.to_vec(), protobuf("google.protobuf.FileDescriptorSet"))?,
            snapshot(session, name.snapshot(), Arc::clone(&latest))?,
        ];
        let mut subscribers = Vec::new();
        if let Some(inbox) = inbox {
            for (key, decode) in [(name.torque(), torque as Decode), (name.control(), control as Decode)] {
                queryables.push(command_queryable(session, &key, decode, inbox.clone())?);
                subscribers.push(command_subscriber(session, &key, decode, inbox.clone())?);
            }
        }
        let presence = session.liveliness().declare_token(name.presence()).wait().map_err(BusError::failed)?;
        Ok(Endpoint { publishers, latest, queryables, subscribers, presence })
    }

    /// Publishes a message and keeps it for the snapshot.
    pub fn publish(&self, topic: Topic, payload: impl Into<ZBytes>) {
        let payload = payload.into();
        // Kept first: whoever has subscribed too late for this message and asks for a snapshot then finds it there.
        let number = self.keep(topic, payload.clone());
        let Some(publisher) = self.publishers.get(&topic) else { return };
        if let Err(error) = publisher.put(payload).attachment(number.to_le_bytes().to_vec()).wait() {
            tracing::warn!(topic = topic.chunk(), %error, "could not publish");
        }
    }

    /// Keeps a message for the snapshot; its number, which counts from 1.
    pub fn keep(&self, topic: Topic, payload: impl Into<ZBytes>) -> u64 {
        let mut latest = lock(&self.latest);
        let (number, kept) = latest.messages.entry(topic).or_default();
        (*number, *kept) = (*number + 1, payload.into());
        *number
    }

    /// Leaves the bus: presence first, then commands, then topics.
    ///
    /// # Errors
    /// [`BusError`] when zenoh refuses.
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

fn lock(latest: &Mutex<Latest>) -> MutexGuard<'_, Latest> {
    latest.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A queryable that always answers the same.
fn fixed(session: &Session, key: String, payload: Vec<u8>, encoding: Encoding) -> Result<Queryable<()>, BusError> {
    let payload = ZBytes::from(payload);
    let answer_key = key.clone();
    session
        .declare_queryable(key)
        .callback(move |query| answer(&query, &answer_key, payload.clone(), encoding.clone()))
        .wait()
        .map_err(BusError::failed)
}

fn snapshot(session: &Session, key: String, latest: Arc<Mutex<Latest>>) -> Result<Queryable<()>, BusError> {
    let answer_key = key.clone();
    let collect = move |query: Query| {
        let payload = lock(&latest).snapshot().encode_to_vec();
        answer(&query, &answer_key, payload.into(), protobuf("flexcrank.v1.Snapshot"));
    };
    session.declare_queryable(key).callback(collect).wait().map_err(BusError::failed)
}

impl Latest {
    fn snapshot(&self) -> wire::Snapshot {
        wire::Snapshot {
            displacements: self.decode(Topic::Displacements),
            angles: self.decode(Topic::Angles),
            loads: self.decode(Topic::Loads),
            status: self.decode(Topic::Status),
            sequences: self.messages.iter().map(|(topic, (number, _))| (topic.chunk().to_owned(), *number)).collect(),
        }
    }

    fn decode<M: prost::Message + Default>(&self, topic: Topic) -> Option<M> {
        self.messages.get(&topic).and_then(|(_, payload)| M::decode(&*payload.to_bytes()).ok())
    }
}

pub(super) fn answer(query: &Query, key: &str, payload: ZBytes, encoding: Encoding) {
    if let Err(error) = query.reply(key, payload).encoding(encoding).wait() {
        tracing::warn!(key, %error, "could not reply");
    }
}

/// From a payload to an id and a request; on failure, the id as far as it could be read.
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

/// The payload of what came, if it came under the very key and is no larger than a command can be.
///
/// A key with wildcards may have passed rules that would have kept the key itself out.
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
    let complaints = Complaints::default();
    let take = move |query: Query| {
        let payload = admitted(&answer_key, query.key_expr(), query.payload());
        if let Err(bad) = &payload {
            complaints.hear(&CommandReply { reason: bad.to_string(), ..CommandReply::default() });
        }
        let key = answer_key.clone();
        let reply = move |reply: CommandReply| {
            answer(&query, &key, reply.encode_to_vec().into(), protobuf("flexcrank.v1.CommandReply"));
        };
        submit(&inbox, payload, decode, Box::new(reply));
    };
    session.declare_queryable(key.to_owned()).callback(take).wait().map_err(BusError::failed)
}

fn command_subscriber(session: &Session, key: &str, decode: Decode, inbox: Inbox) -> Result<Subscriber<()>, BusError> {
    let own_key = key.to_owned();
    let complaints = Complaints::default();
    let take = move |sample: zenoh::sample::Sample| {
        let complaints = complaints.clone();
        let reply = move |reply: CommandReply| complaints.hear(&reply);
        submit(&inbox, admitted(&own_key, sample.key_expr(), Some(sample.payload())), decode, Box::new(reply));
    };
    session.declare_subscriber(key.to_owned()).callback(take).wait().map_err(BusError::failed)
}
