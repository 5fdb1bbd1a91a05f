//! Recordings as tables: one wide CSV a topic, decoded by the schemas that the file itself carries.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, MessageDescriptor, ReflectMessage, Value};

use super::reader::{Messages, Recorded, is_cut_off};
use super::{RecordingError, writer::Written};

/// Column name and text of every scalar in a message, in the order of its fields.
type Row = Vec<(String, String)>;

/// What an export found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// One table a topic.
    pub tables: Vec<Written>,
    /// Whether the recording ended early.
    pub cut_off: bool,
    /// Topics left out because their messages are not protobuf.
    pub skipped: Vec<String>,
}

/// Writes `FOLDER/<topic, with dots for slashes>.csv` for every protobuf topic of a recording.
///
/// The file is read twice: first for the columns, since a message may leave fields out, then for the rows.
///
/// # Errors
/// [`RecordingError`] when the recording cannot be read, a message does not fit its schema, or a table cannot be written.
pub fn export_csv(recording: &Path, folder: &Path) -> Result<Exported, RecordingError> {
    let mut decoder = Decoder { path: recording.to_owned(), types: HashMap::new(), skipped: Vec::new() };
    let mut columns: BTreeMap<String, Columns> = BTreeMap::new();
    let cut_off = decoder.each_row(|topic, row| {
        columns.entry(topic.to_owned()).or_default().learn(row);
        Ok(())
    })?;
    if columns.is_empty() {
        return Err(RecordingError::Empty { path: recording.to_owned() });
    }
    std::fs::create_dir_all(folder).map_err(RecordingError::file(folder))?;
    let mut tables = BTreeMap::new();
    for (topic, columns) in columns {
        tables.insert(topic.clone(), Table::create(folder, &topic, columns)?);
    }
    decoder.each_row(|topic, row| tables.get_mut(topic).map_or(Ok(()), |table| table.write(row)))?;
    let tables = tables.into_values().map(Table::finish).collect::<Result<_, _>>()?;
    Ok(Exported { tables, cut_off, skipped: decoder.skipped })
}

/// Column names in the order in which they were first seen.
#[derive(Default)]
struct Columns {
    names: Vec<String>,
    index: HashMap<String, usize>,
}

impl Columns {
    fn learn(&mut self, row: &Row) {
        for (name, _) in row {
            if !self.index.contains_key(name) {
                self.index.insert(name.clone(), self.names.len());
                self.names.push(name.clone());
            }
        }
    }
}

struct Table {
    path: PathBuf,
    columns: Columns,
    writer: csv::Writer<std::fs::File>,
    rows: u64,
}

impl Table {
    fn create(folder: &Path, topic: &str, columns: Columns) -> Result<Self, RecordingError> {
        let path = folder.join(format!("{}.csv", topic.replace('/', ".")));
        let mut writer = csv::Writer::from_path(&path).map_err(|error| RecordingError::file(&path)(error.into()))?;
        writer.write_record(&columns.names).map_err(|error| RecordingError::file(&path)(error.into()))?;
        Ok(Table { path, columns, writer, rows: 0 })
    }

    fn write(&mut self, row: &Row) -> Result<(), RecordingError> {
        let mut cells = vec![""; self.columns.names.len()];
        for (name, text) in row {
            if let Some(column) = self.columns.index.get(name) {
                cells[*column] = text;
            }
        }
        self.rows += 1;
        self.writer.write_record(cells).map_err(|error| RecordingError::file(&self.path)(error.into()))
    }

    fn finish(mut self) -> Result<Written, RecordingError> {
        self.writer.flush().map_err(RecordingError::file(&self.path))?;
        Ok(Written { path: self.path, messages: self.rows })
    }
}

struct Decoder {
    path: PathBuf,
    types: HashMap<String, Option<MessageDescriptor>>,
    skipped: Vec<String>,
}

impl Decoder {
    /// Calls `visit` for every message that can be decoded; returns whether the file ends early.
    fn each_row(&mut self, mut visit: impl FnMut(&str, &Row) -> Result<(), RecordingError>) -> Result<bool, RecordingError> {
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
