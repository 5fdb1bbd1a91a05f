//! Studies: numbers in tables, for people and for plots. They run simulations; they know neither bus nor recordings.

pub mod cycle;
pub mod stability;
mod table;

pub use table::{Table, TableError};
