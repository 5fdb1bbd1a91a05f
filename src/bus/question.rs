//! Queries that take time to answer.

use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::BusError;
use super::encoding::answer;

/// A query that waits for its answer; one that is dropped stays without.
pub struct Question {
    query: Query,
    key: String,
}

impl Question {
    /// The value of a parameter, as in `?count=8`.
    pub fn parameter(&self, name: &str) -> Option<&str> {
        self.query.parameters().get(name)
    }

    /// Answers with JSON.
    pub fn answer_json(self, json: Vec<u8>) {
        answer(&self.query, &self.key, json, Encoding::APPLICATION_JSON);
    }

    /// Refuses, with the reason.
    pub fn refuse(self, why: &str) {
        if let Err(error) = self.query.reply_err(why).encoding(Encoding::TEXT_PLAIN).wait() {
            tracing::warn!(key = self.key, %error, "could not reply");
        }
    }
}

/// Receives questions on a key. `take` must return at once.
pub(super) fn receive(
    session: &Session,
    key: String,
    take: impl Fn(Question) + Send + Sync + 'static,
) -> Result<Queryable<()>, BusError> {
    let own = key.clone();
    let callback = move |query: Query| take(Question { query, key: own.clone() });
    session.declare_queryable(key).callback(callback).wait().map_err(BusError::failed)
}
