//! Subscriptions of other sessions, as this session's own routing table lists them.

use std::collections::BTreeSet;
use std::time::Duration;

use zenoh::key_expr::KeyExpr;
use zenoh::{Session, Wait};

use super::BusError;

/// The session answers its own query at once; the timeout is for faults.
const TIMEOUT: Duration = Duration::from_millis(500);

/// The subscriptions that match some keys.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Subscriptions {
    /// Session and key expression of each.
    subscriptions: BTreeSet<(String, String)>,
}

impl Subscriptions {
    /// Number of sessions with at least one of the subscriptions.
    pub fn sessions(&self) -> usize {
        self.subscriptions.iter().map(|(session, _)| session).collect::<BTreeSet<_>>().len()
    }
}

/// Returns the subscriptions of other sessions to any of `keys`. All sessions behind one router count as one, the router's.
///
/// The session must be opened with [`BusOptions::sees_subscriptions`](super::BusOptions::sees_subscriptions).
///
/// # Errors
/// [`BusError`] if zenoh fails.
pub fn subscriptions(session: &Session, keys: &[String]) -> Result<Subscriptions, BusError> {
    let own = session.zid().to_string();
    let prefix = format!("@/{own}/*/subscriber/");
    let replies = session.get(format!("{prefix}**")).timeout(TIMEOUT).wait().map_err(BusError::failed)?;
    let mut subscriptions = BTreeSet::new();
    while let Ok(reply) = replies.recv() {
        let Ok(sample) = reply.into_result() else { continue };
        let Some(key) = sample.key_expr().as_str().splitn(5, '/').nth(4).and_then(|key| KeyExpr::new(key.to_owned()).ok()) else {
            continue;
        };
        let wanted = keys.iter().any(|wanted| KeyExpr::new(wanted.as_str()).is_ok_and(|wanted| key.intersects(&wanted)));
        if wanted {
            let sources: Sources = serde_json::from_slice(&sample.payload().to_bytes()).unwrap_or_default();
            // A client's subscription is also listed as this session's own, which forwards it.
            let others = sources.sessions().filter(|session| *session != own);
            subscriptions.extend(others.map(|session| (session, key.to_string())));
        }
    }
    Ok(Subscriptions { subscriptions })
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
