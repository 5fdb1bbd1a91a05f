//! Scans a file that may be damaged, record by record; after damage, it searches for the next chunk.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::ops::{Range, RangeInclusive};

use mcap::MAGIC;
use mcap::records::op;

use crate::recording::format::{ChunkHead, RECORD_HEAD, RECORD_LIMIT, is_closed, record_head};

/// Block size of the search, bytes.
const BLOCK: usize = 64 * 1024;
/// Size of the first block of a search, bytes.
const FIRST_BLOCK: usize = 256;
/// Bytes that identify a chunk: its header up to the content, with the longest name of a compression.
const CHUNK_MARK: usize = RECORD_HEAD + 8 + 8 + 8 + 4 + 4 + 4 + 8;

/// The kinds of records that a file may end in, before its index.
const KNOWN: RangeInclusive<u8> = op::HEADER..=op::DATA_END;

/// The next piece of a file.
pub(super) enum Piece {
    /// A record that looks complete; the content of a chunk may still be damaged.
    Record { opcode: u8, body: Vec<u8> },
    /// The beginning of a chunk in which the file ends.
    CutChunk(Vec<u8>),
    /// Bytes that are not a record.
    Damage,
}

/// Extent of a chunk in a file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Extent {
    Whole,
    /// The file ends in it.
    Cut,
}

/// Scans a file record by record. Holds at most one record in memory.
pub(super) struct Scanner {
    file: BufReader<File>,
    at: u64,
    length: u64,
    /// Whether the file ends like one that was closed.
    closed: bool,
}

impl Scanner {
    pub(super) fn new(file: File) -> std::io::Result<Self> {
        let mut file = BufReader::with_capacity(BLOCK, file);
        let (length, closed) = (file.get_ref().metadata()?.len(), is_closed(&mut file)?);
        let mut scanner = Scanner { file, at: 0, length, closed };
        if scanner.peek(0, MAGIC.len())? == MAGIC {
            scanner.at = MAGIC.len() as u64;
        }
        Ok(scanner)
    }

    /// Whether the file ends like one that was closed.
    pub(super) fn closed(&self) -> bool {
        self.closed
    }

    /// Bytes scanned.
    pub(super) fn done(&self) -> u64 {
        self.at
    }

    /// Size of the file, bytes.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// Reads the next piece; `None` at the end of the file.
    pub(super) fn next(&mut self) -> std::io::Result<Option<Piece>> {
        let rest = self.length - self.at;
        if rest == 0 || (rest == MAGIC.len() as u64 && self.peek(self.at, MAGIC.len())? == MAGIC) {
            self.at = self.length;
            return Ok(None);
        }
        let chunk = self.chunk_at(self.at)?;
        let record = self.record_at(self.at)?;
        if let Some((opcode, content)) = record.clone()
            && (chunk == Some(Extent::Whole) || self.is_boundary(content.end)?)
        {
            return Ok(Some(Piece::Record { opcode, body: self.read(content)? }));
        }
        let next = self.find_chunk(self.at + 1)?;
        if next.is_none() && chunk == Some(Extent::Cut) {
            return Ok(Some(Piece::CutChunk(self.read(self.at + RECORD_HEAD as u64..self.length)?)));
        }
        if let (None, Some((opcode, content))) = (next, record)
            && self.is_cut_record(content.end)?
        {
            return Ok(Some(Piece::Record { opcode, body: self.read(content)? }));
        }
        self.at = next.unwrap_or(self.length);
        Ok(Some(Piece::Damage))
    }

    /// Reads a range of bytes, and moves behind it.
    fn read(&mut self, bytes: Range<u64>) -> std::io::Result<Vec<u8>> {
        self.at = bytes.end;
        self.peek(bytes.start, (bytes.end - bytes.start) as usize)
    }

    /// Opcode and content of a possible record.
    fn record_at(&mut self, at: u64) -> std::io::Result<Option<(u8, Range<u64>)>> {
        let Some((opcode, length)) = record_head(&self.peek(at, RECORD_HEAD)?) else { return Ok(None) };
        let possible = match opcode {
            op::DATA_END => length == 4,
            op::FOOTER => length == 20,
            op::HEADER..op::DATA_END | 0x80.. => length <= RECORD_LIMIT,
            _ => false,
        };
        let start = at + RECORD_HEAD as u64;
        Ok((possible && length <= self.length - start).then(|| (opcode, start..start + length)))
    }

    /// Whether the file may end inside a record that begins here. A closed file ends inside none.
    fn is_cut_record(&mut self, at: u64) -> std::io::Result<bool> {
        if self.closed {
            return Ok(false);
        }
        let head = self.peek(at, RECORD_HEAD)?;
        Ok(match (record_head(&head), head.first()) {
            (Some((opcode, length)), _) => {
                KNOWN.contains(&opcode) && length <= RECORD_LIMIT && length > self.length - at - RECORD_HEAD as u64
            }
            (None, opcode) => opcode.is_some_and(|opcode| KNOWN.contains(opcode)),
        })
    }

    /// Whether a record could begin here, or the file ends here.
    fn is_boundary(&mut self, at: u64) -> std::io::Result<bool> {
        let ends = at == self.length || self.peek(at, MAGIC.len())? == MAGIC;
        Ok(ends || self.record_at(at)?.is_some() || self.chunk_at(at)? == Some(Extent::Cut))
    }

    /// The extent of the chunk that begins here, if its lengths are consistent.
    fn chunk_at(&mut self, at: u64) -> std::io::Result<Option<Extent>> {
        let bytes = self.peek(at, CHUNK_MARK)?;
        Ok(self.chunk(at, &bytes))
    }

    /// The extent of the chunk whose header stands at a position, if these bytes are one. A closed file ends in no chunk.
    fn chunk(&self, at: u64, bytes: &[u8]) -> Option<Extent> {
        let (opcode, length) = record_head(bytes)?;
        if opcode != op::CHUNK || length > RECORD_LIMIT {
            return None;
        }
        let ChunkHead { span_ns: [first, last], compression, end, .. } = ChunkHead::of(&bytes[RECORD_HEAD..])?;
        let consistent = end == length && first <= last && [&b""[..], b"lz4", b"zstd"].contains(&compression);
        let is_whole = RECORD_HEAD as u64 + length <= self.length - at;
        (consistent && (is_whole || !self.closed)).then_some(if is_whole { Extent::Whole } else { Extent::Cut })
    }

    /// Finds the start of the next chunk from `from` on.
    fn find_chunk(&mut self, from: u64) -> std::io::Result<Option<u64>> {
        // Small blocks first: a file may be full of false heads.
        let (mut at, mut size) = (from, FIRST_BLOCK);
        while at < self.length {
            let bytes = self.peek(at, size + CHUNK_MARK)?;
            let is_chunk = |start: &usize| self.chunk(at + *start as u64, &bytes[*start..]).is_some();
            if let Some(found) = (0..bytes.len().min(size)).find(is_chunk) {
                return Ok(Some(at + found as u64));
            }
            at += size as u64;
            size = (2 * size).min(BLOCK);
        }
        Ok(None)
    }

    /// Reads bytes, as far as the file has them.
    fn peek(&mut self, at: u64, size: usize) -> std::io::Result<Vec<u8>> {
        // The buffer is kept if the target lies in it.
        let here = self.file.stream_position()?;
        self.file.seek_relative(at as i64 - here as i64)?;
        let mut bytes = vec![0; size.min(self.length.saturating_sub(at) as usize)];
        self.file.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}
