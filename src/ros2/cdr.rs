//! CDR, the byte format of ROS messages: little-endian, numbers aligned to their size, behind a header of four bytes.

use super::types::{Count, Field, Kind, RosType};

/// Identifies plain little-endian CDR, with options that are unused.
const HEADER: [u8; 4] = [0, 1, 0, 0];
/// Bytes that some writers add, so that the length is a multiple of four.
const PADDING: usize = 3;

/// The value of a message, field or element.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "named as their types")]
pub enum Value {
    Bool(bool),
    U8(u8),
    I32(i32),
    U32(u32),
    I64(i64),
    F32(f32),
    F64(f64),
    Text(String),
    /// Elements of an array or a sequence.
    List(Vec<Value>),
    /// Fields of a message, in the order of its type.
    Message(Vec<Value>),
}

/// Bytes or values that do not fit a type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// The header is absent or of another representation.
    #[error("the header is not 00 01 (little-endian CDR)")]
    Header,
    /// The payload ends within a field.
    #[error("ends within `{0}`")]
    Truncated(&'static str),
    /// A length exceeds the payload or the type's bound.
    #[error("`{field}` states {length} elements, and only {room} are possible")]
    Length {
        /// Name of the field.
        field: &'static str,
        /// Stated length.
        length: u32,
        /// Bytes left, or the type's bound.
        room: usize,
    },
    /// A boolean is neither 0 nor 1, or a string is not UTF-8 with a zero at its end.
    #[error("`{0}` is not valid")]
    Invalid(&'static str),
    /// Bytes are left over.
    #[error("{0} bytes too many")]
    Rest(usize),
    /// A value is not of the field's type.
    #[error("the value of `{0}` is of another type")]
    Type(&'static str),
}

impl RosType {
    /// Encodes a message.
    ///
    /// # Errors
    /// [`CdrError::Type`] if the value is not one of this type.
    pub fn encode(self, message: &Value) -> Result<Vec<u8>, CdrError> {
        let mut writer = Writer { bytes: HEADER.to_vec() };
        writer.message(self, message, self.name())?;
        Ok(writer.bytes)
    }

    /// Decodes a message. Memory stays in proportion to the payload, whatever lengths it states.
    ///
    /// # Errors
    /// [`CdrError`] if the payload does not fit the type.
    pub fn decode(self, payload: &[u8]) -> Result<Value, CdrError> {
        let (header, body) = payload.split_first_chunk::<4>().ok_or(CdrError::Header)?;
        if header[..2] != HEADER[..2] {
            return Err(CdrError::Header);
        }
        let mut reader = Reader { body, at: 0 };
        let value = reader.message(self)?;
        let rest = body.len() - reader.at;
        if rest > PADDING { Err(CdrError::Rest(rest)) } else { Ok(value) }
    }
}

struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    fn message(&mut self, of: RosType, value: &Value, name: &'static str) -> Result<(), CdrError> {
        let fields = of.fields();
        let Value::Message(values) = value else { return Err(CdrError::Type(name)) };
        if values.len() != fields.len() {
            return Err(CdrError::Type(name));
        }
        fields.iter().zip(values).try_for_each(|(field, value)| self.field(field, value))
    }

    fn field(&mut self, Field { name, kind, count }: &Field, value: &Value) -> Result<(), CdrError> {
        if *count == Count::One {
            return self.element(*kind, value, name);
        }
        let Value::List(values) = value else { return Err(CdrError::Type(name)) };
        match count {
            Count::Array(length) if *length != values.len() => return Err(CdrError::Type(name)),
            Count::AtMost(most) if *most < values.len() => return Err(CdrError::Type(name)),
            Count::Array(_) | Count::One => {}
            Count::AtMost(_) | Count::Any => self.length(values.len(), name)?,
        }
        values.iter().try_for_each(|value| self.element(*kind, value, name))
    }

    fn element(&mut self, kind: Kind, value: &Value, name: &'static str) -> Result<(), CdrError> {
        match (kind, value) {
            (Kind::Bool, Value::Bool(value)) => self.bytes.push((*value).into()),
            (Kind::U8 { .. }, Value::U8(value)) => self.bytes.push(*value),
            (Kind::I32, Value::I32(value)) => self.number(value.to_le_bytes()),
            (Kind::U32, Value::U32(value)) => self.number(value.to_le_bytes()),
            (Kind::I64, Value::I64(value)) => self.number(value.to_le_bytes()),
            (Kind::F32, Value::F32(value)) => self.number(value.to_le_bytes()),
            (Kind::F64, Value::F64(value)) => self.number(value.to_le_bytes()),
            (Kind::Text, Value::Text(text)) => {
                self.length(text.len() + 1, name)?;
                self.bytes.extend(text.as_bytes());
                self.bytes.push(0);
            }
            (Kind::Nested(of), value) => self.message(of, value, name)?,
            _ => return Err(CdrError::Type(name)),
        }
        Ok(())
    }

    /// Appends a number at a multiple of its size behind the header.
    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let aligned = (self.bytes.len() - HEADER.len()).next_multiple_of(N) + HEADER.len();
        self.bytes.resize(aligned, 0);
        self.bytes.extend(bytes);
    }

    fn length(&mut self, length: usize, name: &'static str) -> Result<(), CdrError> {
        let length = u32::try_from(length).map_err(|_| CdrError::Type(name))?;
        self.number(length.to_le_bytes());
        Ok(())
    }
}

struct Reader<'a> {
    body: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn message(&mut self, of: RosType) -> Result<Value, CdrError> {
        of.fields().iter().map(|field| self.field(field)).collect::<Result<_, _>>().map(Value::Message)
    }

    fn field(&mut self, Field { name, kind, count }: &Field) -> Result<Value, CdrError> {
        let length = match count {
            Count::One => return self.element(*kind, name),
            Count::Array(length) => *length,
            Count::AtMost(most) => self.length(*most, name)?,
            Count::Any => self.length(usize::MAX, name)?,
        };
        (0..length).map(|_| self.element(*kind, name)).collect::<Result<_, _>>().map(Value::List)
    }

    fn element(&mut self, kind: Kind, name: &'static str) -> Result<Value, CdrError> {
        Ok(match kind {
            Kind::Bool => match self.number(name)? {
                [0] => Value::Bool(false),
                [1] => Value::Bool(true),
                _ => return Err(CdrError::Invalid(name)),
            },
            Kind::U8 { .. } => Value::U8(u8::from_le_bytes(self.number(name)?)),
            Kind::I32 => Value::I32(i32::from_le_bytes(self.number(name)?)),
            Kind::U32 => Value::U32(u32::from_le_bytes(self.number(name)?)),
            Kind::I64 => Value::I64(i64::from_le_bytes(self.number(name)?)),
            Kind::F32 => Value::F32(f32::from_le_bytes(self.number(name)?)),
            Kind::F64 => Value::F64(f64::from_le_bytes(self.number(name)?)),
            Kind::Text => Value::Text(self.text(name)?),
            Kind::Nested(of) => self.message(of)?,
        })
    }

    fn text(&mut self, name: &'static str) -> Result<String, CdrError> {
        let length = self.length(usize::MAX, name)?;
        let bytes = self.body.get(self.at..self.at + length).ok_or(CdrError::Truncated(name))?;
        self.at += length;
        // Some writers leave out the zero of an empty string.
        let text = if bytes.is_empty() { bytes } else { bytes.strip_suffix(&[0]).ok_or(CdrError::Invalid(name))? };
        String::from_utf8(text.to_vec()).map_err(|_| CdrError::Invalid(name))
    }

    fn number<const N: usize>(&mut self, name: &'static str) -> Result<[u8; N], CdrError> {
        let from = self.at.next_multiple_of(N);
        let bytes = self.body.get(from..).and_then(<[u8]>::first_chunk).ok_or(CdrError::Truncated(name))?;
        self.at = from + N;
        Ok(*bytes)
    }

    /// A length that the rest of the payload can hold: every element has at least one byte.
    fn length(&mut self, most: usize, name: &'static str) -> Result<usize, CdrError> {
        let length = u32::from_le_bytes(self.number(name)?);
        let room = most.min(self.body.len() - self.at);
        if length as usize > room {
            return Err(CdrError::Length { field: name, length, room });
        }
        Ok(length as usize)
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Value::Bool(value)
    }
}
impl From<i32> for Value {
    fn from(value: i32) -> Self {
        Value::I32(value)
    }
}
impl From<u32> for Value {
    fn from(value: u32) -> Self {
        Value::U32(value)
    }
}
impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Value::F64(value)
    }
}
impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Value::Text(text.to_owned())
    }
}
impl From<String> for Value {
    fn from(text: String) -> Self {
        Value::Text(text)
    }
}
impl<T: Into<Value>> FromIterator<T> for Value {
    fn from_iter<I: IntoIterator<Item = T>>(values: I) -> Self {
        Value::List(values.into_iter().map(Into::into).collect())
    }
}

/// The value of a message, from the values of its fields.
macro_rules! message {
    ($($field:expr),* $(,)?) => { $crate::ros2::Value::Message(vec![$($crate::ros2::Value::from($field)),*]) };
}
pub(super) use message;
