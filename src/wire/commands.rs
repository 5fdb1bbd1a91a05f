//! Commands: decoded from messages and back. Ranges are checked by the simulation.

use super::{Advance, Next, Seek, Setpoint, TorquePulse, control, replay_control, torque_pulse::Shape};
use crate::scene::PulseShape;
use crate::simulation::{AdvanceRequest, PulseRequest, SetpointRequest};

/// The message is not a valid command.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BadCommand {
    /// The payload is not protobuf of the expected type.
    #[error("not a {expected} message: {cause}")]
    Undecodable {
        /// The expected type.
        expected: String,
        /// The decoder's error.
        cause: String,
    },
    /// The pulse shape is unknown.
    #[error("shape {0} does not exist: 0 is RECTANGULAR, 1 is RAISED_COSINE")]
    Shape(i32),
    /// A control message without an action.
    #[error("no action given: pause, resume, step, reset, stop, start_recording, stop_recording, set or level")]
    NoAction,
    /// A replay control message without an action.
    #[error("no action given: pause, resume, seek, rate, next or stop")]
    NoReplayAction,
    /// A recording command to a replay.
    #[error("this is a replay, which does not record")]
    ReplayerRecords,
    /// A change of the scene to a replay.
    #[error("this is a replay: its scene is as recorded")]
    ReplayerChangesScene,
    /// The key has wildcards, and only matches a command key.
    #[error("send commands to `{own}` itself, not to `{key}`")]
    Key {
        /// The key used.
        key: String,
        /// The command key.
        own: String,
    },
    /// The payload is larger than any command.
    #[error("{bytes} bytes are too many for a command: {limit} at most")]
    TooLarge {
        /// Size of the payload.
        bytes: usize,
        /// Size limit.
        limit: usize,
    },
    /// The id is too long for the reply cache.
    #[error("the id has {bytes} bytes: {limit} at most")]
    Id {
        /// Length of the id.
        bytes: usize,
        /// Length limit.
        limit: usize,
    },
    /// There is no payload, or one of a message without any value.
    #[error("the command is empty: a {0} message with values is expected")]
    Empty(String),
}

/// Decodes a pulse.
///
/// # Errors
/// [`BadCommand::Shape`] for an unknown shape.
pub fn pulse_request(message: &TorquePulse) -> Result<PulseRequest, BadCommand> {
    let shape = pulse_shape(message.shape)?;
    let TorquePulse { torque_nm, duration_s, delay_s, .. } = *message;
    Ok(PulseRequest { torque_nm, duration_s, delay_s, shape })
}

/// Translates a command to a service into one to a replay: a step is a message, a reset returns to the start.
///
/// # Errors
/// [`BadCommand::ReplayerRecords`] if the command starts or stops a recording.
pub fn replay_action(action: control::Action) -> Result<replay_control::Action, BadCommand> {
    match action {
        control::Action::Pause(pause) => Ok(replay_control::Action::Pause(pause)),
        control::Action::Resume(resume) => Ok(replay_control::Action::Resume(resume)),
        control::Action::Step(steps) => Ok(replay_control::Action::Next(Next { count: steps.count })),
        control::Action::Reset(_) => Ok(replay_control::Action::Seek(Seek { time_s: 0.0 })),
        control::Action::Stop(stop) => Ok(replay_control::Action::Stop(stop)),
        control::Action::StartRecording(_) | control::Action::StopRecording(_) => Err(BadCommand::ReplayerRecords),
        control::Action::Set(_) | control::Action::Level(_) => Err(BadCommand::ReplayerChangesScene),
    }
}

/// Encodes a pulse.
pub fn pulse_message(id: &str, request: &PulseRequest) -> TorquePulse {
    TorquePulse {
        id: id.to_owned(),
        torque_nm: request.torque_nm,
        duration_s: request.duration_s,
        delay_s: request.delay_s,
        shape: shape(request.shape).into(),
    }
}

/// Decodes a setpoint.
pub fn setpoint_request(message: &Setpoint) -> SetpointRequest {
    SetpointRequest { torque_nm: message.torque_nm, hold_s: message.hold_s }
}

/// Encodes a setpoint.
pub fn setpoint_message(id: &str, request: &SetpointRequest) -> Setpoint {
    Setpoint { id: id.to_owned(), torque_nm: request.torque_nm, hold_s: request.hold_s }
}

/// Decodes an advance.
pub fn advance_request(message: &Advance) -> AdvanceRequest {
    AdvanceRequest { torque_nm: message.torque_nm, steps: message.steps }
}

/// Encodes an advance.
pub fn advance_message(id: &str, request: &AdvanceRequest) -> Advance {
    Advance { id: id.to_owned(), torque_nm: request.torque_nm, steps: request.steps }
}

/// Decodes a pulse shape from its number.
pub(super) fn pulse_shape(number: i32) -> Result<PulseShape, BadCommand> {
    match Shape::try_from(number) {
        Ok(Shape::Rectangular) => Ok(PulseShape::Rectangular),
        Ok(Shape::RaisedCosine) => Ok(PulseShape::RaisedCosine),
        Err(_) => Err(BadCommand::Shape(number)),
    }
}

/// Encodes a pulse shape.
pub fn shape(shape: PulseShape) -> Shape {
    match shape {
        PulseShape::Rectangular => Shape::Rectangular,
        PulseShape::RaisedCosine => Shape::RaisedCosine,
    }
}
