//! Export for ROS 2: an MCAP file with the messages that `run --ros2` publishes, as `ros2 bag play` reads it.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::Writer;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;

use super::super::RecordingError;
use super::super::format::RecordedMessage;
use super::super::rows::TimeRange;
use super::super::writer::{Written, options};
use crate::bus::Name;
use crate::ros2::{Converter, RosMessage, node_name};
use crate::whole_file::WholeFile;
use crate::wire::Message;

/// Profile and encodings by which programs of ROS 2 know the file.
const PROFILE: &str = "ros2";
const MESSAGE_ENCODING: &str = "cdr";
const SCHEMA_ENCODING: &str = "ros2msg";

/// Writes a part of a recording. Returns the file, and whether the recording ends early.
pub(super) fn export(
    recording: &Path,
    to: &Path,
    part: TimeRange,
    progress: &dyn Fn(f64),
) -> Result<(Written, bool), RecordingError> {
    let mut bag = Bag::create(to)?;
    let cut_off = convert(recording, part, progress, &mut bag)?;
    Ok((bag.finish()?, cut_off))
}

/// Log and publish time, ns.
type Times = (u64, u64);

/// The services of a recording, with the times of their messages that wait.
type Services = BTreeMap<Name, (Converter, Times)>;

fn convert(recording: &Path, part: TimeRange, progress: &dyn Fn(f64), bag: &mut Bag) -> Result<bool, RecordingError> {
    let mut services = Services::new();
    let cut_off = part.each_message(recording, progress, |message| {
        let Some((name, decoded)) = decode(recording, message)? else { return Ok(()) };
        let first = services.is_empty();
        let new = || (Converter::new(&node_name(&name), first), (0, 0));
        let (converter, times) = services.entry(name.clone()).or_insert_with(new);
        let now = (message.log_time, message.publish_time);
        if times.0 != now.0 {
            bag.write(&converter.finish(), *times)?;
        }
        *times = now;
        bag.write(&converter.take(decoded), now)
    })?;
    for (mut converter, times) in services.into_values() {
        bag.write(&converter.finish(), times)?;
    }
    if bag.messages == 0 {
        return Err(RecordingError::NothingForRos(recording.to_owned()));
    }
    Ok(cut_off)
}

/// The service and the message, if it is one of flexcrank's.
fn decode(recording: &Path, message: &RecordedMessage) -> Result<Option<(Name, Message)>, RecordingError> {
    let topic = message.channel.topic.trim_start_matches('/');
    let Some((name, schema)) = Name::split(topic).map(|(name, _)| name).zip(message.channel.schema.as_ref()) else {
        return Ok(None);
    };
    let decoded = Message::decode(&schema.name, &message.data).map_err(|cause| RecordingError::Undecodable {
        path: recording.to_owned(),
        topic: message.channel.topic.clone(),
        cause: cause.to_string(),
    })?;
    Ok(decoded.map(|decoded| (name, decoded)))
}

/// The file being written.
struct Bag {
    path: PathBuf,
    mcap: Writer<NoSeek<BufWriter<WholeFile>>>,
    /// Channel and last sequence number of every topic.
    channels: BTreeMap<String, (u16, u32)>,
    messages: u64,
}

impl Bag {
    fn create(path: &Path) -> Result<Self, RecordingError> {
        if path.exists() {
            return Err(RecordingError::Exists(path.to_owned()));
        }
        let file = WholeFile::create(path).map_err(RecordingError::file(path))?;
        let output = NoSeek::new(BufWriter::new(file));
        let mcap = options().profile(PROFILE).create(output).map_err(RecordingError::mcap(path))?;
        Ok(Bag { path: path.to_owned(), mcap, channels: BTreeMap::new(), messages: 0 })
    }

    fn write(&mut self, messages: &[RosMessage], (log_time, publish_time): Times) -> Result<(), RecordingError> {
        for message in messages {
            self.append(message, (log_time, publish_time)).map_err(RecordingError::mcap(&self.path))?;
            self.messages += 1;
        }
        Ok(())
    }

    fn append(&mut self, message: &RosMessage, (log_time, publish_time): Times) -> mcap::McapResult<()> {
        let (channel_id, sequence) = match self.channels.get_mut(&message.topic) {
            Some((id, sequence)) => {
                *sequence = sequence.wrapping_add(1);
                (*id, *sequence)
            }
            None => (self.open_channel(message)?, 0),
        };
        let payload = message.of.encode(&message.value).map_err(std::io::Error::other)?;
        self.mcap.write_to_known_channel(&MessageHeader { channel_id, sequence, log_time, publish_time }, &payload)
    }

    fn open_channel(&mut self, RosMessage { topic, of, .. }: &RosMessage) -> mcap::McapResult<u16> {
        let schema = self.mcap.add_schema(of.name(), SCHEMA_ENCODING, of.schema().as_bytes())?;
        // Without a profile of its own a topic is played with the default one.
        let facts = [("offered_qos_profiles", String::new()), ("topic_type_hash", of.hash())];
        let facts = facts.map(|(key, value)| (key.to_owned(), value)).into();
        let id = self.mcap.add_channel(schema, topic, MESSAGE_ENCODING, &facts)?;
        self.channels.insert(topic.clone(), (id, 0));
        Ok(id)
    }

    fn finish(mut self) -> Result<Written, RecordingError> {
        self.mcap.finish().map_err(RecordingError::mcap(&self.path))?;
        let file = self.mcap.into_inner().into_inner().into_inner();
        let file = file.map_err(|refused| RecordingError::file(&self.path)(refused.into_error()))?;
        file.finish_new().map_err(RecordingError::new_file(&self.path))?;
        Ok(Written { path: self.path, messages: self.messages, limited: false })
    }
}
