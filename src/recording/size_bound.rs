//! Upper bound for the size of a recording that is still open, so that it ends before its size limit.
//!
//! The terms follow the records of the MCAP specification (version 0). Chunks that do not compress are taken as such.

use super::message::Message;

/// Opcode and length before every record.
const HEAD: u64 = 9;
/// A chunk record beside its content.
const CHUNK: u64 = 128;
/// Length of what a compressed chunk may have beside its content: LZ4 frames keep blocks that do not compress, each with four bytes.
const STORED: u64 = 64;
/// A message record beside its payload, and its entry in the index of its chunk.
const MESSAGE: u64 = HEAD + 22 + 16;
/// For a topic in every chunk: the head of its message index, and its entry in the chunk index.
const TOPIC_IN_CHUNK: u64 = HEAD + 6 + 10;
/// For a topic at the end of the file: its entries in the statistics and in the recording's end, beside its name.
const TOPIC_AT_END: u64 = 10 + 32;
/// A schema and a channel record beside names and schema.
const DEFINITION: u64 = 2 * HEAD + 64;
/// The rest of a file's end: the recording's end, statistics, the index of the attachment and the metadata, offsets, footer.
const END: u64 = 2048;

/// Sizes that make up the bound, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SizeBound {
    /// Size of the file.
    there: u64,
    /// Content of the open chunk, with its index.
    open: u64,
    /// Definitions of the topics, which the end of the file repeats.
    definitions: u64,
    /// Entries of the topics at the end of the file.
    counts: u64,
    /// Indexes of the closed chunks.
    indexes: u64,
    topics: u64,
}

impl SizeBound {
    /// Bound of a file without messages.
    pub fn new(there: u64) -> Self {
        SizeBound { there, open: 0, definitions: 0, counts: 0, indexes: 0, topics: 0 }
    }

    /// Size of the file without its open chunk.
    pub fn there(&self) -> u64 {
        self.there
    }

    /// Content of the open chunk.
    pub fn open(&self) -> u64 {
        self.open
    }

    /// Adds a message to the open chunk; `definition` is the length of the schema that comes with it if its topic is new.
    pub fn with(mut self, message: &Message, definition: Option<usize>) -> Self {
        self.open += MESSAGE + message.payload.len() as u64;
        if let Some(schema) = definition {
            let (topic, name) = (message.topic.len() as u64, message.schema.len() as u64);
            let definition = DEFINITION + topic + name + schema as u64;
            self.open += definition;
            self.definitions += definition;
            self.counts += TOPIC_AT_END + topic;
            self.topics += 1;
        }
        self
    }

    /// Closes the open chunk: the file has this size now.
    pub fn close_chunk(&mut self, there: u64) {
        self.indexes += CHUNK + TOPIC_IN_CHUNK * self.topics;
        (self.there, self.open) = (there, 0);
    }

    /// Upper bound for the size of the closed file.
    pub fn closed(&self) -> u64 {
        let index = CHUNK + TOPIC_IN_CHUNK * self.topics;
        let chunk = self.open + self.open / 256 + STORED + index;
        self.there + chunk + self.indexes + index + self.definitions + self.counts + END
    }
}
