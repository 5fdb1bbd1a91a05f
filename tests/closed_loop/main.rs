//! Closed loop over a real bus: setpoints.

#[path = "../common/mod.rs"]
mod common;
mod setpoint;
