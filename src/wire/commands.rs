//! Commands from outside, decoded and checked for shape; ranges are the simulation's to judge.

use super::{TorquePulse, torque_pulse::Shape};
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
