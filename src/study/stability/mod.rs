//! Where the numerics break down: the schemes on one mass, and a crank-slider at the extremes of its parameters.
//!
//! [`schemes`](Scheme) compares the spectral radius of every running integrator with theory, without damping and on the whole
//! left half-plane. [`MapPlan`] lists the cells of the extremes sweep, [`sweep`] runs them: every cell ends in one [`Category`], and those that
//! fail are told apart by a [`Label`].

mod base_scene;
mod cell;
mod damping;
mod label;
mod labelling;
mod left_half_plane;
mod maps;
mod methods;
mod outcome;
mod plan;
mod quantity;
mod report;
mod schemes;
mod sweep;
mod switches;
mod trajectory;

pub use base_scene::{BaseScene, NotSuited};
pub use cell::BOUND;
pub use label::Label;
pub use left_half_plane::{Point, ROUNDING, left_half_plane_table};
pub use maps::Extent;
pub use outcome::{Category, Outcome};
pub use plan::{Axis, Cell, Map, MapPlan, Measure, NoMap, Spacing, Switch};
pub use quantity::Quantity;
pub use report::{FailsFiner, causes, counts, fails_finer, fails_finer_table, grid, labels, refusals, table, write_ends};
pub use schemes::{Scheme, order_table, radius_table};
pub use sweep::{Swept, sweep};
