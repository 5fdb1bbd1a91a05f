//! Encodings of payloads, and replies with one.

use zenoh::Wait;
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::query::Query;

/// The encoding `application/protobuf;SCHEMA`.
pub(super) fn protobuf(schema: &str) -> Encoding {
    Encoding::APPLICATION_PROTOBUF.with_schema(schema)
}

/// The encoding of a message type.
pub(super) fn protobuf_of<M: prost::Name>() -> Encoding {
    protobuf(&M::full_name())
}

/// Replies to a query.
pub(super) fn answer(query: &Query, key: &str, payload: impl Into<ZBytes>, encoding: Encoding) {
    if let Err(error) = query.reply(key, payload).encoding(encoding).wait() {
        tracing::warn!(key, %error, "could not reply");
    }
}
