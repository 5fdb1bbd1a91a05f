//! Recordings: in parts, with gaps, broken and recovered.

mod beginning;
mod commands;
#[path = "../common/mod.rs"]
mod common;
mod every_byte;
mod gaps;
mod hung_up;
mod killed;
mod limited;
mod mutated;
mod parts;
mod recovered;
mod recovered_chunks;
mod refused;
mod samples;
