//! Subscriptions of other sessions, as this session's own routing table lists them.

use std::collections::BTreeSet;
use std::time::Duration;

use zenoh::key_expr::KeyExpr;
use zenoh::{Session, Wait};

use super::BusError;

/// The session answers its own query at once; the timeout is for faults.
const TIMEOUT: Duration = Duration::from_millis(500);

/// Returns the number of other sessions with a subscription to any of `keys`. All sessions behind one router count as one, the
/// router's. The session must be opened with [`BusOptions::sees_subscriptions`](super::BusOptions::sees_subscriptions).
///
/// Call it rarely: if a declaration arrives while zenoh 1.10 answers from its tables, both wait for each other for ever
/// (<https://github.com/eclipse-zenoh/zenoh/pull/2619>).
///
/// # Errors
/// [`BusError`] if zenoh fails.
pub fn subscribed_sessions(session: &Session, keys: &[String]) -> Result<usize, BusError> {
    let own = session.zid().to_string();
    let prefix = format!("@/{own}/*/subscriber/");
    let replies = session.get(format!("{prefix}**")).timeout(TIMEOUT).wait().map_err(BusError::failed)?;
    let mut sessions = BTreeSet::new();
    while let Ok(reply) = replies.recv() {
        let Ok(sample) = reply.into_result() else { continue };
        let Some(key) = sample.key_expr().as_str().splitn(5, '/').nth(4).and_then(|key| KeyExpr::new(key.to_owned()).ok()) else {
            continue;
        };
        let wanted = keys.iter().any(|wanted| KeyExpr::new(wanted.as_str()).is_ok_and(|wanted| key.intersects(&wanted)));
        if wanted {
            let sources: Sources = serde_json::from_slice(&sample.payload().to_bytes()).unwrap_or_default();
            // A client's subscription is also listed as this session's own, which forwards it.
            sessions.extend(sources.sessions().filter(|session| *session != own));
        }
    }
    Ok(sessions.len())
}

/// Sessions that a subscription came from, as zenoh's administration space lists them.
#[derive(Debug, Default, serde::Deserialize)]
#[serde(default)]
struct Sources {
    routers: Vec<String>,
    peers: Vec<String>,
    clients: Vec<String>,
}

impl Sources {
    fn sessions(self) -> impl Iterator<Item = String> {
        self.routers.into_iter().chain(self.peers).chain(self.clients)
    }
}
