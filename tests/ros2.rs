//! ROS 2: bytes of messages, hostile bytes, exported files, and what a node takes from the bus.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use flexcrank::ros2::{CdrError, Count, Field, Kind, RosType, Value};

/// Number of random messages that are compared with those of `rosbags`.
const VECTORS: usize = 12_000;

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
            // What still fits the type is read; nothing panics.
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
