//! Commands of viewers in JSON, and the replies to them.

use serde::Deserialize;
use serde_json::json;

use crate::scene::PulseShape;
use crate::simulation::{PulseRequest, SetpointRequest};
use crate::wire::{self, CommandReply, Setpoint, TorquePulse, control};

/// JSON schema of a pulse.
pub(super) const PULSE_SCHEMA: &str = r#"{"title": "flexcrank.v1.TorquePulse", "type": "object",
"properties": {"id": {"type": "string", "description": "a retry under the same id is not applied again"},
"torque_nm": {"type": "number"}, "duration_s": {"type": "number"}, "delay_s": {"type": "number", "default": 0},
"shape": {"type": "string", "enum": ["rectangular", "raised-cosine"], "default": "rectangular"}},
"required": ["torque_nm", "duration_s"], "additionalProperties": false}"#;
/// JSON schema of a setpoint.
pub(super) const SETPOINT_SCHEMA: &str = r#"{"title": "flexcrank.v1.Setpoint", "type": "object",
"properties": {"id": {"type": "string"}, "torque_nm": {"type": "number"},
"hold_s": {"type": "number", "description": "simulated time, 1e-6 to 60"}},
"required": ["torque_nm", "hold_s"], "additionalProperties": false}"#;
/// JSON schema of a control command.
pub(super) const CONTROL_SCHEMA: &str = r#"{"title": "flexcrank.v1.Control", "type": "object",
"properties": {"action": {"type": "string", "enum": ["pause", "resume", "step", "reset", "stop", "start-recording",
"stop-recording", "set", "level"]}, "count": {"type": "integer", "description": "of step"},
"name": {"type": "string", "description": "of start-recording and level"},
"changes": {"type": "array", "items": {"type": "string"}, "description": "of set: KEY=VALUE"}},
"required": ["action"], "additionalProperties": false}"#;
/// JSON schema of a reply.
pub(super) const REPLY_SCHEMA: &str = r#"{"title": "flexcrank.v1.CommandReply", "type": "object",
"properties": {"id": {"type": "string"}, "accepted": {"type": "boolean"}, "reason": {"type": "string"},
"effective_step": {"type": "integer"}, "effective_sim_time_s": {"type": "number"},
"changed_j": {"type": ["number", "null"]}}}"#;

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Shape {
    #[default]
    #[serde(alias = "RECTANGULAR")]
    Rectangular,
    #[serde(alias = "RAISED_COSINE")]
    RaisedCosine,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonPulse {
    #[serde(default)]
    id: String,
    torque_nm: f64,
    duration_s: f64,
    #[serde(default)]
    delay_s: f64,
    #[serde(default)]
    shape: Shape,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonSetpoint {
    #[serde(default)]
    id: String,
    torque_nm: f64,
    hold_s: f64,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "action", rename_all = "kebab-case", deny_unknown_fields)]
enum JsonControl {
    Pause {},
    Resume {},
    Step {
        #[serde(default = "one")]
        count: u64,
    },
    Reset {},
    Stop {},
    StartRecording {
        #[serde(default)]
        name: String,
    },
    StopRecording {},
    Set {
        changes: Vec<String>,
    },
    Level {
        name: String,
    },
}

fn one() -> u64 {
    1
}

fn parsed<'a, T: Deserialize<'a>>(json: &'a [u8], what: &str) -> Result<T, String> {
    serde_json::from_slice(json).map_err(|error| format!("not a {what} in JSON: {error}"))
}

/// Reads a pulse.
///
/// # Errors
/// Why it is not one.
pub(super) fn pulse(json: &[u8]) -> Result<TorquePulse, String> {
    let JsonPulse { id, torque_nm, duration_s, delay_s, shape } = parsed(json, "pulse")?;
    let shape = match shape {
        Shape::Rectangular => PulseShape::Rectangular,
        Shape::RaisedCosine => PulseShape::RaisedCosine,
    };
    Ok(wire::pulse_message(&id, &PulseRequest { torque_nm, duration_s, delay_s, shape }))
}

/// Reads a setpoint.
///
/// # Errors
/// Why it is not one.
pub(super) fn setpoint(json: &[u8]) -> Result<Setpoint, String> {
    let JsonSetpoint { id, torque_nm, hold_s } = parsed(json, "setpoint")?;
    Ok(wire::setpoint_message(&id, &SetpointRequest { torque_nm, hold_s }))
}

/// Reads a control command.
///
/// # Errors
/// Why it is not one.
pub(super) fn control(json: &[u8]) -> Result<control::Action, String> {
    Ok(match parsed(json, "control command")? {
        JsonControl::Pause {} => control::Action::Pause(wire::Pause {}),
        JsonControl::Resume {} => control::Action::Resume(wire::Resume {}),
        JsonControl::Step { count } => control::Action::Step(wire::Steps { count }),
        JsonControl::Reset {} => control::Action::Reset(wire::Reset {}),
        JsonControl::Stop {} => control::Action::Stop(wire::Stop {}),
        JsonControl::StartRecording { name } => control::Action::StartRecording(wire::StartRecording { name }),
        JsonControl::StopRecording {} => control::Action::StopRecording(wire::StopRecording {}),
        JsonControl::Set { changes } => control::Action::Set(wire::Set { changes }),
        JsonControl::Level { name } => control::Action::Level(wire::Level { name }),
    })
}

/// A reply as JSON.
pub(super) fn reply(reply: &CommandReply) -> Vec<u8> {
    let CommandReply { id, accepted, reason, effective_step, effective_sim_time_s, changed_j } = reply;
    let json = json!({
        "id": id,
        "accepted": accepted,
        "reason": reason,
        "effective_step": effective_step,
        "effective_sim_time_s": effective_sim_time_s,
        "changed_j": changed_j,
    });
    json.to_string().into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_requests_in_json_are_read_or_refused_with_the_reason() -> Result<(), String> {
        let read = pulse(br#"{"torque_nm": 5, "duration_s": 0.1, "shape": "raised-cosine"}"#)?;
        assert_eq!((read.torque_nm, read.duration_s, read.shape), (5.0, 0.1, 1));
        assert_eq!(setpoint(br#"{"torque_nm": -2, "hold_s": 1}"#)?.hold_s, 1.0);
        assert!(matches!(control(br#"{"action": "step"}"#)?, control::Action::Step(wire::Steps { count: 1 })));
        let set = control(br#"{"action": "set", "changes": ["rod.rigid=true"]}"#)?;
        assert!(matches!(set, control::Action::Set(wire::Set { changes }) if changes == ["rod.rigid=true"]));
        for (json, reason) in [
            (&b"{}"[..], "missing field"),
            (br#"{"torque_nm": 5, "duration_s": 0.1, "torque": 5}"#, "unknown field `torque`"),
            (br#"{"torque_nm": "5", "duration_s": 0.1}"#, "invalid type"),
            (b"\xff", "pulse"),
        ] {
            let refused = pulse(json).unwrap_err();
            assert!(refused.contains(reason), "{refused}");
        }
        assert!(control(br#"{"action": "explode"}"#).unwrap_err().contains("unknown variant"));
        Ok(())
    }

    #[test]
    fn prop_the_schemas_are_json() {
        for schema in [PULSE_SCHEMA, SETPOINT_SCHEMA, CONTROL_SCHEMA, REPLY_SCHEMA] {
            assert!(serde_json::from_str::<serde_json::Value>(schema).is_ok_and(|schema| schema["type"] == "object"), "{schema}");
        }
    }
}
