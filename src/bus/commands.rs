//! Commands on the bus: a query is answered, a put is not.

use prost::{DecodeError, Message as _};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::BusError;
use super::encoding::{answer, protobuf_of};
use super::keys::Name;
use super::refusal_log::RefusalLog;
use crate::runtime::{Command, Inbox, Reply, ReplyTo, Request, Response};
use crate::wire::{
    self, Advance, AdvanceReply, BadCommand, CommandReply, Control, ReplayControl, Setpoint, TorquePulse, replay_control,
};

/// Size limit of a command, bytes.
const PAYLOAD_LIMIT: usize = 4096;
/// Length limit of a command's id, bytes: the reply cache keeps tens of thousands.
const ID_LIMIT: usize = 128;

/// A command's payload, or why it is not admitted.
type Payload = Result<Vec<u8>, BadCommand>;
/// The id and the request of a command, or its id as far as it was readable and why it is refused.
type Decoded<T> = Result<(String, T), (String, BadCommand)>;

/// Whether a key accepts puts, and the encoding of its replies.
#[derive(Clone, Copy)]
struct KeyOptions {
    /// Whether it accepts puts beside queries.
    puts: bool,
    encode: fn(Response) -> (Vec<u8>, Encoding),
}

const COMMANDS: KeyOptions =
    KeyOptions { puts: true, encode: |to| (CommandReply::from(to.reply).encode_to_vec(), protobuf_of::<CommandReply>()) };
const QUERIES: KeyOptions = KeyOptions { puts: false, ..COMMANDS };
const ADVANCES: KeyOptions =
    KeyOptions { puts: false, encode: |to| (AdvanceReply::from(to).encode_to_vec(), protobuf_of::<AdvanceReply>()) };

/// A key that accepts commands.
pub struct CommandKey {
    queryable: Queryable<()>,
    subscriber: Option<Subscriber<()>>,
}

/// Declares the command keys of a service, `…/torque`, `…/setpoint`, `…/control` and `…/advance`. `submit` takes their commands and must return at
/// once.
///
/// # Errors
/// [`BusError`] if zenoh refuses.
pub fn service_commands(
    session: &Session,
    name: &Name,
    inbox: &Inbox,
    submit: impl Fn(Command) + Clone + Send + Sync + 'static,
) -> Result<Vec<CommandKey>, BusError> {
    let declare = |key, options, decode: fn(Payload) -> Decoded<Request>| {
        let (inbox, submit) = (inbox.clone(), submit.clone());
        CommandKey::declare(session, key, options, decode, move |decoded, reply| match decoded {
            Ok((id, request)) => submit(Command { id, request, reply, change: None }),
            Err((id, bad)) => inbox.refuse(id, bad.to_string(), reply),
        })
    };
    Ok(vec![
        declare(name.torque(), COMMANDS, torque)?,
        declare(name.setpoint(), COMMANDS, setpoint)?,
        declare(name.control(), COMMANDS, control)?,
        declare(name.advance(), ADVANCES, advance)?,
    ])
}

/// Declares the command keys of a replay: `…/replay` for queries and puts, and `…/control` for queries only, because the replay
/// itself puts recorded control commands there, for others.
///
/// # Errors
/// [`BusError`] if zenoh refuses.
pub fn replay_commands(
    session: &Session,
    name: &Name,
    handle: impl Fn(String, replay_control::Action, ReplyTo) + Clone + Send + Sync + 'static,
) -> Result<Vec<CommandKey>, BusError> {
    let declare = |key, options, decode: fn(Payload) -> Decoded<replay_control::Action>| {
        let handle = handle.clone();
        CommandKey::declare(session, key, options, decode, move |decoded, reply| match decoded {
            Ok((id, action)) => handle(id, action, reply),
            Err((id, bad)) => reply(Reply::refused(id, bad.to_string()).into()),
        })
    };
    Ok(vec![declare(name.replay(), COMMANDS, replay)?, declare(name.control(), QUERIES, control_of_replay)?])
}

impl CommandKey {
    /// Declares a key. The log tells of refused puts, which get no reply, and of queries beyond the limits of commands.
    fn declare<T: 'static>(
        session: &Session,
        key: String,
        options: KeyOptions,
        decode: fn(Payload) -> Decoded<T>,
        receive: impl Fn(Decoded<T>, ReplyTo) + Clone + Send + Sync + 'static,
    ) -> Result<Self, BusError> {
        let refusal_log = RefusalLog::default();
        let (receive_put, put_key, put_log) = (receive.clone(), key.clone(), refusal_log.clone());
        let put = move |sample: Sample| {
            let refusal_log = put_log.clone();
            let payload = admitted(&put_key, sample.key_expr(), Some(sample.payload()));
            receive_put(decode(payload), Box::new(move |response| refusal_log.record(&response.reply)));
        };
        let own_key = key.clone();
        let query = move |query: Query| {
            let decoded = decode(admitted(&own_key, query.key_expr(), query.payload()));
            if let Err((_, bad)) = &decoded
                && is_beyond_limits(bad)
            {
                refusal_log.record(&Reply::refused(String::new(), bad.to_string()));
            }
            let key = own_key.clone();
            let reply = move |response: Response| {
                let (payload, encoding) = (options.encode)(response);
                answer(&query, &key, payload, encoding);
            };
            receive(decoded, Box::new(reply));
        };
        let queryable = session.declare_queryable(key.clone()).callback(query).wait().map_err(BusError::failed)?;
        let subscriber = options.puts.then(|| session.declare_subscriber(key).callback(put).wait().map_err(BusError::failed));
        Ok(CommandKey { queryable, subscriber: subscriber.transpose()? })
    }

    /// Undeclares the key.
    pub(super) fn close(self) -> Result<(), BusError> {
        if let Some(subscriber) = self.subscriber {
            subscriber.undeclare().wait().map_err(BusError::failed)?;
        }
        self.queryable.undeclare().wait().map_err(BusError::failed)
    }
}

/// Checks that a message came under the exact key and within the size limit, and returns its payload.
///
/// A key with wildcards may pass access rules that would block the key itself.
pub(crate) fn admitted(own_key: &str, key: &KeyExpr, payload: Option<&ZBytes>) -> Payload {
    let bytes = payload.map_or(0, ZBytes::len);
    if key.as_str() != own_key {
        return Err(BadCommand::Key { key: key.to_string(), own: own_key.to_owned() });
    }
    if bytes > PAYLOAD_LIMIT {
        return Err(BadCommand::TooLarge { bytes, limit: PAYLOAD_LIMIT });
    }
    Ok(payload.map(|payload| payload.to_bytes().into_owned()).unwrap_or_default())
}

/// Whether a command is refused for its key, its size or the length of its id.
fn is_beyond_limits(bad: &BadCommand) -> bool {
    matches!(bad, BadCommand::Key { .. } | BadCommand::TooLarge { .. } | BadCommand::Id { .. })
}

/// Decodes an admitted payload, splits the message into id and request, and checks the length of the id.
fn decode<M: prost::Name + Default, T>(payload: Payload, split: fn(M) -> (String, Result<T, BadCommand>)) -> Decoded<T> {
    let bad = |bad| (String::new(), bad);
    let payload = payload.map_err(bad)?;
    if payload.is_empty() {
        return Err(bad(BadCommand::Empty(M::full_name())));
    }
    let undecodable = |error: DecodeError| BadCommand::Undecodable { expected: M::full_name(), cause: error.to_string() };
    let (id, request) = split(M::decode(payload.as_slice()).map_err(|error| bad(undecodable(error)))?);
    if id.len() > ID_LIMIT {
        return Err(bad(BadCommand::Id { bytes: id.len(), limit: ID_LIMIT }));
    }
    match request {
        Ok(request) => Ok((id, request)),
        Err(bad) => Err((id, bad)),
    }
}

fn torque(payload: Payload) -> Decoded<Request> {
    decode(payload, |pulse: TorquePulse| {
        let request = wire::pulse_request(&pulse).map(Request::Torque);
        (pulse.id, request)
    })
}

fn setpoint(payload: Payload) -> Decoded<Request> {
    decode(payload, |setpoint: Setpoint| {
        let request = wire::setpoint_request(&setpoint);
        (setpoint.id, Ok(Request::Setpoint(request)))
    })
}

fn advance(payload: Payload) -> Decoded<Request> {
    decode(payload, |advance: Advance| {
        let request = wire::advance_request(&advance);
        (advance.id, Ok(Request::Advance(request)))
    })
}

fn control(payload: Payload) -> Decoded<Request> {
    decode(payload, |Control { id, action }| {
        (id, action.ok_or(BadCommand::NoAction).map(|action| Request::Control(action.into())))
    })
}

fn replay(payload: Payload) -> Decoded<replay_control::Action> {
    decode(payload, |ReplayControl { id, action }| (id, action.ok_or(BadCommand::NoReplayAction)))
}

fn control_of_replay(payload: Payload) -> Decoded<replay_control::Action> {
    decode(payload, |Control { id, action }| (id, action.ok_or(BadCommand::NoAction).and_then(wire::replay_action)))
}
