//! Recordings written anew with a change, all sums right.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use flexcrank::recording::{RecordedMessage, WalkFlow, WalkItem, walk};

/// Name of the metadata record that states the end.
const END: &str = "flexcrank-end";

/// Replaces a message: by itself, nothing, or another one.
pub type Rewrite<'a> = &'a dyn Fn(u64, &RecordedMessage) -> Option<Vec<u8>>;

/// Everything that a recording holds, in order, to be changed and written again.
#[derive(Clone, PartialEq)]
pub struct Contents {
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
    pub scene: String,
    pub messages: Vec<Entry>,
    pub end: Option<BTreeMap<String, String>>,
}

/// A message with everything that its channel says of it.
#[derive(Clone, PartialEq)]
pub struct Entry {
    pub topic: String,
    pub encoding: String,
    pub schema: String,
    pub schema_data: Vec<u8>,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
    pub data: Vec<u8>,
}

impl Entry {
    fn of(message: &RecordedMessage, data: Vec<u8>) -> Entry {
        let channel = &message.channel;
        let (schema, schema_data) =
            channel.schema.as_ref().map(|schema| (schema.name.clone(), schema.data.to_vec())).unwrap_or_default();
        Entry {
            topic: channel.topic.clone(),
            encoding: channel.message_encoding.clone(),
            schema,
            schema_data,
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
            data,
        }
    }

    /// Last chunk of the topic.
    pub fn chunk(&self) -> &str {
        self.topic.rsplit('/').next().unwrap_or_default()
    }
}

impl Contents {
    /// Reads a recording, each message replaced by `rewrite`.
    pub fn read(file: &Path, rewrite: Rewrite) -> Result<Contents, Box<dyn std::error::Error>> {
        let mut all = Contents { metadata: Vec::new(), scene: String::new(), messages: Vec::new(), end: None };
        let mut number = 0;
        walk(file, |found, _| {
            match found {
                WalkItem::Metadata(END, entries) => all.end = Some(entries.clone()),
                WalkItem::Metadata(name, entries) => all.metadata.push((name.to_owned(), entries.clone())),
                WalkItem::Attachment(_, data) => all.scene = String::from_utf8_lossy(data).into_owned(),
                WalkItem::Message(message) => {
                    number += 1;
                    all.messages.extend(rewrite(number, message).map(|data| Entry::of(message, data)));
                }
                WalkItem::Damage(_) => {}
            }
            WalkFlow::Continue(())
        })?;
        Ok(all)
    }

    /// Makes the stated end fit the messages.
    pub fn recount(&mut self) {
        let Some(end) = &mut self.end else { return };
        end.retain(|key, _| key == "reason");
        let mut counts = BTreeMap::<&str, u64>::new();
        for message in &self.messages {
            *counts.entry(&message.topic).or_default() += 1;
        }
        end.extend(counts.into_iter().map(|(topic, count)| (topic.to_owned(), count.to_string())));
    }

    /// Writes a whole file.
    pub fn write(&self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        let mut writer = mcap::WriteOptions::new().create(BufWriter::new(File::create(path)?))?;
        for (name, metadata) in &self.metadata {
            writer.write_metadata(&mcap::records::Metadata { name: name.clone(), metadata: metadata.clone() })?;
        }
        let (name, media_type) = ("scene.toml".to_owned(), "application/toml".to_owned());
        let data = self.scene.as_bytes().into();
        writer.attach(&mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data })?;
        let mut channels = HashMap::new();
        for Entry { topic, encoding, schema, schema_data, sequence, log_time, publish_time, data } in &self.messages {
            let key = (topic, encoding, schema);
            let channel_id = match channels.get(&key) {
                Some(id) => *id,
                None => {
                    let schema = writer.add_schema(schema, "protobuf", schema_data)?;
                    let id = writer.add_channel(schema, topic, encoding, &BTreeMap::new())?;
                    channels.insert(key, id);
                    id
                }
            };
            let (sequence, log_time, publish_time) = (*sequence, *log_time, *publish_time);
            let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time };
            writer.write_to_known_channel(&header, data)?;
        }
        if let Some(end) = &self.end {
            writer.write_metadata(&mcap::records::Metadata { name: END.to_owned(), metadata: end.clone() })?;
        }
        writer.finish()?;
        Ok(())
    }
}

/// Writes a recording again with valid checksums, each message replaced by `rewrite`, and the scene by `scene`.
pub fn rewritten(
    file: &Path,
    name: &str,
    rewrite: Rewrite,
    scene: &dyn Fn(&str) -> String,
) -> Result<PathBuf, Box<dyn std::error::Error>> {
    rewritten_with_rates(file, name, rewrite, scene, None)
}

/// As [`rewritten`], with other publishing rates in the metadata, if any.
pub fn rewritten_with_rates(
    file: &Path,
    name: &str,
    rewrite: Rewrite,
    scene: &dyn Fn(&str) -> String,
    rates: Option<&str>,
) -> Result<PathBuf, Box<dyn std::error::Error>> {
    let path = file.with_file_name(name);
    let mut all = Contents::read(file, rewrite)?;
    all.scene = scene(&all.scene);
    for (_, entries) in &mut all.metadata {
        if let Some((stated, rates)) = entries.get_mut("publish_hz").zip(rates) {
            rates.clone_into(stated);
        }
    }
    all.recount();
    all.write(&path)?;
    Ok(path)
}

pub fn as_is(_: u64, message: &RecordedMessage) -> Option<Vec<u8>> {
    Some(message.data.to_vec())
}
