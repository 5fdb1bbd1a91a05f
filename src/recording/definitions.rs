//! The schemas and channels of a file, bounded: a chunk of a few kilobytes may hold a schema of 60 MB.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use mcap::read::ChannelAccumulator;
use mcap::records::{Channel as ChannelRecord, SchemaHeader};
use mcap::{McapError, McapResult};

use super::format::Channel;

/// Size limit of all schemas and channels of a file together, bytes.
const LIMIT: usize = 16 * 1024 * 1024;

/// Channels and schemas read so far.
#[derive(Default)]
pub(super) struct Channels {
    read: ChannelAccumulator<'static>,
    size: DefinitionsSize,
}

impl Channels {
    /// Adds a schema.
    ///
    /// # Errors
    /// Fails if it contradicts another of this id, or if all together are too large.
    pub fn add_schema(&mut self, header: SchemaHeader, data: &[u8]) -> McapResult<()> {
        self.size.add_schema(&header, data)?;
        self.read.add_schema(header, Cow::Owned(data.to_vec()))
    }

    /// Adds a channel.
    ///
    /// # Errors
    /// Fails if it contradicts another of this id, has an unknown schema, or if all together are too large.
    pub fn add_channel(&mut self, channel: ChannelRecord) -> McapResult<()> {
        self.size.add_channel(&channel)?;
        self.read.add_channel(channel)
    }

    /// The channel of this id.
    pub fn get(&self, id: u16) -> Option<Arc<Channel>> {
        self.read.get(id)
    }
}

/// Sizes of schemas and channels by id, bytes. A definition that is repeated counts once.
#[derive(Default)]
pub(super) struct DefinitionsSize {
    schemas: HashMap<u16, usize>,
    channels: HashMap<u16, usize>,
    all: usize,
}

impl DefinitionsSize {
    /// Counts a schema.
    ///
    /// # Errors
    /// Fails if all definitions together are too large.
    pub fn add_schema(&mut self, header: &SchemaHeader, data: &[u8]) -> McapResult<()> {
        let size = header.name.len() + header.encoding.len() + data.len();
        let before = self.schemas.insert(header.id, size);
        self.count(size, before)
    }

    /// Counts a channel.
    ///
    /// # Errors
    /// Fails if all definitions together are too large.
    pub fn add_channel(&mut self, channel: &ChannelRecord) -> McapResult<()> {
        let metadata: usize = channel.metadata.iter().map(|(key, value)| key.len() + value.len()).sum();
        let size = channel.topic.len() + channel.message_encoding.len() + metadata;
        let before = self.channels.insert(channel.id, size);
        self.count(size, before)
    }

    fn count(&mut self, size: usize, before: Option<usize>) -> McapResult<()> {
        self.all = self.all + size - before.unwrap_or(0);
        if self.all <= LIMIT {
            return Ok(());
        }
        let why = format!("schemas and topics of more than {} MiB together are not read", LIMIT / 1024 / 1024);
        Err(McapError::Io(std::io::Error::other(why)))
    }
}
