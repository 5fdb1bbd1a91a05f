//! Decodes the messages of a recording to rows of named cells, by the schemas in the file.

use std::collections::{BTreeSet, HashMap};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use indexmap::IndexMap;
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

/// Column name and value of every scalar of a message, after the times, in the order of its fields. The names are kept from message
/// to message, since most messages of a topic have the same.
#[derive(Debug, Default)]
pub(super) struct Row {
    names: Vec<String>,
    values: Vec<FieldValue>,
    /// Name of the column under way.
    path: String,
}

impl Row {
    pub fn cells(&self) -> impl Iterator<Item = (&str, &FieldValue)> {
        self.names.iter().map(String::as_str).zip(&self.values)
    }

    /// Sets the value of the column under way.
    fn put(&mut self, value: FieldValue) {
        match self.names.get_mut(self.values.len()) {
            Some(name) if *name == self.path => {}
            Some(name) => name.clone_from(&self.path),
            None => self.names.push(self.path.clone()),
        }
        self.values.push(value);
    }

    /// Calls `put` with a part of a name behind the present one.
    fn below(&mut self, part: impl std::fmt::Display, put: impl FnOnce(&mut Self)) {
        let length = self.path.len();
        let dot = if length == 0 { "" } else { "." };
        // Writing to a string does not fail.
        let _ = write!(self.path, "{dot}{part}");
        put(self);
        self.path.truncate(length);
    }
}

/// Place of a column, which in most rows is the one that it has in the row.
pub(super) fn place_of<T>(columns: &IndexMap<String, T>, in_row: usize, name: &str) -> Option<usize> {
    let is_there = columns.get_index(in_row).is_some_and(|(known, _)| known == name);
    if is_there { Some(in_row) } else { columns.get_index_of(name) }
}

/// Names of the first columns.
pub(super) const TIMES: [&str; 2] = ["log_time", "publish_time"];

/// Whether a column belongs to the stamp or the times of a message, not to its data.
pub(crate) fn is_stamp_or_time(name: &str) -> bool {
    TIMES.contains(&name) || name.starts_with("stamp.")
}

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

    /// Calls `visit` for every message of this part of a recording, in order of log time, and `progress` with the part of it that is
    /// done; returns whether the file ends early.
    pub fn each_message(
        self,
        path: &Path,
        progress: &dyn Fn(f64),
        mut visit: impl FnMut(&RecordedMessage) -> Result<(), RecordingError>,
    ) -> Result<bool, RecordingError> {
        let source = RecordingFile::open(path)?;
        let mut slots: HashMap<String, u64> = HashMap::new();
        let all_ns = self.to_ns.min(source.end_ns() - source.begin_ns()).saturating_sub(self.from_ns).max(1);
        for message in source.messages_from(source.begin_ns().saturating_add(self.from_ns))? {
            let message = message?;
            let since_ns = message.log_time.saturating_sub(source.begin_ns());
            progress((since_ns.saturating_sub(self.from_ns) as f64 / all_ns as f64).min(1.0));
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
    /// The last row of each topic.
    rows: HashMap<String, Row>,
    /// Topics skipped because their messages are not protobuf.
    pub skipped: BTreeSet<String>,
}

impl Decoder {
    /// Decodes a part of the recording at `path`.
    pub fn new(path: &Path, part: TimeRange) -> Self {
        Decoder { path: path.to_owned(), part, types: HashMap::new(), rows: HashMap::new(), skipped: BTreeSet::new() }
    }

    /// The error of a recording without rows.
    pub fn no_rows(self) -> RecordingError {
        match self.skipped.is_empty() {
            true => RecordingError::empty(&self.path),
            false => RecordingError::Foreign { path: self.path, topics: self.skipped.into_iter().collect() },
        }
    }

    /// Whether messages that were decoded are of a type that has the field of a column, present or not.
    pub fn has_field(&self, column: &str) -> bool {
        self.types.values().flatten().any(|descriptor| has_field(descriptor, column))
    }

    /// Calls `visit` for every decodable message, in order of log time, and `progress` with the part that is done; returns whether
    /// the file ends early.
    pub fn each_row(
        &mut self,
        progress: &dyn Fn(f64),
        mut visit: impl FnMut(&str, &Row) -> Result<(), RecordingError>,
    ) -> Result<bool, RecordingError> {
        let (path, part) = (self.path.clone(), self.part);
        part.each_message(&path, progress, |message| match self.row(message)? {
            Some(row) => visit(&message.channel.topic, row),
            None => Ok(()),
        })
    }

    fn row(&mut self, message: &RecordedMessage) -> Result<Option<&Row>, RecordingError> {
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
        if !self.rows.contains_key(topic) {
            self.rows.insert(topic.clone(), Row::default());
        }
        let Some(row) = self.rows.get_mut(topic) else { return Ok(None) };
        row.values.clear();
        for (name, nanoseconds) in TIMES.into_iter().zip([message.log_time, message.publish_time]) {
            let time = FieldValue::Time(i64::try_from(nanoseconds).unwrap_or(i64::MAX));
            row.below(name, |row| row.put(time));
        }
        flatten(&decoded, row);
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

/// Whether messages of a type have the field of a column, present or not. Behind a list, the name of an entry is passed over.
fn has_field(descriptor: &MessageDescriptor, column: &str) -> bool {
    let (name, rest) = match column.split_once('.') {
        Some((name, rest)) => (name, Some(rest)),
        None => (column, None),
    };
    let Some(field) = descriptor.get_field_by_name(name) else {
        return rest.is_none() && descriptor.oneofs().any(|oneof| !oneof.is_synthetic() && oneof.name() == name);
    };
    let Some(rest) = rest else { return true };
    let kind = field.kind();
    let Some(inner) = kind.as_message() else { return false };
    let mut ends = std::iter::successors(Some(rest), |rest| rest.split_once('.').map(|(_, rest)| rest));
    ends.any(|end| has_field(inner, end))
}

/// Scalars of a message under dotted names. List entries are named by their label (`link`, `joint`, `index`), or else by
/// position. A oneof has the name of the member that is set: one that is an empty message has no scalar.
fn flatten(message: &DynamicMessage, row: &mut Row) {
    for field in message.descriptor().fields() {
        if (field.supports_presence() && !message.has_field(&field)) || is_label(&field) && !row.path.is_empty() {
            continue;
        }
        // An `optional` field is alone in a oneof that no file names.
        if let Some(oneof) = field.containing_oneof().filter(|oneof| !oneof.is_synthetic()) {
            row.below(oneof.name(), |row| row.put(FieldValue::Text(field.name().to_owned())));
        }
        row.below(field.name(), |row| match message.get_field(&field).as_ref() {
            Value::List(values) => {
                for (place, value) in values.iter().enumerate() {
                    row.below(EntryName { value, place }, |row| put(&field, value, row));
                }
            }
            value => put(&field, value, row),
        });
    }
}

const LABELS: [&str; 3] = ["link", "joint", "index"];

fn is_label(field: &FieldDescriptor) -> bool {
    LABELS.contains(&field.name())
}

/// Name of an entry of a list: its labels, or else its place.
struct EntryName<'a> {
    value: &'a Value,
    place: usize,
}

impl std::fmt::Display for EntryName<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut labels = 0;
        if let Some(message) = self.value.as_message() {
            let descriptor = message.descriptor();
            for field in LABELS.iter().filter_map(|name| descriptor.get_field_by_name(name)) {
                let dot = if labels == 0 { "" } else { "." };
                write!(f, "{dot}{}", cell(&field, &message.get_field(&field)))?;
                labels += 1;
            }
        }
        if labels == 0 { write!(f, "{}", self.place) } else { Ok(()) }
    }
}

fn put(field: &FieldDescriptor, value: &Value, row: &mut Row) {
    match value {
        Value::Message(message) if message.descriptor().full_name() == "google.protobuf.Timestamp" => {
            let part =
                |part: &str| message.get_field_by_name(part).and_then(|value| value.as_i64().or(value.as_i32().map(i64::from)));
            let (seconds, nanos) = (part("seconds").unwrap_or(0), part("nanos").unwrap_or(0));
            row.put(FieldValue::Time(seconds.saturating_mul(1_000_000_000).saturating_add(nanos)));
        }
        Value::Message(message) => flatten(message, row),
        value => row.put(cell(field, value)),
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

/// The types of flexcrank's own messages.
static OWN_TYPES: LazyLock<Option<DescriptorPool>> = LazyLock::new(|| DescriptorPool::decode(crate::wire::DESCRIPTOR_SET).ok());

/// Name and text of every scalar in one of flexcrank's own messages; `None` if it does not fit the named schema.
pub fn scalars(schema: &str, payload: &[u8]) -> Option<Vec<(String, String)>> {
    let message = DynamicMessage::decode(OWN_TYPES.as_ref()?.get_message_by_name(schema)?, payload).ok()?;
    let mut row = Row::default();
    flatten(&message, &mut row);
    Some(row.cells().map(|(name, cell)| (name.to_owned(), cell.to_string())).collect())
}

#[cfg(test)]
mod tests {
    use prost::Message as _;

    use super::*;
    use crate::wire::control::Action;
    use crate::wire::{AppliedCommand, Control, Pause, Reset, Resume, Steps, Stop, TorquePulse, applied_command::Command};

    /// Commands without content had no column: `pause`, `resume`, `reset` and `stop` were the same row.
    #[test]
    fn regress_the_member_of_a_oneof_that_is_set_is_a_column() {
        let columns = |command: Command| {
            let applied = AppliedCommand { command: Some(command), ..AppliedCommand::default() };
            let mut columns = scalars("flexcrank.v1.AppliedCommand", &applied.encode_to_vec()).unwrap();
            columns.retain(|(name, _)| ["command", "control.action", "control.step.count"].contains(&name.as_str()));
            columns
        };
        let column = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        for (action, name) in [
            (Action::Pause(Pause {}), "pause"),
            (Action::Resume(Resume {}), "resume"),
            (Action::Reset(Reset {}), "reset"),
            (Action::Stop(Stop {}), "stop"),
        ] {
            let control = Command::Control(Control { action: Some(action), ..Control::default() });
            assert_eq!(columns(control), [column("command", "control"), column("control.action", name)]);
        }
        let control = Command::Control(Control { action: Some(Action::Step(Steps { count: 3 })), ..Control::default() });
        let step = [column("command", "control"), column("control.action", "step"), column("control.step.count", "3")];
        assert_eq!(columns(control), step);
        assert_eq!(columns(Command::Torque(TorquePulse::default())), [column("command", "torque")]);
        let descriptor = OWN_TYPES.as_ref().unwrap().get_message_by_name("flexcrank.v1.AppliedCommand").unwrap();
        let has = ["command", "control.action", "control.pause", "control.act"].map(|name| has_field(&descriptor, name));
        assert_eq!(has, [true, true, true, false]);
    }

    /// A field that is `optional` is alone in a oneof that the compiler makes.
    #[test]
    fn prop_an_optional_field_adds_no_column_but_its_own() {
        let energies = crate::wire::Energies { kinetic_j: Some(0.5), ..Default::default() };
        let columns = scalars("flexcrank.v1.Energies", &energies.encode_to_vec()).unwrap();
        assert_eq!(columns, [("kinetic_j".to_owned(), "0.5".to_owned())]);
    }
}
