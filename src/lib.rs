//! flexcrank simulates planar mechanisms with flexible links in real time, puts their state on a zenoh bus, takes torque
//! pulses from it, and records every session to MCAP.
//!
//! The [`guide`] explains concepts, scenes, models, bus and recordings, a chapter each. `integrate` and `mechanics` don't know each
//! other.
//!
// The front page is also the guide's chapter `library`, from which its programs run as tests, once.
#![cfg_attr(not(doctest), doc = include_str!("guide/library.md"))]

#[cfg(feature = "service")]
pub mod bus;
#[cfg(feature = "service")]
mod claim;
#[cfg(feature = "service")]
pub mod cli;
#[cfg(feature = "service")]
mod csv_faults;
mod decimal_comma;
#[cfg(feature = "service")]
pub mod files;
#[cfg(feature = "foxglove")]
pub mod foxglove;
#[cfg(feature = "service")]
pub mod guide;
pub mod integrate;
pub mod mechanics;
#[cfg(feature = "service")]
mod mesh_places;
mod nearest;
mod percent;
#[cfg(feature = "service")]
pub mod plot;
#[cfg(feature = "service")]
pub mod recording;
mod repeated_table;
#[cfg(feature = "service")]
pub mod resimulation;
#[cfg(feature = "service")]
pub mod ros2;
#[cfg(feature = "service")]
pub mod runtime;
pub mod scene;
#[cfg(feature = "service")]
pub mod service;
mod shown;
pub mod simulation;
pub mod small_motion;
#[cfg(feature = "service")]
pub mod study;
mod text_file;
#[cfg(feature = "service")]
mod whole_file;
#[cfg(feature = "service")]
pub mod wire;
