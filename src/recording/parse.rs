//! Records parsed, after a look at the lengths that they state: the parser believes them, and takes the memory.

use mcap::McapResult;
use mcap::records::{Record, op};

/// What a record consists of, as far as lengths are stated in it.
#[derive(Clone, Copy)]
enum Part {
    /// So many bytes.
    Fixed(usize),
    /// A length and as many bytes.
    Text,
    /// A length and as many bytes, all of them texts.
    Texts,
}

/// A record from its bytes.
///
/// # Errors
/// When it is not one.
pub(super) fn parse(opcode: u8, body: &[u8]) -> McapResult<Record<'_>> {
    let parts: &[Part] = match opcode {
        op::HEADER => &[Part::Text, Part::Text],
        op::SCHEMA => &[Part::Fixed(2), Part::Text, Part::Text, Part::Fixed(4)],
        op::CHANNEL => &[Part::Fixed(4), Part::Text, Part::Text, Part::Texts],
        op::METADATA => &[Part::Text, Part::Texts],
        op::CHUNK => &[Part::Fixed(28), Part::Text, Part::Fixed(8)],
        op::CHUNK_INDEX => &[Part::Fixed(32), Part::Text, Part::Fixed(8), Part::Text, Part::Fixed(16)],
        op::ATTACHMENT_INDEX => &[Part::Fixed(40), Part::Text, Part::Text],
        op::METADATA_INDEX => &[Part::Fixed(16), Part::Text],
        // Two times before; the data's length and a checksum behind.
        op::ATTACHMENT => &[Part::Fixed(16), Part::Text, Part::Text, Part::Fixed(12)],
        _ => &[],
    };
    let fits = parts.iter().try_fold(body, |rest, part| after(*part, rest)).is_some();
    // Without a body it fails as it should.
    mcap::parse_record(opcode, if fits { body } else { &[] })
}

/// What comes after a part; `None` when it does not fit.
fn after(part: Part, bytes: &[u8]) -> Option<&[u8]> {
    match part {
        Part::Fixed(size) => bytes.get(size..),
        Part::Text => {
            let (length, rest) = bytes.split_first_chunk()?;
            rest.get(u32::from_le_bytes(*length) as usize..)
        }
        Part::Texts => {
            let (length, rest) = bytes.split_first_chunk()?;
            let (mut texts, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
            while !texts.is_empty() {
                texts = after(Part::Text, texts)?;
            }
            Some(rest)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_length_that_lies_is_refused_before_it_costs_memory() {
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
    }
}
