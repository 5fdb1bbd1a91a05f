//! ROS 2: bytes of messages, hostile bytes, exported files, and what a node takes from the bus.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use std::time::Duration;

use common::{Service, scene};
use flexcrank::bus::{Topic, client};
use flexcrank::recording::{Export, RecordingError, export};
use flexcrank::ros2::{Node, NodeOptions};
use flexcrank::runtime::Pace;
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{Angles, AppliedCommand, Displacements, Loads, applied_command::Command};
use prost::Message as _;
use zenoh::Wait;
use zenoh::handlers::FifoChannel;

use flexcrank::ros2::{CdrError, Count, Field, Kind, RosType, Value};

/// Number of random messages. `rosbags` has three quarters of the types.
const VECTORS: usize = 14_000;

/// Random numbers (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }

    /// A random message of a type.
    fn message(&mut self, of: RosType) -> Value {
        Value::Message(of.fields().iter().map(|field| self.field(field)).collect())
    }

    fn field(&mut self, Field { kind, count, .. }: &Field) -> Value {
        let length = match count {
            Count::One => return self.element(*kind),
            Count::Array(length) => *length,
            Count::AtMost(most) => self.below(most + 1),
            Count::Any => self.below(4),
        };
        Value::List((0..length).map(|_| self.element(*kind)).collect())
    }

    fn element(&mut self, kind: Kind) -> Value {
        match kind {
            Kind::Bool => Value::Bool(self.next() % 2 == 1),
            Kind::U8 { .. } => Value::U8(self.next() as u8),
            Kind::I32 => Value::I32(self.next() as i32),
            Kind::U32 => Value::U32(self.next() as u32),
            Kind::I64 => Value::I64(self.next() as i64),
            // A number that is not one may change its bits on its way through Python.
            Kind::F32 => Value::F32(Some(f32::from_bits(self.next() as u32)).filter(|x| !x.is_nan()).unwrap_or(-0.0)),
            Kind::F64 => Value::F64(Some(f64::from_bits(self.next())).filter(|x| !x.is_nan()).unwrap_or(-0.0)),
            Kind::Text => Value::Text((0..self.below(9)).map(|_| ["a", "_", "é", "機", " ", "\""][self.below(6)]).collect()),
            Kind::Nested(of) => self.message(of),
        }
    }
}

/// A joint state as `rosbags` 0.11.9 encodes it, so that writer and reader cannot err alike: numbers of eight bytes begin at multiples
/// of eight behind the header.
#[test]
fn val_a_joint_state_has_the_bytes_that_rosbags_gives_it() {
    let encoded = concat!(
        "00010000dbe0811fa1d3b4b7090000002222c3a961202261000000000100000005000000205f22610000000002000000",
        "00000000b4fe87dad65f1ea3c22a0786101f774f00000000030000004d20af5fa926946cf0571f0704ba1c5b45813b0200b1871a",
    );
    let bytes: Vec<u8> = (0..encoded.len()).step_by(2).map(|at| u8::from_str_radix(&encoded[at..at + 2], 16).unwrap()).collect();
    let text = |text: &str| Value::Text(text.to_owned());
    let numbers = |bits: &[u64]| Value::List(bits.iter().map(|bits| Value::F64(f64::from_bits(bits.swap_bytes()))).collect());
    let stamp = Value::Message(vec![Value::I32(0x1f81_e0db), Value::U32(0xb7b4_d3a1)]);
    let state = Value::Message(vec![
        Value::Message(vec![stamp, text("\"\"éa \"a")]),
        Value::List(vec![text(" _\"a")]),
        numbers(&[0xb4fe_87da_d65f_1ea3, 0xc22a_0786_101f_774f]),
        numbers(&[]),
        numbers(&[0x4d20_af5f_a926_946c, 0xf057_1f07_04ba_1c5b, 0x4581_3b02_00b1_871a]),
    ]);
    assert_eq!(RosType::JOINT_STATE.decode(&bytes).unwrap(), state);
    assert_eq!(RosType::JOINT_STATE.encode(&state).unwrap(), bytes);
}

/// A value as nested lists; numbers with a fraction as their bits.
fn json(value: &Value) -> serde_json::Value {
    match value {
        Value::Bool(value) => (*value).into(),
        Value::U8(value) => (*value).into(),
        Value::I32(value) => (*value).into(),
        Value::U32(value) => (*value).into(),
        Value::I64(value) => (*value).into(),
        Value::F32(value) => value.to_bits().into(),
        Value::F64(value) => value.to_bits().into(),
        Value::Text(text) => text.as_str().into(),
        Value::List(values) | Value::Message(values) => values.iter().map(json).collect(),
    }
}

/// Writes the vectors that the trial in Python compares with `rosbags`.
#[test]
fn prop_random_messages_are_read_as_written_and_vectors_are_made() -> Result<(), Box<dyn Error>> {
    let mut out = BufWriter::new(File::create(Path::new(env!("CARGO_TARGET_TMPDIR")).join("ros2-vectors.jsonl"))?);
    let types: Vec<RosType> = RosType::all().collect();
    for of in &types {
        writeln!(out, "{}", serde_json::json!({ "type": of.name(), "hash": of.hash() }))?;
    }
    let mut random = Random(18);
    for number in 0..VECTORS {
        let of = types[number % types.len()];
        let message = random.message(of);
        let bytes = of.encode(&message)?;
        assert_eq!(of.decode(&bytes), Ok(message.clone()), "{}", of.name());
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(out, "{}", serde_json::json!({ "type": of.name(), "value": json(&message), "cdr": hex }))?;
    }
    Ok(out.flush()?)
}

#[test]
fn prop_truncated_or_forged_bytes_are_refused_without_a_panic() -> Result<(), Box<dyn Error>> {
    let mut random = Random(7);
    for number in 0..400 {
        let of = RosType::all().nth(number % RosType::all().count()).ok_or("no type")?;
        let bytes = of.encode(&random.message(of))?;
        for length in 0..bytes.len() {
            assert!(of.decode(&bytes[..length]).is_err(), "{} of {length} bytes", of.name());
        }
        for _ in 0..50 {
            let mut forged = bytes.clone();
            let at = random.below(forged.len());
            forged[at] ^= 1 << random.below(8);
            // Bytes that still fit the type are read; nothing panics.
            let _ = of.decode(&forged);
            let _ = of.decode(&forged[4.min(at)..]);
        }
    }
    Ok(())
}

#[test]
fn prop_lengths_beyond_the_payload_are_refused_before_memory_is_taken() -> Result<(), Box<dyn Error>> {
    let header = [0, 1, 0, 0];
    let endless = [&header[..], &[0; 8], &1_u32.to_le_bytes(), &[0; 4], &u32::MAX.to_le_bytes()].concat();
    assert!(matches!(RosType::JOINT_STATE.decode(&endless), Err(CdrError::Length { field: "name", length: u32::MAX, .. })));
    let text = [&header[..], &[0; 8], &1_000_000_u32.to_le_bytes(), b"crank\0"].concat();
    assert!(matches!(RosType::JOINT_STATE.decode(&text), Err(CdrError::Length { field: "frame_id", .. })));
    let good = RosType::FLOAT64.encode(&Value::Message(vec![1.5.into()]))?;
    assert_eq!(RosType::FLOAT64.decode(&good), Ok(Value::Message(vec![1.5.into()])));
    assert_eq!(RosType::FLOAT64.decode(&[good.as_slice(), &[0; 4]].concat()), Err(CdrError::Rest(4)));
    assert_eq!(RosType::FLOAT64.decode(&[&[0, 0, 0, 0], &good[4..]].concat()), Err(CdrError::Header));
    let request = |byte: u8| RosType::SET_BOOL_REQUEST.decode(&[&header[..], &[byte]].concat());
    assert_eq!((request(1).is_ok(), request(2)), (true, Err(CdrError::Invalid("data"))));
    Ok(())
}

/// Fields of a message.
fn fields(value: Value) -> Vec<Value> {
    match value {
        Value::Message(values) | Value::List(values) => values,
        other => vec![other],
    }
}

/// The numbers of a list.
fn bits(value: &Value) -> Vec<u64> {
    let bits = |value: &Value| if let Value::F64(number) = value { number.to_bits() } else { 0 };
    if let Value::List(values) = value { values.iter().map(bits).collect() } else { Vec::new() }
}

/// Keys of the node `test` in domain 3, whatever type and hash they end with.
fn key(topic: &str) -> String {
    format!("3/test/{topic}/**")
}

#[test]
fn val_a_node_publishes_what_the_service_publishes_and_passes_on_torques() -> Result<(), Box<dyn Error>> {
    let service = Service::start(scene(&["pulse=[]"])?, Pace::Factor(1.0), None, PublishRate::Hz(100.0))?;
    let session = service.client.clone();
    let states = session.declare_subscriber(key("joint_states")).with(FifoChannel::new(4096)).wait().unwrap();
    let angles = client::subscribe(&session, &service.name, Topic::Angles)?;
    let applied = session.declare_subscriber(service.name.topic(Topic::Commands)).with(FifoChannel::new(64)).wait().unwrap();
    let node = Node::start(&session, &service.name, NodeOptions { domain: 3, number: 0, takes_torque: true })?;

    let torque = format!("3/test/torque/{}/{}", RosType::FLOAT64.dds_name(), RosType::FLOAT64.hash());
    let good = RosType::FLOAT64.encode(&Value::Message(vec![7.5.into()]))?;
    for length in 0..good.len() {
        session.put(&torque, &good[..length]).wait().unwrap();
    }
    // A key with wildcards includes the topic's, and is not it.
    session.put(key("torque"), good.clone()).wait().unwrap();
    session.put(&torque, good).wait().unwrap();
    let command = applied.recv_timeout(Duration::from_secs(20)).unwrap().ok_or("no command was applied")?;
    let Some(Command::Setpoint(setpoint)) = AppliedCommand::decode(&*command.payload().to_bytes())?.command else {
        return Err("another command was applied".into());
    };
    assert_eq!((setpoint.torque_nm, setpoint.hold_s), (7.5, flexcrank::ros2::TORQUE_HOLD_S));

    let mut received = Vec::new();
    while received.len() < 50 {
        let sample = states.recv_timeout(Duration::from_secs(20)).unwrap().ok_or("no joint state came")?;
        assert_eq!(sample.attachment().map(|bytes| bytes.len()), Some(33));
        received.push(fields(RosType::JOINT_STATE.decode(&sample.payload().to_bytes())?));
    }
    assert_eq!(node.close()?, 0, "nothing is dropped");
    let sent: Vec<Angles> = client::new_messages(&angles).collect();
    let sent: Vec<Vec<u64>> =
        sent.iter().map(|angles| angles.links.iter().map(|link| link.chord_rad.to_bits()).collect()).collect();
    let own: Vec<Vec<u64>> = received.iter().map(|joints| bits(&joints[2])[..2].to_vec()).collect();
    let from = sent.iter().position(|angles| *angles == own[0]).ok_or("the first joint state is not a message of angles")?;
    assert_eq!(sent[from..from + own.len()], own);
    assert!(applied.try_recv().unwrap().is_none(), "hostile bytes became a command");
    service.stop()?;
    Ok(())
}

#[test]
fn val_an_exported_file_has_every_sample_once() -> Result<(), Box<dyn Error>> {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(1.0), PublishRate::Hz(100.0))?.finish()?;
    let (recording, bag) = (folder.path().join("run.mcap"), folder.path().join("bag.mcap"));
    let what = Export { ros2: Some(bag.clone()), ..Export::default() };
    let written = export(&recording, &what, &|_| {})?.ros2.ok_or("no file")?;
    assert!(matches!(export(&recording, &what, &|_| {}), Err(RecordingError::Exists(_))), "nothing is overwritten");
    let states: Vec<Vec<Value>> = common::payloads(&bag, "joint_states")?
        .iter()
        .map(|bytes| RosType::JOINT_STATE.decode(bytes).map(fields))
        .collect::<Result<_, _>>()?;
    let angles: Vec<Angles> = common::decoded(&recording, "angles")?;
    let ends: Vec<Displacements> = common::decoded(&recording, "displacements")?;
    let loads: Vec<Loads> = common::decoded(&recording, "loads")?;
    assert_eq!((states.len(), angles.len()), (101, 101));
    for ((joints, angles), (end, loads)) in states.iter().zip(&angles).zip(ends.iter().zip(&loads)) {
        let end = end.nodes.last().ok_or("no nodes")?;
        let resistance = -loads.resistance_n.ok_or("no slider")?;
        let wanted = |of: &[f64]| of.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
        let [crank, rod] = &angles.links[..] else { return Err("not two links".into()) };
        assert_eq!(bits(&joints[2]), wanted(&[crank.chord_rad, rod.chord_rad, end.x_m]));
        assert_eq!(bits(&joints[3]), wanted(&[crank.rate_rad_per_s, rod.rate_rad_per_s, end.vx_m_per_s]));
        assert_eq!(bits(&joints[4]), wanted(&[loads.driving_torque_nm, 0.0, resistance]));
    }
    // Clock, joint states, frames and three joints for every sample; markers and diagnostics besides.
    let others = (common::payloads(&bag, "markers")?.len() + common::payloads(&bag, "diagnostics")?.len()) as u64;
    assert_eq!(written.messages, 6 * 101 + others);
    Ok(())
}

#[test]
fn prop_a_recording_without_a_service_leaves_no_file() -> Result<(), Box<dyn Error>> {
    let (_, folder) = Service::start(scene(&[])?, Pace::Max, Some(0.1), PublishRate::Hz(100.0))?.finish()?;
    let (recording, bag) = (folder.path().join("run.mcap"), folder.path().join("bag.mcap"));
    let what = |to: &Path| Export { ros2: Some(to.to_owned()), ..Export::default() };
    export(&recording, &what(&bag), &|_| {})?;
    let again = folder.path().join("again.mcap");
    assert!(matches!(export(&bag, &what(&again), &|_| {}), Err(RecordingError::NothingForRos(_))));
    assert!(!again.exists());
    Ok(())
}
