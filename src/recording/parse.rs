//! Parsing of MCAP records, after a check of the lengths they state: the library's parser would allocate any stated length.

use mcap::McapResult;
use mcap::records::{Record, op};

/// A part of a record, as far as lengths are stated in it.
#[derive(Clone, Copy)]
enum RecordPart {
    /// This many bytes.
    Fixed(usize),
    /// A length and that many bytes.
    Text,
    /// A length and that many bytes, all of them texts.
    Texts,
    /// A length and that many bytes: whole entries of this size.
    Entries(usize),
}
use RecordPart::{Entries, Fixed, Text, Texts};

/// Parses a record.
///
/// # Errors
/// Fails if the bytes are not a valid record.
pub(super) fn parse(opcode: u8, body: &[u8]) -> McapResult<Record<'_>> {
    let parts: &[RecordPart] = match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Fixed(2), Text, Text],
        op::CHANNEL => &[Fixed(4), Text, Text, Texts],
        op::METADATA => &[Text, Texts],
        op::CHUNK => &[Fixed(28), Text],
        op::MESSAGE_INDEX => &[Fixed(2), Entries(16)],
        op::CHUNK_INDEX => &[Fixed(32), Entries(10), Fixed(8), Text],
        op::STATISTICS => &[Fixed(42), Entries(10)],
        op::ATTACHMENT_INDEX => &[Fixed(40), Text, Text],
        op::METADATA_INDEX => &[Fixed(16), Text],
        // The library's parser panics without the length of the data and the checksum.
        op::ATTACHMENT => &[Fixed(16), Text, Text, Fixed(12)],
        _ => &[],
    };
    let fits = parts.iter().try_fold(body, |rest, part| after(*part, rest)).is_some();
    // An empty body fails with the parser's own error.
    mcap::parse_record(opcode, if fits { body } else { &[] })
}

/// Returns the bytes after a part; `None` if the part does not fit.
fn after(part: RecordPart, bytes: &[u8]) -> Option<&[u8]> {
    if let Fixed(size) = part {
        return bytes.get(size..);
    }
    let (length, rest) = bytes.split_first_chunk()?;
    let (mut content, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    while matches!(part, Texts) && !content.is_empty() {
        content = after(Text, content)?;
    }
    // The library takes a part of an entry for a whole one.
    let is_whole = !matches!(part, Entries(size) if !content.len().is_multiple_of(size));
    is_whole.then_some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_wrong_length_is_refused_before_it_allocates_memory() {
        let channel = |map: u32, text: u32| {
            let mut body = vec![1, 0, 1, 0];
            for part in
                [1_u32.to_le_bytes().as_slice(), b"t", &1_u32.to_le_bytes(), b"e", &map.to_le_bytes(), &text.to_le_bytes()]
            {
                body.extend_from_slice(part);
            }
            body.extend_from_slice(&[0; 4]);
            body
        };
        assert!(parse(op::CHANNEL, &channel(8, 0)).is_ok());
        assert!(parse(op::CHANNEL, &channel(8, u32::MAX)).is_err());
        assert!(parse(op::CHANNEL, &channel(u32::MAX, 0)).is_err());
        assert!(parse(op::ATTACHMENT, &[0; 34]).is_err());
        assert!(parse(op::CHUNK_INDEX, &[0xFF; 100]).is_err());
        assert!(parse(op::HEADER, &u32::MAX.to_le_bytes()).is_err());
        // The library allocates what is stated; once it does not, these checks can go.
        let memory = |parse: fn(u8, &[u8]) -> McapResult<Record<'_>>| {
            allocation_counter::measure(|| assert!(parse(op::HEADER, &(1_u32 << 28).to_le_bytes()).is_err())).bytes_max
        };
        assert!(memory(parse) < 1000 && memory(mcap::parse_record) >= 1 << 28);
    }
}
