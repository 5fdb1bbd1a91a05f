//! Commands from ROS: a torque topic, and services to pause, step and reset. They go to the service as those of any client.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle};

use prost::{Message as _, Name as _};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::cdr::{CdrError, Value, message};
use super::keys::{Attachment, Endpoint, NodeKeys, topic_key};
use super::publishers::now_ns;
use super::types::RosType;
use crate::bus::{BusError, Name, RefusalLog, admitted, client};
use crate::runtime::Reply;
use crate::wire::{BadCommand, Control, Pause, Reset, Resume, Setpoint, Steps, control::Action};

/// Simulated time that a torque from ROS holds, unless another comes, s.
pub const TORQUE_HOLD_S: f64 = 1.0;
/// Calls of services that wait; further ones are refused.
const WAITING_CALLS: usize = 64;
/// Depth that subscription and services announce.
const DEPTH: usize = 10;

/// Services of a node: last chunk of their names.
const SERVICES: [Service; 3] = [Service::Pause, Service::Step, Service::Reset];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Service {
    Pause,
    Step,
    Reset,
}

impl Service {
    fn name(self) -> &'static str {
        match self {
            Service::Pause => "pause",
            Service::Step => "step",
            Service::Reset => "reset",
        }
    }

    /// Types of the service, its request and its response.
    fn types(self) -> [RosType; 3] {
        match self {
            Service::Pause => [RosType::SET_BOOL, RosType::SET_BOOL_REQUEST, RosType::SET_BOOL_RESPONSE],
            Service::Step | Service::Reset => [RosType::TRIGGER, RosType::TRIGGER_REQUEST, RosType::TRIGGER_RESPONSE],
        }
    }

    /// The command that a request stands for.
    fn action(self, payload: &[u8]) -> Result<Action, CdrError> {
        let [_, request, _] = self.types();
        let request = request.decode(payload)?;
        Ok(match (self, request) {
            (Service::Pause, Value::Message(fields)) if fields == [Value::Bool(false)] => Action::Resume(Resume {}),
            (Service::Pause, _) => Action::Pause(Pause {}),
            (Service::Step, _) => Action::Step(Steps { count: 1 }),
            (Service::Reset, _) => Action::Reset(Reset {}),
        })
    }
}

/// A call of a service, to be answered.
struct Call {
    service: Service,
    /// Its payload, or why it is not admitted.
    payload: Result<Vec<u8>, BadCommand>,
    query: Query,
}

/// The torque topic and the services of a node.
pub(super) struct Commands {
    torque: Option<Subscriber<()>>,
    services: Vec<Queryable<()>>,
    /// Calls for the thread that answers them; `None` ends it.
    calls: SyncSender<Option<Call>>,
    thread: JoinHandle<()>,
    _tokens: Vec<LivelinessToken>,
}

impl Commands {
    /// Number of endpoints of a node that take commands.
    pub(super) const ENDPOINTS: usize = 1 + SERVICES.len();

    /// Declares the torque topic, if it is wanted, and the services.
    pub(super) fn declare(session: &Session, name: &Name, keys: &NodeKeys, with_torque: bool) -> Result<Self, BusError> {
        let mut tokens = Vec::new();
        let mut announce = |token: String| -> Result<(), BusError> {
            tokens.push(session.liveliness().declare_token(token).wait().map_err(BusError::failed)?);
            Ok(())
        };
        let refusal_log = RefusalLog::default();
        let torque = if with_torque {
            let topic = format!("/{}/torque", keys.name);
            let key = topic_key(keys.domain, &topic, RosType::FLOAT64);
            let subscriber = torque_topic(session, name, key, refusal_log.clone())?;
            announce(keys.endpoint(Endpoint::Subscription, 0, (&topic, RosType::FLOAT64), DEPTH))?;
            Some(subscriber)
        } else {
            None
        };
        let (calls, waiting) = sync_channel(WAITING_CALLS);
        let mut services = Vec::new();
        for (index, service) in SERVICES.into_iter().enumerate() {
            let (topic, [of, ..]) = (format!("/{}/{}", keys.name, service.name()), service.types());
            services.push(queryable(session, topic_key(keys.domain, &topic, of), service, calls.clone())?);
            announce(keys.endpoint(Endpoint::Service, index + 1, (&topic, of), DEPTH))?;
        }
        let (session, name) = (session.clone(), name.clone());
        let answering = move || answer_calls(&session, &name, &waiting, &refusal_log);
        let thread = Builder::new().name("ros2-calls".to_owned()).spawn(answering).map_err(BusError::Thread)?;
        Ok(Commands { torque, services, calls, thread, _tokens: tokens })
    }

    /// Takes no more commands.
    pub(super) fn close(self) -> Result<(), BusError> {
        let Commands { torque, services, calls, thread, _tokens: _ } = self;
        if let Some(torque) = torque {
            torque.undeclare().wait().map_err(BusError::failed)?;
        }
        for service in services {
            service.undeclare().wait().map_err(BusError::failed)?;
        }
        // If the thread is gone, joining it tells.
        let _ = calls.send(None);
        thread.join().map_err(|_| BusError::Died("ros2-calls"))
    }
}

/// Subscribes to torques: each becomes a setpoint, with an id that shows its publisher and its number.
fn torque_topic(session: &Session, name: &Name, key: String, refusal_log: RefusalLog) -> Result<Subscriber<()>, BusError> {
    let (own, setpoint_key, to) = (key.clone(), name.setpoint(), session.clone());
    let take = move |sample: Sample| match setpoint(&own, &sample) {
        Ok(setpoint) => {
            if let Err(error) = client::put(&to, &setpoint_key, &setpoint.encode_to_vec(), &Setpoint::full_name()) {
                tracing::warn!(%error, "could not pass on a torque from ROS");
            }
        }
        Err(reason) => refusal_log.record(&Reply::refused(String::new(), reason)),
    };
    session.declare_subscriber(key).callback(take).wait().map_err(BusError::failed)
}

/// The setpoint that a torque stands for.
fn setpoint(own_key: &str, sample: &Sample) -> Result<Setpoint, String> {
    let payload = admitted(own_key, sample.key_expr(), Some(sample.payload())).map_err(|bad| bad.to_string())?;
    let value = RosType::FLOAT64.decode(&payload).map_err(|error| undecodable(RosType::FLOAT64, &error))?;
    let Value::Message(fields) = value else { return Err("no torque".to_owned()) };
    let [Value::F64(torque_nm)] = fields[..] else { return Err("no torque".to_owned()) };
    let attachment = sample.attachment().and_then(|bytes| Attachment::decode(&bytes.to_bytes()));
    let id = attachment.map_or(String::new(), |from| id_of("ros2", &from));
    Ok(Setpoint { id, torque_nm, hold_s: TORQUE_HOLD_S })
}

fn id_of(kind: &str, Attachment { sequence, gid, .. }: &Attachment) -> String {
    let gid: String = gid.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{kind}-{gid}-{sequence}")
}

fn undecodable(of: RosType, error: &CdrError) -> String {
    format!("not a {}: {error}", of.name())
}

/// Declares a service. Its calls are answered by another thread, since an answer may take a while.
fn queryable(
    session: &Session,
    key: String,
    service: Service,
    calls: SyncSender<Option<Call>>,
) -> Result<Queryable<()>, BusError> {
    let own = key.clone();
    let take = move |query: Query| {
        let payload = admitted(&own, query.key_expr(), query.payload());
        if let Err(TrySendError::Full(call) | TrySendError::Disconnected(call)) =
            calls.try_send(Some(Call { service, payload, query }))
        {
            call.iter().for_each(|Call { query, .. }| refuse(query, "too many calls wait"));
        }
    };
    session.declare_queryable(key).complete(true).callback(take).wait().map_err(BusError::failed)
}

fn answer_calls(session: &Session, name: &Name, calls: &Receiver<Option<Call>>, refusal_log: &RefusalLog) {
    while let Ok(Some(Call { service, payload, query })) = calls.recv() {
        let answered =
            payload.map_err(|bad| bad.to_string()).and_then(|payload| answer(session, name, (service, &payload), &query));
        if let Err(reason) = answered {
            refuse(&query, &reason);
            refusal_log.record(&Reply::refused(String::new(), reason));
        }
    }
}

/// Passes a call on as a command, and answers with its reply.
fn answer(session: &Session, name: &Name, (service, payload): (Service, &[u8]), query: &Query) -> Result<(), String> {
    let [_, request, response] = service.types();
    let action = service.action(payload).map_err(|error| undecodable(request, &error))?;
    let attachment = query.attachment().and_then(|bytes: &ZBytes| Attachment::decode(&bytes.to_bytes()));
    let id = attachment.map_or(String::new(), |from| id_of("ros2-call", &from));
    let (accepted, reason) = match client::control(session, name, &Control { id, action: Some(action) }) {
        Ok(reply) => (reply.accepted, reply.reason),
        Err(error) => (false, error.to_string()),
    };
    let payload = response.encode(&message![accepted, reason]).map_err(|error| error.to_string())?;
    let mut reply = query.reply(query.key_expr(), payload).encoding(Encoding::APPLICATION_CDR);
    if let Some(from) = attachment {
        // A client finds its call by number and gid.
        reply = reply.attachment(Attachment { time_ns: now_ns(), ..from }.encode());
    }
    reply.wait().map_err(|error| error.to_string())
}

fn refuse(query: &Query, reason: &str) {
    if let Err(error) = query.reply_err(reason).encoding(Encoding::TEXT_PLAIN).wait() {
        tracing::warn!(%error, "could not reply");
    }
}
