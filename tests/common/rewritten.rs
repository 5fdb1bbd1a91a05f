//! Recordings written anew with a change, all sums right.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use flexcrank::recording::{RecordedMessage, WalkFlow, WalkItem, walk};

/// Replaces a message: by itself, nothing, or another one.
pub type Rewrite<'a> = &'a dyn Fn(u64, &RecordedMessage) -> Option<Vec<u8>>;

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
    let mut writer = mcap::WriteOptions::new().create(BufWriter::new(File::create(&path)?))?;
    let mut channels = std::collections::HashMap::new();
    let mut number = 0;
    let mut failed = None;
    let mut take = |found: WalkItem<'_>| -> mcap::McapResult<()> {
        match found {
            WalkItem::Metadata(name, entries) => {
                let mut metadata = entries.clone();
                if let Some((stated, rates)) = metadata.get_mut("publish_hz").zip(rates) {
                    rates.clone_into(stated);
                }
                writer.write_metadata(&mcap::records::Metadata { name: name.to_owned(), metadata })?;
            }
            WalkItem::Attachment(name, data) => {
                let data = scene(&String::from_utf8_lossy(data)).into_bytes();
                let (name, media_type) = (name.to_owned(), "application/toml".to_owned());
                writer.attach(&mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data: data.into() })?;
            }
            WalkItem::Message(message) => {
                number += 1;
                let Some(data) = rewrite(number, message) else { return Ok(()) };
                let topic = &message.channel.topic;
                if !channels.contains_key(topic) {
                    let Some(schema) = message.channel.schema.as_ref() else { return Ok(()) };
                    let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
                    channels.insert(topic.clone(), writer.add_channel(schema, topic, "protobuf", &Default::default())?);
                }
                let header = mcap::records::MessageHeader {
                    channel_id: channels[topic],
                    sequence: message.sequence,
                    log_time: message.log_time,
                    publish_time: message.publish_time,
                };
                writer.write_to_known_channel(&header, &data)?;
            }
            WalkItem::Damage(_) => {}
        }
        Ok(())
    };
    walk(file, |found, _| {
        failed = failed.take().or(take(found).err());
        WalkFlow::Continue(())
    })?;
    failed.map_or(Ok(()), Err)?;
    writer.finish()?;
    Ok(path)
}

pub fn as_is(_: u64, message: &RecordedMessage) -> Option<Vec<u8>> {
    Some(message.data.to_vec())
}
