//! Publishing of recorded bytes, with the encoding that the recording states.

use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use super::BusError;

/// Length limit of an encoding's name beside zenoh's own, bytes.
const ENCODING_LIMIT: usize = 255;

/// Checks that zenoh can carry an encoding with its schema name.
///
/// # Errors
/// Returns why it cannot.
pub fn check_encoding(encoding: &str, schema: Option<&str>) -> Result<(), String> {
    let schema = schema.map_or(0, str::len);
    // Encodings that zenoh knows are numbers to it; others are text.
    let named = if known_encoding(encoding).is_some() { schema } else { format!("application/{encoding};").len() + schema };
    match named {
        0..=ENCODING_LIMIT => Ok(()),
        bytes => Err(format!("the bus carries encoding and schema of at most {ENCODING_LIMIT} bytes, and these have {bytes}")),
    }
}

/// A publisher of recorded bytes. It waits for a slow subscriber and drops nothing.
pub struct RawPublisher {
    publisher: Publisher<'static>,
}

impl RawPublisher {
    /// Declares a publisher under a key, with the encoding and schema name that the recording states.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn declare(session: &Session, key: &str, encoding: &str, schema: Option<&str>) -> Result<Self, BusError> {
        let publisher = session
            .declare_publisher(key.to_owned())
            .encoding(zenoh_encoding(encoding, schema))
            .congestion_control(CongestionControl::Block)
            .wait()
            .map_err(BusError::failed)?;
        Ok(RawPublisher { publisher })
    }

    /// Publishes a payload, with its sequence number as attachment if it is a message of a service.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn put(&self, payload: &[u8], number: Option<u64>) -> Result<(), BusError> {
        let publication = self.publisher.put(payload).attachment(number.map(|number| number.to_le_bytes().to_vec()));
        publication.wait().map_err(BusError::failed)
    }

    /// Whether anyone subscribes.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn has_subscribers(&self) -> Result<bool, BusError> {
        self.publisher.matching_status().wait().map(|status| status.matching()).map_err(BusError::failed)
    }
}

fn known_encoding(encoding: &str) -> Option<Encoding> {
    match encoding {
        "protobuf" => Some(Encoding::APPLICATION_PROTOBUF),
        "json" => Some(Encoding::APPLICATION_JSON),
        "cbor" => Some(Encoding::APPLICATION_CBOR),
        "cdr" => Some(Encoding::APPLICATION_CDR),
        "" => Some(Encoding::ZENOH_BYTES),
        _ => None,
    }
}

/// Returns zenoh's name of an MCAP message encoding.
fn zenoh_encoding(encoding: &str, schema: Option<&str>) -> Encoding {
    let encoding = known_encoding(encoding).unwrap_or_else(|| Encoding::from(format!("application/{encoding}")));
    match schema {
        Some(schema) if !schema.is_empty() => encoding.with_schema(schema),
        _ => encoding,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_encodings_are_named_as_zenoh_names_them() {
        let named = |encoding, schema| zenoh_encoding(encoding, schema).to_string();
        assert_eq!(named("protobuf", Some("flexcrank.v1.Loads")), "application/protobuf;flexcrank.v1.Loads");
        assert_eq!(named("cdr", Some("sensor_msgs/msg/Image")), "application/cdr;sensor_msgs/msg/Image");
        assert_eq!(named("json", None), "application/json");
        assert_eq!(named("flatbuffer", Some("Pose")), "application/flatbuffer;Pose");
    }

    #[test]
    fn val_long_names_of_encodings_are_refused() {
        for (encoding, schema, carried) in
            [("protobuf", 255, true), ("protobuf", 256, false), ("flatbuffer", 232, true), ("flatbuffer", 233, false)]
        {
            let schema = "s".repeat(schema);
            assert_eq!(check_encoding(encoding, Some(&schema)).is_ok(), carried, "{encoding} {}", schema.len());
        }
    }
}
