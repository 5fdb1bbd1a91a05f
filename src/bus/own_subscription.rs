//! Subscriptions of a session to what it publishes itself.

use zenoh::pubsub::Subscriber;
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use super::BusError;

/// A subscription to messages that the same session publishes. Other sessions never learn of it.
pub struct OwnSubscription(Subscriber<()>);

impl OwnSubscription {
    /// Subscribes to a key. `take` receives every payload on the publishing thread, so it must return at once.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn declare(session: &Session, key: &str, take: impl Fn(&[u8]) + Send + Sync + 'static) -> Result<Self, BusError> {
        let subscriber = session
            .declare_subscriber(key.to_owned())
            .allowed_origin(Locality::SessionLocal)
            .callback(move |sample| take(&sample.payload().to_bytes()))
            .wait();
        subscriber.map(OwnSubscription).map_err(BusError::failed)
    }

    /// Ends the subscription.
    ///
    /// # Errors
    /// [`BusError`] if zenoh refuses.
    pub fn close(self) -> Result<(), BusError> {
        self.0.undeclare().wait().map_err(BusError::failed)
    }
}
