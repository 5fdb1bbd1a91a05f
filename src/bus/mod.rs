//! The bus: key expressions, sessions, services and clients. The only layer that names zenoh.

mod address;
mod audience;
pub mod client;
mod complaints;
mod demand;
mod endpoint;
mod error;
mod keys;
mod latest;
mod outlet;
mod remote;
mod session;

pub use address::{Address, BadAddress};
pub use audience::{Listening, audience};
pub use endpoint::Endpoint;
pub use error::BusError;
pub use keys::{BadName, Name, ROOT, Topic, of_topic};
pub use latest::Kept;
pub use outlet::Outlet;
pub use remote::Remote;
pub use session::BusOptions;
/// An open session on the bus.
pub use zenoh::Session;

/// Closes a session, waiting until everything that was put is on its way.
///
/// # Errors
/// [`BusError`] when zenoh refuses.
pub fn close(session: &Session) -> Result<(), BusError> {
    use zenoh::Wait;
    session.close().wait().map_err(BusError::failed)
}
