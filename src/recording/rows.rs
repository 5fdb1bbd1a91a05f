//! Messages of a recording as rows of named cells, decoded by the schemas that the file itself carries.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, MessageDescriptor, ReflectMessage, Value};

use super::RecordingError;
use super::reader::{Messages, Recorded, is_cut_off};

/// Column name and text of every scalar in a message, in the order of its fields.
pub(super) type Row = Vec<(String, String)>;

/// Turns the messages of a recording into rows.
pub(super) struct Decoder {
    path: PathBuf,
    types: HashMap<String, Option<MessageDescriptor>>,
    /// Topics whose messages are not protobuf.
    pub skipped: Vec<String>,
}

impl Decoder {
    /// For the recording at `path`.
    pub fn new(path: &Path) -> Self {
        Decoder { path: path.to_owned(), types: HashMap::new(), skipped: Vec::new() }
    }

    /// Calls `visit` for every message that can be decoded; returns whether the file ends early.
    pub fn each_row(&mut self, mut visit: impl FnMut(&str, &Row) -> Result<(), RecordingError>) -> Result<bool, RecordingError> {
        for message in Messages::open(&self.path)? {
            let message = match message {
                Err(error) if is_cut_off(&error) => return Ok(true),
                message => message?,
            };
            if let Some(row) = self.row(&message)? {
                visit(&message.channel.topic, &row)?;
            }
        }
        Ok(false)
    }

    fn row(&mut self, message: &Recorded) -> Result<Option<Row>, RecordingError> {
        let topic = &message.channel.topic;
        if !self.types.contains_key(topic) {
            let found = descriptor(message);
            if found.is_none() {
                self.skipped.push(topic.clone());
            }
            self.types.insert(topic.clone(), found);
        }
        let Some(Some(descriptor)) = self.types.get(topic) else { return Ok(None) };
        let decoded = DynamicMessage::decode(descriptor.clone(), message.data.as_ref()).map_err(|error| {
            RecordingError::Undecodable { path: self.path.clone(), topic: topic.clone(), cause: error.to_string() }
        })?;
        let mut row = vec![
            ("log_time_ns".to_owned(), message.log_time.to_string()),
            ("publish_time_ns".to_owned(), message.publish_time.to_string()),
        ];
        flatten("", &decoded, &mut row);
        Ok(Some(row))
    }
}

/// The type of a message, from the schema in the file; `None` when it is not protobuf.
fn descriptor(message: &Recorded) -> Option<MessageDescriptor> {
    let schema = message.channel.schema.as_ref().filter(|schema| schema.encoding == "protobuf")?;
    let pool = DescriptorPool::decode(schema.data.as_ref()).ok()?;
    pool.get_message_by_name(&schema.name)
}

/// Scalars of a message under dotted names. Entries of a list are named by what identifies them (`link`, `joint`, `index`),
/// or else by their place; a timestamp becomes seconds since 1970.
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
        .map(|field| text(&field, &message.get_field(&field)))
        .collect();
    (!parts.is_empty()).then(|| parts.join("."))
}

fn put(name: &str, field: &FieldDescriptor, value: &Value, row: &mut Row) {
    match value {
        Value::Message(message) if message.descriptor().full_name() == "google.protobuf.Timestamp" => {
            let part =
                |part: &str| message.get_field_by_name(part).and_then(|value| value.as_i64().or(value.as_i32().map(i64::from)));
            row.push((name.to_owned(), format!("{}.{:09}", part("seconds").unwrap_or(0), part("nanos").unwrap_or(0))));
        }
        Value::Message(message) => flatten(name, message, row),
        value => row.push((name.to_owned(), text(field, value))),
    }
}

fn text(field: &FieldDescriptor, value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Bool(value) => value.to_string(),
        Value::I32(value) => value.to_string(),
        Value::I64(value) => value.to_string(),
        Value::U32(value) => value.to_string(),
        Value::U64(value) => value.to_string(),
        Value::F32(value) => value.to_string(),
        Value::F64(value) => value.to_string(),
        Value::EnumNumber(number) => {
            let kind = field.kind();
            let name = kind.as_enum().and_then(|kind| kind.get_value(*number)).map(|value| value.name().to_owned());
            name.unwrap_or_else(|| number.to_string())
        }
        Value::Bytes(bytes) => format!("{} bytes", bytes.len()),
        Value::Message(_) | Value::List(_) | Value::Map(_) => String::new(),
    }
}

/// Name and text of every scalar in one of our own messages; `None` when it does not fit the schema of that name.
pub fn scalars(schema: &str, payload: &[u8]) -> Option<Vec<(String, String)>> {
    let pool = DescriptorPool::decode(crate::wire::DESCRIPTOR_SET).ok()?;
    let message = DynamicMessage::decode(pool.get_message_by_name(schema)?, payload).ok()?;
    let mut row = Row::new();
    flatten("", &message, &mut row);
    Some(row)
}
