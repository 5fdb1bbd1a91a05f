//! ROS messages from the messages of a service.

use std::collections::BTreeMap;

use super::cdr::{Value, message};
use super::markers::{markers, vector};
use super::types::RosType;
use crate::wire::status::{EnergyVerdict, State};
use crate::wire::{Angles, Displacements, LinkAngle, Loads, Message, NodeState, Stamp, Status, by_link};

/// Rate of markers, per simulated second.
const MARKERS_HZ: f64 = 25.0;
/// Levels of `diagnostic_msgs/DiagnosticStatus`.
const OK: u8 = 0;
const WARN: u8 = 1;
const ERROR: u8 = 2;

/// A message for ROS.
#[derive(Debug, Clone, PartialEq)]
pub struct RosMessage {
    /// Name of the topic: `/crank/joint_states`.
    pub topic: String,
    /// Its type.
    pub of: RosType,
    /// Its value.
    pub value: Value,
}

/// Makes ROS messages from the messages of one service.
///
/// A joint state joins angles, displacements and loads of one step. They come in the order displacements, angles, loads, so that
/// loads, or a message of another step, complete a step.
pub struct Converter {
    /// Name of the node: the prefix of topics and frames.
    node: String,
    /// Whether it publishes `/clock`: among the services of a process, one does.
    with_clock: bool,
    /// Epoch and step of the messages that wait.
    at: Option<(u64, u64)>,
    displacements: Option<Displacements>,
    angles: Option<Angles>,
    loads: Option<Loads>,
    /// Whether the mechanism has a slider, as its loads show.
    has_slider: bool,
    /// Epoch and time of the last clock, s.
    clock: Option<(u64, f64)>,
    /// Epoch of the last markers, and the period in which they were.
    marked: Option<(u64, f64)>,
}

impl Converter {
    /// Makes the messages of the node of this name.
    pub fn new(node: &str, with_clock: bool) -> Self {
        Converter {
            node: node.to_owned(),
            with_clock,
            at: None,
            displacements: None,
            angles: None,
            loads: None,
            has_slider: false,
            clock: None,
            marked: None,
        }
    }

    /// Takes a message, and returns the ROS messages that it completes.
    pub fn take(&mut self, message: Message) -> Vec<RosMessage> {
        let Some(stamp) = message.stamp() else { return Vec::new() };
        let mut completed = Vec::new();
        if matches!(message, Message::Displacements(_) | Message::Angles(_) | Message::Loads(_)) {
            let at = Some((stamp.epoch, stamp.step));
            if self.at != at {
                completed = self.finish();
                self.at = at;
            }
        }
        match message {
            Message::Displacements(displacements) => self.displacements = Some(*displacements),
            Message::Angles(angles) => self.angles = Some(*angles),
            Message::Loads(loads) => {
                self.has_slider = loads.resistance_n.is_some();
                self.loads = Some(*loads);
                completed.extend(self.finish());
            }
            Message::Status(status) => completed.push(self.diagnostics(&stamp, &status)),
            _ => {}
        }
        completed
    }

    /// Whether messages of a step wait for others.
    pub fn is_waiting(&self) -> bool {
        self.displacements.is_some() || self.angles.is_some()
    }

    /// Returns the ROS messages of the step, as far as its messages have come.
    pub fn finish(&mut self) -> Vec<RosMessage> {
        let (displacements, angles, loads) = (self.displacements.take(), self.angles.take(), self.loads.take());
        let stamps = [
            angles.as_ref().and_then(|angles| angles.stamp),
            displacements.as_ref().and_then(|displacements| displacements.stamp),
            loads.as_ref().and_then(|loads| loads.stamp),
        ];
        let Some(stamp) = stamps.into_iter().flatten().next() else { return Vec::new() };
        let mut made = Vec::new();
        if self.with_clock && self.clock.replace((stamp.epoch, stamp.sim_time_s)) != Some((stamp.epoch, stamp.sim_time_s)) {
            made.push(self.message("/clock", RosType::CLOCK, message![time(stamp.sim_time_s)]));
        }
        if let Some(angles) = &angles {
            let end = displacements.as_ref().and_then(|displacements| displacements.nodes.last());
            let joints = joint_states(angles, end.filter(|_| self.has_slider), loads.as_ref());
            made.push(self.own("joint_states", RosType::JOINT_STATE, self.with_header(&stamp, joints)));
        }
        if let (Some(angles), Some(displacements)) = (&angles, &displacements) {
            let frames: Value = self.frames(&stamp, angles, &displacements.nodes).into_iter().collect();
            made.push(self.message("/tf", RosType::TF_MESSAGE, message![frames]));
        }
        for joint in loads.iter().flat_map(|loads| &loads.joints) {
            let wrench = message![vector([joint.fx_n, joint.fy_n]), vector([0.0, 0.0])];
            let topic = format!("joints/{}", joint.joint.replace('-', "_"));
            made.push(self.own(&topic, RosType::WRENCH_STAMPED, self.with_header(&stamp, vec![wrench])));
        }
        if let Some(displacements) = displacements.filter(|_| self.marks(&stamp)) {
            let value = markers(&displacements, self.has_slider, &header(&stamp, &self.node));
            made.push(self.own("markers", RosType::MARKER_ARRAY, value));
        }
        made
    }

    fn message(&self, topic: &str, of: RosType, value: Value) -> RosMessage {
        RosMessage { topic: topic.to_owned(), of, value }
    }

    /// A message on a topic under the node's name.
    fn own(&self, topic: &str, of: RosType, value: Value) -> RosMessage {
        RosMessage { topic: format!("/{}/{topic}", self.node), of, value }
    }

    /// The value of a message that begins with a header in the frame of the service.
    fn with_header(&self, stamp: &Stamp, mut fields: Vec<Value>) -> Value {
        fields.insert(0, header(stamp, &self.node));
        Value::Message(fields)
    }

    /// Whether markers are due: once in every period of simulated time.
    fn marks(&mut self, stamp: &Stamp) -> bool {
        let period = (stamp.epoch, (stamp.sim_time_s * MARKERS_HZ + 1e-9).floor());
        self.marked.replace(period) != Some(period)
    }

    /// Poses of the links' frames: the origin at the first pin, the x axis to the last.
    fn frames(&self, stamp: &Stamp, angles: &Angles, nodes: &[NodeState]) -> Vec<Value> {
        let pins: BTreeMap<&str, &NodeState> =
            by_link(nodes).filter_map(|link| Some((link.first()?.link.as_str(), link.first()?))).collect();
        let links = angles.links.iter().filter_map(|link| Some((link, *pins.get(link.link.as_str())?)));
        let mut frames: Vec<Value> = links
            .map(|(LinkAngle { link, chord_rad, .. }, pin)| self.frame(stamp, link, [pin.x_m, pin.y_m], *chord_rad))
            .collect();
        if let Some(end) = nodes.last().filter(|_| self.has_slider) {
            frames.push(self.frame(stamp, "slider", [end.x_m, end.y_m], 0.0));
        }
        frames
    }

    fn frame(&self, stamp: &Stamp, link: &str, at: [f64; 2], angle_rad: f64) -> Value {
        let (sine, cosine) = (0.5 * angle_rad).sin_cos();
        let pose = message![vector(at), message![0.0, 0.0, sine, cosine]];
        message![header(stamp, &self.node), format!("{}/{link}", self.node), pose]
    }

    fn diagnostics(&self, stamp: &Stamp, status: &Status) -> RosMessage {
        let level = match status.state() {
            State::Diverged => ERROR,
            _ if !status.message.is_empty() || status.energy_verdict() == EnergyVerdict::Unbalanced => WARN,
            _ => OK,
        };
        let state = status.state().as_str_name();
        let said = if status.message.is_empty() { state } else { &status.message };
        let values: Value = facts(status, stamp).into_iter().map(|(key, value)| message![key, value]).collect();
        let own = message![Value::U8(level), format!("{}: simulation", self.node), said, "flexcrank", values];
        let all: Value = [own].into_iter().collect();
        self.message("/diagnostics", RosType::DIAGNOSTIC_ARRAY, self.with_header(stamp, vec![all]))
    }
}

/// Name, position, velocity and effort of every joint.
///
/// The effort of the first link is the driving torque, that of a pin without a drive 0, and that of the slider the resistance
/// along x. Without loads of the same step there is none.
fn joint_states(angles: &Angles, slider: Option<&NodeState>, loads: Option<&Loads>) -> Vec<Value> {
    let links = &angles.links;
    let end = |of: fn(&NodeState) -> f64| slider.map(of);
    let names = links.iter().map(|link| link.link.as_str()).chain(slider.map(|_| "slider")).collect();
    let positions = links.iter().map(|link| link.chord_rad).chain(end(|node| node.x_m)).collect();
    let velocities = links.iter().map(|link| link.rate_rad_per_s).chain(end(|node| node.vx_m_per_s)).collect();
    let effort = |loads: &Loads| {
        let of_link = |index| if index == 0 { loads.driving_torque_nm } else { 0.0 };
        let of_slider = slider.map(|_| -loads.resistance_n.unwrap_or(0.0));
        (0..links.len()).map(of_link).chain(of_slider).collect()
    };
    vec![names, positions, velocities, loads.map_or(Value::List(Vec::new()), effort)]
}

/// Entries of a status in diagnostics.
fn facts(status: &Status, stamp: &Stamp) -> Vec<(&'static str, String)> {
    let some = |value: Option<f64>| value.map(|value| value.to_string());
    let all = [
        ("state", Some(status.state().as_str_name().to_owned())),
        ("step", Some(stamp.step.to_string())),
        ("sim_time_s", Some(stamp.sim_time_s.to_string())),
        ("epoch", Some(stamp.epoch.to_string())),
        ("real_time_factor", some(status.real_time_factor)),
        ("lateness_p99_s", some(status.lateness_p99_s)),
        ("lateness_max_s", some(status.lateness_max_s)),
        ("overruns", Some(status.overruns.to_string())),
        ("dropped_samples", Some(status.dropped_samples.to_string())),
        ("commands_accepted", Some(status.commands_accepted.to_string())),
        ("commands_rejected", Some(status.commands_rejected.to_string())),
        ("setpoint_nm", some(status.setpoint_nm)),
        ("setpoints_expired", Some(status.setpoints_expired.to_string())),
        ("energy_verdict", Some(status.energy_verdict().as_str_name().to_owned())),
        ("balance_error_j", some(status.balance_error_j)),
        ("recording", status.recording.clone()),
    ];
    all.into_iter().filter_map(|(key, value)| Some((key, value?))).collect()
}

/// A header with simulated time.
fn header(stamp: &Stamp, frame: &str) -> Value {
    message![time(stamp.sim_time_s), frame]
}

/// A time as seconds and nanoseconds, to the nearest nanosecond.
fn time(seconds: f64) -> Value {
    let nanoseconds = (seconds.max(0.0) * 1e9).round();
    // Beyond 2^31 s, or 68 years, the time stays at its largest.
    let nanoseconds = if nanoseconds.is_finite() { nanoseconds as u64 } else { 0 };
    let whole = i32::try_from(nanoseconds / 1_000_000_000).unwrap_or(i32::MAX);
    message![whole, u32::try_from(nanoseconds % 1_000_000_000).unwrap_or(0)]
}
