//! Commands from outside, decoded and checked for shape; ranges are the simulation's to judge.

use super::{Next, Seek, TorquePulse, control, replay_control, torque_pulse::Shape};
use crate::scene::PulseShape;
use crate::simulation::PulseRequest;

/// A message that is not a command.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BadCommand {
    /// Not protobuf of the expected type.
    #[error("not a flexcrank.v1.{expected} message: {cause}")]
    Undecodable {
        /// The type that the key expects.
        expected: &'static str,
        /// What the decoder says.
        cause: String,
    },
    /// A pulse of a shape that does not exist.
    #[error("shape {0} does not exist: 0 is RECTANGULAR, 1 is RAISED_COSINE")]
    Shape(i32),
    /// A control message that asks for nothing.
    #[error("no action given: pause, resume, step, reset, stop, start_recording or stop_recording")]
    NoAction,
    /// A message to a replayer that asks for nothing.
    #[error("no action given: pause, resume, seek, rate, next or stop")]
    NoReplayAction,
    /// What a replayer cannot do.
    #[error("this is a replayer: it does not record")]
    ReplayerRecords,
    /// Sent to a key with wildcards that matches the key of a command.
    #[error("commands are sent to `{own}` itself, not to `{key}`")]
    Key {
        /// Where it was sent to.
        key: String,
        /// Where it is to be sent.
        own: String,
    },
    /// Larger than any command.
    #[error("{bytes} bytes are too many for a command: {limit} at most")]
    TooLarge {
        /// How large it is.
        bytes: usize,
        /// How large it may be.
        limit: usize,
    },
    /// An id that would fill the memory of ids.
    #[error("the id has {bytes} bytes: {limit} at most")]
    Id {
        /// How long it is.
        bytes: usize,
        /// How long it may be.
        limit: usize,
    },
    /// No payload at all.
    #[error("the command has no payload: a flexcrank.v1.{0} message is expected")]
    Empty(&'static str),
}

/// What a pulse message asks for.
///
/// # Errors
/// [`BadCommand::Shape`] for an unknown shape.
pub fn pulse_request(message: &TorquePulse) -> Result<PulseRequest, BadCommand> {
    let shape = pulse_shape(message.shape)?;
    let TorquePulse { torque_nm, duration_s, delay_s, .. } = *message;
    Ok(PulseRequest { torque_nm, duration_s, delay_s, shape })
}

/// What a command to a service means to a replayer: a step is a message, a reset goes back to the start.
///
/// # Errors
/// [`BadCommand::ReplayerRecords`] when it is about recording.
pub fn replay_action(action: control::Action) -> Result<replay_control::Action, BadCommand> {
    match action {
        control::Action::Pause(pause) => Ok(replay_control::Action::Pause(pause)),
        control::Action::Resume(resume) => Ok(replay_control::Action::Resume(resume)),
        control::Action::Step(steps) => Ok(replay_control::Action::Next(Next { count: steps.count })),
        control::Action::Reset(_) => Ok(replay_control::Action::Seek(Seek { time_s: 0.0 })),
        control::Action::Stop(stop) => Ok(replay_control::Action::Stop(stop)),
        control::Action::StartRecording(_) | control::Action::StopRecording(_) => Err(BadCommand::ReplayerRecords),
    }
}

/// A request as a message.
pub fn pulse_message(id: &str, request: &PulseRequest) -> TorquePulse {
    TorquePulse {
        id: id.to_owned(),
        torque_nm: request.torque_nm,
        duration_s: request.duration_s,
        delay_s: request.delay_s,
        shape: shape(request.shape).into(),
    }
}

/// A pulse shape as a message numbers it.
pub(super) fn pulse_shape(number: i32) -> Result<PulseShape, BadCommand> {
    match Shape::try_from(number) {
        Ok(Shape::Rectangular) => Ok(PulseShape::Rectangular),
        Ok(Shape::RaisedCosine) => Ok(PulseShape::RaisedCosine),
        Err(_) => Err(BadCommand::Shape(number)),
    }
}

/// A pulse shape as the proto names it.
pub fn shape(shape: PulseShape) -> Shape {
    match shape {
        PulseShape::Rectangular => Shape::Rectangular,
        PulseShape::RaisedCosine => Shape::RaisedCosine,
    }
}
