//! A service on the bus: it publishes topics, answers snapshot queries and receives commands.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use prost::Message as _;
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::BusError;
use super::about::About;
use super::commands::CommandKey;
use super::encoding::{answer, protobuf, protobuf_of};
use super::keys::Name;
use super::log_time::LogTime;
use super::question::{self, Question};
use super::snapshot_cache::{SnapshotCache, SnapshotEntry};
use super::subscription_state::SubscriptionState;
use crate::wire::{self, Snapshot, Topic};

/// Time that routers have to answer.
const ROUTER_TIMEOUT: Duration = Duration::from_millis(500);

/// A service on the bus. Dropping it leaves the bus; [`ServiceEndpoint::close`] does so in order.
pub struct ServiceEndpoint {
    publishers: BTreeMap<Topic, Publisher<'static>>,
    subscription_states: Arc<BTreeMap<Topic, SubscriptionState>>,
    latest: Arc<Mutex<SnapshotCache>>,
    scene: Arc<Mutex<ZBytes>>,
    queryables: Vec<Queryable<()>>,
    commands: Vec<CommandKey>,
    presence: LivelinessToken,
    /// Receives the log time of every message, for viewers in this process.
    log_time: Option<LogTime>,
}

impl ServiceEndpoint {
    /// Declares topics, scene, facts, schema and snapshot of a service whose command keys are declared already; presence last.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses a declaration.
    pub fn declare(
        session: &Session,
        name: &Name,
        (scene, about): (&str, &About),
        commands: Vec<CommandKey>,
    ) -> Result<Self, BusError> {
        let (mut publishers, mut subscription_states) = (BTreeMap::new(), BTreeMap::new());
        for &topic in Topic::ALL.iter().filter(|topic| topic.is_published()) {
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
        let scene = Arc::new(Mutex::new(ZBytes::from(scene)));
        let queryables = vec![
            scene_in_force(session, name.scene(), Arc::clone(&scene))?,
            fixed(session, name.about(), serde_json::to_vec(about).unwrap_or_default(), Encoding::APPLICATION_JSON)?,
            fixed(session, name.schema(), wire::EVERY_DESCRIPTOR_SET.to_vec(), protobuf("google.protobuf.FileDescriptorSet"))?,
            snapshot(session, name.snapshot(), Arc::clone(&latest), Arc::clone(&subscription_states))?,
        ];
        let presence = session.liveliness().declare_token(name.presence()).wait().map_err(BusError::failed)?;
        Ok(ServiceEndpoint { publishers, subscription_states, latest, scene, queryables, commands, presence, log_time: None })
    }

    /// The same endpoint, which hands the log time of its messages on.
    pub fn with_log_time(self, log_time: Option<LogTime>) -> Self {
        ServiceEndpoint { log_time, ..self }
    }

    /// Hands the log time of the next message on, if a viewer in this process wants it.
    pub fn note_log_time(&self, log_time_ns: impl FnOnce() -> u64) {
        if let Some(log_time) = &self.log_time {
            log_time.set(log_time_ns());
        }
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

    /// Takes questions for the service's modes; `take` must return at once.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn take_questions_for_modes(
        &mut self,
        session: &Session,
        name: &Name,
        take: impl Fn(Question) + Send + Sync + 'static,
    ) -> Result<(), BusError> {
        self.queryables.push(question::receive(session, name.modes(), take)?);
        Ok(())
    }

    /// Sets the scene in force.
    pub fn set_scene(&self, text: &str) {
        *self.scene.lock().unwrap_or_else(PoisonError::into_inner) = ZBytes::from(text);
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
        for command in self.commands {
            command.close()?;
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

/// A queryable that answers with the scene in force.
fn scene_in_force(session: &Session, key: String, scene: Arc<Mutex<ZBytes>>) -> Result<Queryable<()>, BusError> {
    let own = key.clone();
    let reply = move |query: Query| {
        let text = scene.lock().unwrap_or_else(PoisonError::into_inner).clone();
        answer(&query, &own, text, Encoding::TEXT_PLAIN.with_schema("toml"));
    };
    session.declare_queryable(key).callback(reply).wait().map_err(BusError::failed)
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
        answer(&query, &answer_key, snapshot.encode_to_vec(), protobuf_of::<Snapshot>());
    };
    session.declare_queryable(key).callback(collect).wait().map_err(BusError::failed)
}
