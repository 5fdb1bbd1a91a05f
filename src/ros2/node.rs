//! A service as a ROS 2 node: it subscribes to the service's own topics and publishes them under the keys of `rmw_zenoh`.

use std::sync::Arc;
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::commands::Commands;
use super::keys::{NodeKeys, node_name};
use super::messages::Converter;
use super::publishers::Publishers;
use super::queue::{NewestQueue, Next};
use super::types::RosType;
use crate::bus::{BusError, Name, Topic};
use crate::wire::Message;

/// Topics of the service from which ROS messages are made.
const TOPICS: [Topic; 4] = [Topic::Displacements, Topic::Angles, Topic::Loads, Topic::Status];
/// Messages that wait for conversion; the oldest beyond them are dropped.
const QUEUE_LENGTH: usize = 4096;
/// Wait for the rest of a step, if topics have different rates.
const STEP_PATIENCE: Duration = Duration::from_millis(10);
/// Wait for a message otherwise.
const PATIENCE: Duration = Duration::from_secs(1);

/// Options of a node.
#[derive(Debug, Clone, Copy)]
pub struct NodeOptions {
    /// ROS domain.
    pub domain: u8,
    /// Number of the node in its session. Number 0 publishes `/clock`.
    pub number: usize,
    /// Whether torques are accepted: a replay accepts none.
    pub takes_torque: bool,
}

/// A message of the service, as it came.
type Received = (Topic, Vec<u8>);

/// A running node.
pub struct Node {
    queue: Arc<NewestQueue<Received>>,
    subscribers: Vec<Subscriber<()>>,
    commands: Commands,
    publishing: JoinHandle<()>,
    _token: LivelinessToken,
}

impl Node {
    /// Announces the service `name` of this session as a node, and publishes what it publishes.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses a declaration, or the system a thread.
    pub fn start(session: &Session, name: &Name, options: NodeOptions) -> Result<Self, BusError> {
        let NodeOptions { domain, number, takes_torque } = options;
        let keys = NodeKeys { domain, session: session.zid().to_string(), number, name: node_name(name) };
        let token = session.liveliness().declare_token(keys.node()).wait().map_err(BusError::failed)?;
        let commands = Commands::declare(session, name, &keys, takes_torque)?;
        let mut publishers = Publishers::new(session, keys.clone(), Commands::ENDPOINTS);
        let converter = Converter::new(&keys.name, number == 0);
        for (topic, of) in topics_from_the_start(&keys.name, number == 0) {
            publishers.declare(&topic, of)?;
        }
        let queue = Arc::new(NewestQueue::new(QUEUE_LENGTH));
        let from = Arc::clone(&queue);
        let publish = move || publish(&from, converter, publishers);
        let publishing = Builder::new().name("ros2".to_owned()).spawn(publish).map_err(BusError::Thread)?;
        let subscribe = |topic: Topic| {
            let to = Arc::clone(&queue);
            // zenoh calls this on the thread that publishes, so it must return at once.
            let take = move |sample: Sample| to.push((topic, sample.payload().to_bytes().into_owned()));
            session.declare_subscriber(name.topic(topic)).callback(take).wait().map_err(BusError::failed)
        };
        let subscribers = TOPICS.into_iter().map(subscribe).collect::<Result<_, _>>()?;
        Ok(Node { queue, subscribers, commands, publishing, _token: token })
    }

    /// Publishes what has come, and leaves the ROS graph. Returns the number of messages dropped because conversion was too slow.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses, or a thread died.
    pub fn close(self) -> Result<u64, BusError> {
        let Node { queue, subscribers, commands, publishing, _token: _ } = self;
        let left = subscribers.into_iter().try_for_each(|subscriber| subscriber.undeclare().wait());
        queue.close();
        let ended = publishing.join();
        commands.close()?;
        left.map_err(BusError::failed)?;
        ended.map_err(|_| BusError::Died("ros2"))?;
        Ok(queue.dropped())
    }
}

/// Topics that every node has; those of joints follow with the first loads.
fn topics_from_the_start(node: &str, with_clock: bool) -> Vec<(String, RosType)> {
    let clock = with_clock.then(|| ("/clock".to_owned(), RosType::CLOCK));
    let others = [
        (format!("/{node}/joint_states"), RosType::JOINT_STATE),
        ("/tf".to_owned(), RosType::TF_MESSAGE),
        (format!("/{node}/markers"), RosType::MARKER_ARRAY),
        ("/diagnostics".to_owned(), RosType::DIAGNOSTIC_ARRAY),
    ];
    clock.into_iter().chain(others).collect()
}

/// Converts and publishes until the queue is closed and empty.
fn publish(queue: &NewestQueue<Received>, mut converter: Converter, mut publishers: Publishers) {
    loop {
        let patience = if converter.is_waiting() { STEP_PATIENCE } else { PATIENCE };
        let messages = match queue.next(patience) {
            Next::Item((topic, payload)) => match Message::decode(topic.schema(), &payload) {
                Ok(Some(message)) => converter.take(message),
                // The service's own messages can be decoded.
                Ok(None) | Err(_) => Vec::new(),
            },
            Next::Nothing => converter.finish(),
            Next::Closed => break,
        };
        messages.iter().for_each(|message| publishers.publish(message));
    }
    converter.finish().iter().for_each(|message| publishers.publish(message));
}
