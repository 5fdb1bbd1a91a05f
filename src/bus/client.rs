//! A client on the bus: it finds services, sends commands, subscribes to topics and queries snapshots.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use prost::Message as _;
use zenoh::bytes::Encoding;
use zenoh::handlers::{FifoChannel, FifoChannelHandler, RingChannel, RingChannelHandler};
use zenoh::pubsub::Subscriber;
use zenoh::query::QueryTarget;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::BusError;
use super::about::About;
use super::encoding::{protobuf, protobuf_of};
use super::keys::{Name, every, every_presence};
use crate::wire::{
    Advance, AdvanceReply, CommandReply, Control, ReplayControl, Setpoint, Snapshot, Status, Topic, TorquePulse, status::State,
};

/// Time for a service to be found after a session was opened.
pub const DISCOVERY_TIMEOUT: Duration = Duration::from_millis(2000);
/// Time between two looks.
const POLL_PERIOD: Duration = Duration::from_millis(50);
/// Time for a service to reply to a command.
const REPLY_TIMEOUT: Duration = Duration::from_secs(3);
/// Length of a subscriber's queue; older messages are dropped.
const QUEUE_LENGTH: usize = 1024;

/// Returns the services on the bus, sorted, as soon as `enough` accepts them or `patience` has passed.
///
/// # Errors
/// [`BusError`] if zenoh fails.
pub fn services(session: &Session, patience: Duration, enough: impl Fn(&[Name]) -> bool) -> Result<Vec<Name>, BusError> {
    let begun = Instant::now();
    loop {
        let replies = session.liveliness().get(every_presence()).timeout(POLL_PERIOD * 4).wait().map_err(BusError::failed)?;
        let mut found: Vec<Name> = std::iter::from_fn(|| replies.recv().ok())
            .filter_map(|reply| reply.into_result().ok())
            .filter_map(|sample| Name::of_presence(sample.key_expr().as_str()))
            .collect();
        found.sort();
        found.dedup();
        if enough(&found) || begun.elapsed() > patience {
            return Ok(found);
        }
        std::thread::sleep(POLL_PERIOD);
    }
}

/// Returns how many sessions are linked with this one.
pub fn link_count(session: &Session) -> usize {
    session.info().peers_zid().wait().count() + session.info().routers_zid().wait().count()
}

/// A service with its facts and its last status, as far as it answered.
#[derive(Debug, Clone)]
pub struct Described {
    /// Its name.
    pub name: Name,
    /// Its facts.
    pub about: Option<About>,
    /// Its last status.
    pub status: Option<Status>,
}

/// Describes services. All are asked at once; the answer is complete when all have replied, at the latest after three seconds.
///
/// # Errors
/// [`BusError`] if zenoh fails.
pub fn describe(session: &Session, names: &[Name]) -> Result<Vec<Described>, BusError> {
    let ask = |chunk| {
        let query = session.get(every(chunk)).target(QueryTarget::All).timeout(REPLY_TIMEOUT);
        query.wait().map_err(BusError::failed)
    };
    let (snapshots, facts) = (ask("snapshot")?, ask("about")?);
    let (mut statuses, mut abouts) = (HashMap::new(), HashMap::new());
    while let Ok(reply) = snapshots.recv() {
        let Ok(sample) = reply.into_result() else { continue };
        let Some((name, _)) = Name::split(sample.key_expr().as_str()) else { continue };
        statuses.insert(name, Snapshot::decode(&*sample.payload().to_bytes()).ok().and_then(|snapshot| snapshot.status));
    }
    while let Ok(reply) = facts.recv() {
        let Ok(sample) = reply.into_result() else { continue };
        let Some((name, _)) = Name::split(sample.key_expr().as_str()) else { continue };
        abouts.insert(name, serde_json::from_slice::<About>(&sample.payload().to_bytes()).ok());
    }
    let described = |name: &Name| Described {
        name: name.clone(),
        about: abouts.remove(name).flatten(),
        status: statuses.remove(name).flatten(),
    };
    Ok(names.iter().map(described).collect())
}

/// Waits until the service is on the bus.
///
/// # Errors
/// [`BusError::NoSuchService`] if it is not found within two seconds.
pub fn wait_for_service(session: &Session, name: &Name) -> Result<(), BusError> {
    let found = services(session, DISCOVERY_TIMEOUT, |found| found.contains(name))?;
    if found.contains(name) { Ok(()) } else { Err(BusError::NoSuchService { name: name.clone(), found }) }
}

/// Sends a torque pulse and returns the reply.
///
/// # Errors
/// [`BusError::NoReply`] if no reply comes in three seconds, [`BusError::Replay`] if the name is a replay's.
pub fn pulse(session: &Session, name: &Name, pulse: &TorquePulse) -> Result<CommandReply, BusError> {
    command(session, &name.torque(), pulse).map_err(|error| named_if_replay(session, name, error))
}

/// Sends a setpoint and returns the reply.
///
/// # Errors
/// [`BusError::NoReply`] if no reply comes in three seconds, [`BusError::Replay`] if the name is a replay's.
pub fn setpoint(session: &Session, name: &Name, setpoint: &Setpoint) -> Result<CommandReply, BusError> {
    command(session, &name.setpoint(), setpoint).map_err(|error| named_if_replay(session, name, error))
}

/// Applies a torque and takes steps while the service is paused; returns the state after them.
///
/// # Errors
/// [`BusError::NoReply`] if no reply comes within `patience`: a retry under the same id is safe. [`BusError::Replay`] if the name is
/// a replay's.
pub fn advance(session: &Session, name: &Name, advance: &Advance, patience: Duration) -> Result<AdvanceReply, BusError> {
    ask(session, &name.advance(), advance, patience).map_err(|error| named_if_replay(session, name, error))
}

fn named_if_replay(session: &Session, name: &Name, error: BusError) -> BusError {
    match error {
        BusError::NoReply(_) if is_replay(session, name) => BusError::Replay(name.clone()),
        error => error,
    }
}

fn is_replay(session: &Session, name: &Name) -> bool {
    let status = snapshot(session, name).and_then(|snapshot| snapshot.status);
    status.is_some_and(|status| status.state() == State::Replaying)
}

/// Sends a control command and returns the reply.
///
/// # Errors
/// [`BusError::NoReply`] if no reply comes in three seconds.
pub fn control(session: &Session, name: &Name, control: &Control) -> Result<CommandReply, BusError> {
    command(session, &name.control(), control)
}

/// Sends a control command that may have to wait for its instant, and returns the reply; `is_late` is called after three seconds
/// without one.
///
/// # Errors
/// [`BusError::NoReply`] if no reply comes within `patience`.
pub fn control_later(
    session: &Session,
    name: &Name,
    control: &Control,
    patience: Duration,
    is_late: impl FnOnce(),
) -> Result<CommandReply, BusError> {
    ask_later(session, &name.control(), control, patience, is_late)
}

/// Sends a command to a replay and returns the reply.
///
/// # Errors
/// [`BusError::NoReply`] if no reply comes in three seconds.
pub fn replay_control(session: &Session, name: &Name, control: &ReplayControl) -> Result<CommandReply, BusError> {
    command(session, &name.replay(), control)
}

fn command<M: prost::Name>(session: &Session, key: &str, command: &M) -> Result<CommandReply, BusError> {
    ask(session, key, command, REPLY_TIMEOUT)
}

/// Queries a key and decodes the first answer.
fn ask<M: prost::Name, R: prost::Name + Default>(
    session: &Session,
    key: &str,
    question: &M,
    patience: Duration,
) -> Result<R, BusError> {
    ask_later(session, key, question, patience, || {})
}

/// The same; `is_late` is called where no answer came in [`REPLY_TIMEOUT`].
fn ask_later<M: prost::Name, R: prost::Name + Default>(
    session: &Session,
    key: &str,
    question: &M,
    patience: Duration,
    is_late: impl FnOnce(),
) -> Result<R, BusError> {
    let query = session.get(key).payload(question.encode_to_vec()).encoding(protobuf_of::<M>()).timeout(patience);
    let replies = query.wait().map_err(BusError::failed)?;
    let reply = match replies.recv_timeout(REPLY_TIMEOUT.min(patience)) {
        Ok(None) => {
            is_late();
            replies.recv().ok()
        }
        reply => reply.ok().flatten(),
    };
    let sample = reply.and_then(|reply| reply.into_result().ok()).ok_or_else(|| BusError::NoReply(key.to_owned()))?;
    R::decode(&*sample.payload().to_bytes()).map_err(|cause| BusError::Undecodable {
        key: key.to_owned(),
        expected: R::full_name(),
        cause: cause.to_string(),
    })
}

/// Asks a running service for its lowest modes and returns its answer, JSON.
///
/// # Errors
/// [`BusError::Refused`] with the service's reason, [`BusError::NoReply`] if no answer comes, as from a replay.
pub fn modes(session: &Session, name: &Name, count: u64, patience: Duration) -> Result<Vec<u8>, BusError> {
    let key = name.modes();
    let replies = session.get(format!("{key}?count={count}")).timeout(patience).wait().map_err(BusError::failed)?;
    let reply = replies.recv().map_err(|_| BusError::NoReply(key.clone()))?;
    match reply.into_result() {
        Ok(sample) => Ok(sample.payload().to_bytes().into_owned()),
        // zenoh's own error of a query that timed out has no words of the service.
        Err(refused) if refused.encoding() == &Encoding::TEXT_PLAIN => {
            Err(BusError::Refused { key, why: refused.payload().try_to_string().unwrap_or_default().into_owned() })
        }
        Err(_) => Err(BusError::NoReply(key)),
    }
}

/// A subscriber to one topic of one service. Its queue keeps the newest samples.
pub type TopicSubscriber = Subscriber<RingChannelHandler<Sample>>;

/// Subscribes to a topic.
///
/// # Errors
/// [`BusError`] if zenoh refuses.
pub fn subscribe(session: &Session, name: &Name, topic: Topic) -> Result<TopicSubscriber, BusError> {
    session.declare_subscriber(name.topic(topic)).with(RingChannel::new(QUEUE_LENGTH)).wait().map_err(BusError::failed)
}

/// Returns the messages that arrived since the last call, oldest first, without undecodable ones.
pub fn new_messages<M: prost::Message + Default>(subscriber: &TopicSubscriber) -> impl Iterator<Item = M> {
    std::iter::from_fn(|| subscriber.try_recv().ok().flatten()).filter_map(|sample| M::decode(&*sample.payload().to_bytes()).ok())
}

/// Queries the scene in force, TOML; `None` if the service does not answer.
pub fn scene(session: &Session, name: &Name) -> Option<String> {
    let replies = session.get(name.scene()).timeout(REPLY_TIMEOUT).wait().ok()?;
    let sample = replies.recv().ok()?.into_result().ok()?;
    Some(sample.payload().try_to_string().ok()?.into_owned())
}

/// Queries the snapshot: the newest message of every topic; `None` if the service does not answer.
pub fn snapshot(session: &Session, name: &Name) -> Option<Snapshot> {
    let replies = session.get(name.snapshot()).timeout(REPLY_TIMEOUT).wait().ok()?;
    let sample = replies.recv().ok()?.into_result().ok()?;
    Snapshot::decode(&*sample.payload().to_bytes()).ok()
}

/// A subscription that starts from a snapshot, without a gap.
pub struct Joined {
    /// The snapshot at the start.
    pub snapshot: Snapshot,
    /// Sequence number of the topic's last message.
    number: u64,
    subscriber: Subscriber<FifoChannelHandler<Sample>>,
}

impl Joined {
    /// Returns the next message and the number of missing ones before it; `None` if none comes in time.
    pub fn next(&mut self, patience: Duration) -> Option<(Vec<u8>, u64)> {
        loop {
            let sample = self.subscriber.recv_timeout(patience).ok().flatten()?;
            let bytes = sample.attachment().map(|number| number.to_bytes().into_owned());
            let number = u64::from_le_bytes(bytes?.try_into().ok()?);
            // Messages up to the snapshot are duplicates.
            if number > self.number {
                let missing = number - self.number - 1;
                self.number = number;
                return Some((sample.payload().to_bytes().into_owned(), missing));
            }
        }
    }
}

/// Joins a topic of a running service: subscribes, then queries the snapshot.
///
/// # Errors
/// [`BusError::NoReply`] if the service does not answer in three seconds.
pub fn join(session: &Session, name: &Name, topic: Topic) -> Result<Joined, BusError> {
    let subscriber =
        session.declare_subscriber(name.topic(topic)).with(FifoChannel::new(1024)).wait().map_err(BusError::failed)?;
    let snapshot = snapshot(session, name).ok_or_else(|| BusError::NoReply(name.snapshot()))?;
    let number = snapshot.sequences.get(topic.chunk()).copied().unwrap_or(0);
    Ok(Joined { snapshot, number, subscriber })
}

/// Publishes raw bytes under any key, with an encoding that names their protobuf type.
///
/// # Errors
/// [`BusError`] if zenoh refuses.
pub fn put(session: &Session, key: &str, payload: &[u8], schema: &str) -> Result<(), BusError> {
    session.put(key, payload).encoding(protobuf(schema)).wait().map_err(BusError::failed)
}

/// Returns the first of `names` that another service on the bus has.
///
/// # Errors
/// [`BusError`] if zenoh fails.
pub fn first_taken(session: &Session, names: &[&Name]) -> Result<Option<Name>, BusError> {
    let alone = session.info().peers_zid().wait().next().is_none() && session.info().routers_zid().wait().next().is_none();
    if alone || names.is_empty() {
        return Ok(None);
    }
    let found = services(session, POLL_PERIOD * 4, |found| names.iter().any(|name| found.contains(name)))?;
    Ok(names.iter().find(|name| found.contains(name)).map(|name| (*name).clone()))
}
