//! Studies: numbers in tables, for people and for plots. They run simulations; they know neither bus nor recordings, of which `sweep` takes only the Parquet writer.

pub mod cycle;
pub mod fixed_cost;
mod history;
mod panic_message;
mod shortening;
pub mod stability;
pub mod sweep;
mod table;
pub mod trade;

pub use history::{HistoryError, history};
pub use shortening::{MATTERS, NoShortening, Shortening, shortenings};
pub use table::{Table, TableError};
