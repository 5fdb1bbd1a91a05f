//! flexcrank simulates planar mechanisms with flexible links in real time, puts their state on a zenoh bus, takes torque
//! pulses from it, and records every session to MCAP.
//!
//! The [`guide`] explains concepts, scenes, models, bus and recordings, a chapter each. `integrate` and `mechanics` don't know each
//! other.
//!
// The front page is also the guide's chapter `library`, from which its programs run as tests, once.
#![cfg_attr(not(doctest), doc = include_str!("guide/library.md"))]

pub mod bus;
pub mod cli;
pub mod files;
pub mod guide;
pub mod integrate;
pub mod mechanics;
mod nearest;
pub mod plot;
pub mod recording;
pub mod resimulation;
pub mod runtime;
pub mod scene;
pub mod service;
mod shown;
pub mod simulation;
pub mod study;
pub mod wire;
