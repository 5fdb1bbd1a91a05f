//! A server for Foxglove and Lichtblick, over WebSocket: a client of the services in its own process, like any other on the bus.
//!
//! It subscribes to a topic while a viewer does, and hands each payload on as it is. Commands of viewers go over the bus, so that
//! limits, receipts and recordings hold for them. The stepping thread knows nothing of it.

mod commander;
mod error;
mod feed;
mod jobs;
mod listener;
mod parameters;
mod playback;
mod requests;
mod scene_keys;
mod server;
mod services;
mod source;
mod status_log;

pub use error::FoxgloveError;
pub use playback::Timeline;
pub use server::{FoxgloveServer, ServerOptions};
pub use source::{Source, Topic};
