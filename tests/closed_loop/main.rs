//! Closed loop over a real bus: setpoints, and lock-step.

mod advance;
#[path = "../common/mod.rs"]
mod common;
mod setpoint;
