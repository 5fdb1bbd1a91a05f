//! Thrift's compact protocol, as far as Parquet's headers need it.
//! <https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>

const TRUE: u8 = 1;
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// A struct being written: its fields, in ascending order of their numbers.
#[derive(Default)]
pub(super) struct Struct {
    bytes: Vec<u8>,
    last: u8,
}

impl Struct {
    fn field(&mut self, id: u8, kind: u8) {
        // Parquet's numbers are small: none is more than 15 beyond the one before.
        self.bytes.push((id - self.last) << 4 | kind);
        self.last = id;
    }

    pub fn i32(mut self, id: u8, value: i32) -> Self {
        self.field(id, I32);
        number(&mut self.bytes, value.into());
        self
    }

    pub fn i64(mut self, id: u8, value: usize) -> Self {
        self.field(id, I64);
        number(&mut self.bytes, value as i64);
        self
    }

    pub fn yes(mut self, id: u8) -> Self {
        self.field(id, TRUE);
        self
    }

    pub fn text(mut self, id: u8, text: &str) -> Self {
        self.field(id, BINARY);
        binary(&mut self.bytes, text);
        self
    }

    pub fn inner(mut self, id: u8, inner: Struct) -> Self {
        self.field(id, STRUCT);
        self.bytes.extend(inner.finish());
        self
    }

    pub fn texts(mut self, id: u8, texts: &[&str]) -> Self {
        self.list(id, BINARY, texts.len());
        texts.iter().for_each(|text| binary(&mut self.bytes, text));
        self
    }

    pub fn numbers(mut self, id: u8, numbers: &[i32]) -> Self {
        self.list(id, I32, numbers.len());
        numbers.iter().for_each(|value| number(&mut self.bytes, (*value).into()));
        self
    }

    pub fn structs(mut self, id: u8, structs: impl ExactSizeIterator<Item = Struct>) -> Self {
        self.list(id, STRUCT, structs.len());
        structs.for_each(|inner| self.bytes.extend(inner.finish()));
        self
    }

    fn list(&mut self, id: u8, kind: u8, length: usize) {
        self.field(id, LIST);
        match u8::try_from(length) {
            Ok(length @ 0..15) => self.bytes.push(length << 4 | kind),
            _ => {
                self.bytes.push(0xF0 | kind);
                varint(&mut self.bytes, length as u64);
            }
        }
    }

    /// Its bytes.
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }
}

/// Seven bits a byte, the lowest first.
pub(super) fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// Signed, with the sign in the lowest bit.
fn number(bytes: &mut Vec<u8>, value: i64) {
    varint(bytes, (value << 1 ^ value >> 63) as u64);
}

fn binary(bytes: &mut Vec<u8>, text: &str) {
    varint(bytes, text.len() as u64);
    bytes.extend_from_slice(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_numbers_are_as_the_specification_has_them() {
        let of = |value| {
            let mut bytes = Vec::new();
            number(&mut bytes, value);
            bytes
        };
        assert_eq!((of(0), of(-1), of(1), of(-64)), (vec![0], vec![1], vec![2], vec![127]));
        assert_eq!((of(150), of(i64::MIN)), (vec![0xAC, 0x02], [vec![0xFF; 9], vec![1]].concat()));
    }

    #[test]
    fn val_fields_are_numbered_by_their_distance() {
        let inner = Struct::default().text(1, "a").yes(2);
        let bytes = Struct::default().i32(1, 1).inner(5, inner).numbers(6, &[3; 15]).finish();
        let expected = [vec![0x15, 2, 0x4C, 0x18, 1, b'a', 0x11, 0, 0x19, 0xF5, 15], vec![6; 15], vec![0]].concat();
        assert_eq!(bytes, expected);
    }
}
