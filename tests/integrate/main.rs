//! The integrators on problems that are not beams.
#![allow(clippy::unwrap_used)]

mod laws;
mod order;
mod problems;
mod refusals;
mod spectral_radius;
mod thesis;
