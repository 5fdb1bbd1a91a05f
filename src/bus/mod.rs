//! The bus: key expressions, sessions, services and clients. Only this layer and `ros2` use zenoh.

mod about;
mod address;
pub mod client;
mod commands;
mod encoding;
mod error;
mod keys;
mod log_time;
mod name_claim;
mod own_subscription;
mod question;
mod raw_publisher;
mod refusal_log;
mod service_endpoint;
mod session;
mod snapshot_cache;
mod subscription_state;
mod subscriptions;
mod topic_queue;
mod zenoh_messages;

pub use crate::wire::Topic;
pub use about::About;
pub use address::{Address, BadAddress};
pub(crate) use commands::admitted;
pub use commands::{CommandKey, replay_commands, service_commands};
pub use error::BusError;
pub use keys::{BadName, Name, ROOT, key_of_topic};
pub use log_time::LogTime;
pub use name_claim::NameClaim;
pub use own_subscription::OwnSubscription;
pub use question::Question;
pub use raw_publisher::{RawPublisher, check_encoding};
pub(crate) use refusal_log::RefusalLog;
pub use service_endpoint::ServiceEndpoint;
pub use session::BusOptions;
pub use snapshot_cache::SnapshotEntry;
pub use subscriptions::subscribed_sessions;
pub use topic_queue::TopicQueue;
/// An open session on the bus.
pub use zenoh::Session;

/// Closes a session after everything published has been sent.
///
/// # Errors
/// [`BusError`] if zenoh refuses.
pub fn close(session: &Session) -> Result<(), BusError> {
    use zenoh::Wait;
    session.close().wait().map_err(BusError::failed)
}
