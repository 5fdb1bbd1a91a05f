//! Scans a file that may be damaged, record by record; after damage, it searches for the next chunk.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::ops::Range;
use std::path::Path;

use mcap::MAGIC;
use mcap::records::op;

use crate::recording::format::{RECORD_HEAD, RECORD_LIMIT};

/// Block size of the search, bytes.
const BLOCK: usize = 64 * 1024;
/// Bytes that identify a chunk: its header up to the content, with the longest name of a compression.
const CHUNK_MARK: usize = 9 + 8 + 8 + 8 + 4 + 4 + 4 + 8;

/// The next piece of a file.
pub(super) enum Piece<'a> {
    /// A record that looks complete; the content of a chunk may still be damaged.
    Record { opcode: u8, body: &'a [u8] },
    /// The beginning of a chunk in which the file ends.
    CutChunk(&'a [u8]),
    /// Bytes that are not a record.
    Damage,
}

/// Scans a file record by record. Holds at most one record in memory.
pub(super) struct Scanner {
    file: BufReader<File>,
    at: u64,
    length: u64,
    /// Whether the file ends like one that was closed.
    closed: bool,
    body: Vec<u8>,
}

impl Scanner {
    pub(super) fn open(path: &Path) -> std::io::Result<Self> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        let mut scanner = Scanner { file: BufReader::with_capacity(BLOCK, file), at: 0, length, closed: false, body: Vec::new() };
        scanner.closed = scanner.peek(length.saturating_sub(MAGIC.len() as u64), MAGIC.len())? == MAGIC;
        if scanner.peek(0, MAGIC.len())? == MAGIC {
            scanner.at = MAGIC.len() as u64;
        }
        Ok(scanner)
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
    pub(super) fn next(&mut self) -> std::io::Result<Option<Piece<'_>>> {
        let rest = self.length - self.at;
        if rest == 0 || (rest == MAGIC.len() as u64 && self.peek(self.at, MAGIC.len())? == MAGIC) {
            self.at = self.length;
            return Ok(None);
        }
        if let Some((opcode, content)) = self.record_at(self.at)?
            && (self.is_chunk(self.at)? || self.is_boundary(content.end)?)
        {
            return Ok(Some(Piece::Record { opcode, body: self.read(content)? }));
        }
        let next = self.find_chunk(self.at + 1)?;
        if next.is_none() && self.is_cut_chunk(self.at)? {
            return Ok(Some(Piece::CutChunk(self.read(self.at + RECORD_HEAD..self.length)?)));
        }
        self.at = next.unwrap_or(self.length);
        Ok(Some(Piece::Damage))
    }

    /// Reads a range of bytes, and moves behind it.
    fn read(&mut self, bytes: Range<u64>) -> std::io::Result<&[u8]> {
        self.body.resize((bytes.end - bytes.start) as usize, 0);
        self.go_to(bytes.start)?;
        self.file.read_exact(&mut self.body)?;
        self.at = bytes.end;
        Ok(&self.body)
    }

    /// Opcode and content of a possible record.
    fn record_at(&mut self, at: u64) -> std::io::Result<Option<(u8, Range<u64>)>> {
        if self.length.saturating_sub(at) < RECORD_HEAD {
            return Ok(None);
        }
        let header = self.peek(at, RECORD_HEAD as usize)?;
        let (opcode, length) = (header[0], number(&header, 1));
        let possible = match opcode {
            op::DATA_END => length == 4,
            op::FOOTER => length == 20,
            0 => false,
            _ => length <= RECORD_LIMIT as u64,
        };
        let start = at + RECORD_HEAD;
        let known = (op::HEADER..=op::DATA_END).contains(&opcode) || opcode >= 0x80;
        Ok((known && possible && length <= self.length - start).then_some((opcode, start..start.saturating_add(length))))
    }

    /// Whether a record could begin here, or the file ends here.
    fn is_boundary(&mut self, at: u64) -> std::io::Result<bool> {
        let rest = self.length - at;
        let magic = MAGIC.len() as u64;
        let ends = rest == 0 || (rest >= magic && self.peek(at, MAGIC.len())? == MAGIC);
        Ok(ends || self.record_at(at)?.is_some() || self.is_cut_chunk(at)?)
    }

    /// Whether a complete chunk with consistent lengths begins here.
    fn is_chunk(&mut self, at: u64) -> std::io::Result<bool> {
        Ok(chunk_end(&self.peek(at, CHUNK_MARK)?).is_some_and(|end| end <= self.length - at))
    }

    /// Whether the file ends in a chunk that begins here.
    fn is_cut_chunk(&mut self, at: u64) -> std::io::Result<bool> {
        Ok(!self.closed && chunk_end(&self.peek(at, CHUNK_MARK)?).is_some_and(|end| end > self.length - at))
    }

    /// Finds the start of the next chunk from `from` on.
    fn find_chunk(&mut self, from: u64) -> std::io::Result<Option<u64>> {
        let mut at = from;
        while at < self.length {
            let size = (self.length - at).min((BLOCK + CHUNK_MARK) as u64) as usize;
            let bytes = self.peek(at, size)?;
            let rest = self.length - at;
            let is_chunk =
                |start: &usize| chunk_end(&bytes[*start..]).is_some_and(|end| !self.closed || end <= rest - *start as u64);
            if let Some(found) = (0..size.min(BLOCK)).find(is_chunk) {
                return Ok(Some(at + found as u64));
            }
            at += BLOCK as u64;
        }
        Ok(None)
    }

    /// Seeks, and keeps the buffer if the target lies in it.
    fn go_to(&mut self, at: u64) -> std::io::Result<()> {
        let here = self.file.stream_position()?;
        self.file.seek_relative(at as i64 - here as i64)
    }

    fn peek(&mut self, at: u64, size: usize) -> std::io::Result<Vec<u8>> {
        self.go_to(at)?;
        let mut bytes = vec![0; size.min(self.length.saturating_sub(at) as usize)];
        self.file.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

/// Returns where the chunk with this header ends, if its lengths are consistent.
fn chunk_end(bytes: &[u8]) -> Option<u64> {
    if bytes.first() != Some(&op::CHUNK) || bytes.len() < CHUNK_MARK - 4 {
        return None;
    }
    let (length, begin, end, name) = (number(bytes, 1), number(bytes, 9), number(bytes, 17), short(bytes, 37) as usize);
    if length > RECORD_LIMIT as u64 || begin > end || name > 4 || bytes.len() < 49 + name {
        return None;
    }
    let known = [&b""[..], b"lz4", b"zstd"].contains(&&bytes[41..41 + name]);
    (known && number(bytes, 41 + name).checked_add(40 + name as u64) == Some(length)).then_some(RECORD_HEAD + length)
}

fn number(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..at + 8).and_then(|bytes| bytes.try_into().ok()).map_or(0, u64::from_le_bytes)
}

fn short(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).and_then(|bytes| bytes.try_into().ok()).map_or(0, u32::from_le_bytes)
}
