//! Decodes the messages of a recording to rows of named cells, by the schemas in the file.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, MessageDescriptor, ReflectMessage, Value};
use prost_types::FileDescriptorSet;

use super::RecordingError;
use super::format::RecordedMessage;
use super::recording_file::RecordingFile;

/// A scalar of a message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum FieldValue {
    Integer(i64),
    Number(f64),
    Flag(bool),
    Text(String),
    /// Nanoseconds since 1970.
    Time(i64),
}

impl FieldValue {
    /// The value as a number; a time in seconds since 1970; NaN for anything else.
    pub fn number(&self) -> f64 {
        match self {
            FieldValue::Integer(value) => *value as f64,
            FieldValue::Number(value) => *value,
            FieldValue::Time(nanoseconds) => *nanoseconds as f64 * 1e-9,
            FieldValue::Flag(_) | FieldValue::Text(_) => f64::NAN,
        }
    }
}

impl std::fmt::Display for FieldValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            FieldValue::Integer(value) => write!(f, "{value}"),
            FieldValue::Number(value) => write!(f, "{value}"),
            FieldValue::Flag(value) => write!(f, "{value}"),
            FieldValue::Text(text) => f.write_str(text),
            // ISO 8601, always with nanoseconds, so that readers see one format.
            FieldValue::Time(nanoseconds) => {
                let seconds = prost_types::Timestamp { seconds: nanoseconds.div_euclid(1_000_000_000), nanos: 0 }.to_string();
                write!(f, "{}.{:09}Z", seconds.trim_end_matches('Z'), nanoseconds.rem_euclid(1_000_000_000))
            }
        }
    }
}

/// Column name and value of every scalar of a message, after the times, in the order of its fields.
pub(super) type Row = Vec<(String, FieldValue)>;

/// Names of the first columns.
pub(super) const TIMES: [&str; 2] = ["log_time", "publish_time"];

/// A time range of a recording, relative to its first message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimeRange {
    from_ns: u64,
    to_ns: u64,
    every_ns: Option<u64>,
}

impl TimeRange {
    /// The whole recording.
    pub const WHOLE: TimeRange = TimeRange { from_ns: 0, to_ns: u64::MAX, every_ns: None };

    /// From one time to another, with one row per period `every_s`; s.
    pub fn new(from_s: f64, to_s: Option<f64>, every_s: Option<f64>) -> Self {
        let nanoseconds = |seconds: f64| (seconds * 1e9).round() as u64;
        let every_ns = every_s.map(|every_s| nanoseconds(every_s).max(1));
        TimeRange { from_ns: nanoseconds(from_s), to_ns: to_s.map_or(u64::MAX, nanoseconds), every_ns }
    }

    /// Calls `visit` for every message of this part of a recording, in order of log time; returns whether the file ends early.
    pub fn each_message(
        self,
        path: &Path,
        mut visit: impl FnMut(&RecordedMessage) -> Result<(), RecordingError>,
    ) -> Result<bool, RecordingError> {
        let source = RecordingFile::open(path)?;
        let mut slots: HashMap<String, u64> = HashMap::new();
        for message in source.messages_from(source.begin_ns().saturating_add(self.from_ns))? {
            let message = message?;
            let since_ns = message.log_time.saturating_sub(source.begin_ns());
            if since_ns > self.to_ns {
                continue;
            }
            if let Some(slot) = self.slot(since_ns)
                && slots.insert(message.channel.topic.clone(), slot) == Some(slot)
            {
                continue;
            }
            visit(&message)?;
        }
        Ok(source.is_cut_off())
    }

    /// Index of the period that a time belongs to; `None` without periods. A time just before the next period counts to that: log
    /// times are rounded.
    fn slot(&self, since_ns: u64) -> Option<u64> {
        self.every_ns.map(|every_ns| (since_ns - self.from_ns + every_ns / 1000) / every_ns)
    }
}

/// Decodes the messages of a recording to rows.
pub(super) struct Decoder {
    path: PathBuf,
    part: TimeRange,
    /// Message types by the id of their schema.
    types: HashMap<Option<u16>, Option<MessageDescriptor>>,
    /// Topics skipped because their messages are not protobuf.
    pub skipped: BTreeSet<String>,
}

impl Decoder {
    /// Decodes a part of the recording at `path`.
    pub fn new(path: &Path, part: TimeRange) -> Self {
        Decoder { path: path.to_owned(), part, types: HashMap::new(), skipped: BTreeSet::new() }
    }

    /// The error of a recording without rows.
    pub fn no_rows(self) -> RecordingError {
        match self.skipped.is_empty() {
            true => RecordingError::empty(&self.path),
            false => RecordingError::Foreign { path: self.path, topics: self.skipped.into_iter().collect() },
        }
    }

    /// Calls `visit` for every decodable message, in order of log time; returns whether the file ends early.
    pub fn each_row(&mut self, mut visit: impl FnMut(&str, &Row) -> Result<(), RecordingError>) -> Result<bool, RecordingError> {
        let (path, part) = (self.path.clone(), self.part);
        part.each_message(&path, |message| match self.row(message)? {
            Some(row) => visit(&message.channel.topic, &row),
            None => Ok(()),
        })
    }

    fn row(&mut self, message: &RecordedMessage) -> Result<Option<Row>, RecordingError> {
        let topic = &message.channel.topic;
        let schema = message.channel.schema.as_ref().map(|schema| schema.id);
        let Some(descriptor) = self.types.entry(schema).or_insert_with(|| descriptor(message)) else {
            if !self.skipped.contains(topic) {
                self.skipped.insert(topic.clone());
            }
            return Ok(None);
        };
        let decoded = DynamicMessage::decode(descriptor.clone(), message.data.as_ref()).map_err(|error| {
            RecordingError::Undecodable { path: self.path.clone(), topic: topic.clone(), cause: error.to_string() }
        })?;
        let time = |nanoseconds: u64| FieldValue::Time(i64::try_from(nanoseconds).unwrap_or(i64::MAX));
        let [log_time, publish_time] = TIMES.map(str::to_owned);
        let mut row = vec![(log_time, time(message.log_time)), (publish_time, time(message.publish_time))];
        flatten("", &decoded, &mut row);
        Ok(Some(row))
    }
}

/// The type of a message, by the schema in the file; `None` if it is not protobuf, or of an unknown syntax.
fn descriptor(message: &RecordedMessage) -> Option<MessageDescriptor> {
    let schema = message.channel.schema.as_ref().filter(|schema| schema.encoding == "protobuf")?;
    let FileDescriptorSet { file: files } = prost::Message::decode(schema.data.as_ref()).ok()?;
    // The library panics at any other syntax.
    if !files.iter().all(|file| matches!(file.syntax.as_deref(), None | Some("proto2" | "proto3"))) {
        return None;
    }
    let pool = DescriptorPool::decode(schema.data.as_ref()).ok()?;
    pool.get_message_by_name(&schema.name)
}

/// Scalars of a message under dotted names. List entries are named by their label (`link`, `joint`, `index`), or else by
/// position.
fn flatten(prefix: &str, message: &DynamicMessage, row: &mut Row) {
    for field in message.descriptor().fields() {
        if (field.supports_presence() && !message.has_field(&field)) || is_label(&field) && !prefix.is_empty() {
            continue;
        }
        let name = if prefix.is_empty() { field.name().to_owned() } else { format!("{prefix}.{}", field.name()) };
        match message.get_field(&field).as_ref() {
            Value::List(values) => {
                for (place, value) in values.iter().enumerate() {
                    let entry = value.as_message().and_then(label).unwrap_or_else(|| place.to_string());
                    put(&format!("{name}.{entry}"), &field, value, row);
                }
            }
            value => put(&name, &field, value, row),
        }
    }
}

const LABELS: [&str; 3] = ["link", "joint", "index"];

fn is_label(field: &FieldDescriptor) -> bool {
    LABELS.contains(&field.name())
}

fn label(message: &DynamicMessage) -> Option<String> {
    let parts: Vec<String> = LABELS
        .iter()
        .filter_map(|name| message.descriptor().get_field_by_name(name))
        .map(|field| cell(&field, &message.get_field(&field)).to_string())
        .collect();
    (!parts.is_empty()).then(|| parts.join("."))
}

fn put(name: &str, field: &FieldDescriptor, value: &Value, row: &mut Row) {
    match value {
        Value::Message(message) if message.descriptor().full_name() == "google.protobuf.Timestamp" => {
            let part =
                |part: &str| message.get_field_by_name(part).and_then(|value| value.as_i64().or(value.as_i32().map(i64::from)));
            let (seconds, nanos) = (part("seconds").unwrap_or(0), part("nanos").unwrap_or(0));
            row.push((name.to_owned(), FieldValue::Time(seconds.saturating_mul(1_000_000_000).saturating_add(nanos))));
        }
        Value::Message(message) => flatten(name, message, row),
        value => row.push((name.to_owned(), cell(field, value))),
    }
}

fn cell(field: &FieldDescriptor, value: &Value) -> FieldValue {
    match value {
        Value::String(text) => FieldValue::Text(text.clone()),
        Value::Bool(value) => FieldValue::Flag(*value),
        Value::I32(value) => FieldValue::Integer((*value).into()),
        Value::I64(value) => FieldValue::Integer(*value),
        Value::U32(value) => FieldValue::Integer((*value).into()),
        // Values beyond the range of a signed integer become numbers.
        Value::U64(value) => i64::try_from(*value).map_or(FieldValue::Number(*value as f64), FieldValue::Integer),
        Value::F32(value) => FieldValue::Number((*value).into()),
        Value::F64(value) => FieldValue::Number(*value),
        Value::EnumNumber(number) => {
            let kind = field.kind();
            let name = kind.as_enum().and_then(|kind| kind.get_value(*number)).map(|value| value.name().to_owned());
            FieldValue::Text(name.unwrap_or_else(|| number.to_string()))
        }
        Value::Bytes(bytes) => FieldValue::Text(format!("{} bytes", bytes.len())),
        Value::Message(_) | Value::List(_) | Value::Map(_) => FieldValue::Text(String::new()),
    }
}

/// Name and text of every scalar in one of flexcrank's own messages; `None` if it does not fit the named schema.
pub fn scalars(schema: &str, payload: &[u8]) -> Option<Vec<(String, String)>> {
    let pool = DescriptorPool::decode(crate::wire::DESCRIPTOR_SET).ok()?;
    let message = DynamicMessage::decode(pool.get_message_by_name(schema)?, payload).ok()?;
    let mut row = Row::new();
    flatten("", &message, &mut row);
    Some(row.into_iter().map(|(name, cell)| (name, cell.to_string())).collect())
}
