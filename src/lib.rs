//! flexcrank simulates planar mechanisms with flexible links in real time, puts their state on a zenoh bus, takes torque
//! pulses from it, and records every session to MCAP.
//!
//! Layers, an arrow means *depends on*: `cli → {service, resimulation, study, plot} → {bus, recording, runtime} → {wire,
//! simulation} → {integrate, mechanics} → scene`; `integrate` and `mechanics` don't know each other.

pub mod bus;
pub mod cli;
pub mod integrate;
pub mod mechanics;
mod nearest;
pub mod plot;
pub mod recording;
pub mod resimulation;
pub mod runtime;
pub mod scene;
pub mod service;
pub mod simulation;
pub mod study;
pub mod wire;
