//! The ladder of models against references that were computed elsewhere (`tests/data/README.md`), laws and closed forms.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

mod assembled;
mod bench;
mod chains;
mod damped;
mod effort;
mod fixed_cost;
mod images;
mod internal_forces;
mod laws;
mod momentum;
mod orders;
mod periods;
mod references;
mod rigid_links;
mod statics;
mod table_ends;
mod tangent;
mod vibration;
mod works;
