//! Studies: numbers in tables, for people and for plots. They run simulations; they know neither bus nor recordings, of which `sweep` takes only the writers of tables.

mod at_rest;
pub mod cycle;
mod duration;
pub mod fixed_cost;
mod history;
mod panic_message;
mod shortening;
pub mod stability;
pub mod sweep;
mod table;
pub mod trade;

pub use at_rest::is_at_rest;
pub use duration::{two_turns_s, usual_until_s};
pub use history::{HistoryError, history};
pub use shortening::{MATTERS, NEGLIGIBLE, NoShortening, STROKE_MATTERS, Shortening, shortenings, shortenings_until};
pub use table::{Table, TableError};
