//! Studies: numbers in tables, for people and for plots. They run simulations; they know neither bus nor recordings.

pub mod cycle;
mod table;
pub mod trade;

pub use table::{Table, TableError};
