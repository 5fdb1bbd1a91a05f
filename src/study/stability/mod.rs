//! Where the numbers break: the schemes on one mass, and a crank-slider at the extremes of everything that it is made of.
//!
//! [`schemes`](Scheme) compares the spectral radius of every integrator, as it runs, with theory. [`Plan`] lists the cells of
//! the extremes sweep, [`sweep`] runs them: every cell ends as one of the [`Category`]s.

mod base;
mod cell;
mod maps;
mod outcome;
mod plan;
mod report;
mod schemes;
mod sweep;
mod trajectory;

pub use base::{Base, NotSuited};
pub use cell::BOUND;
pub use maps::Extent;
pub use outcome::{Category, Outcome};
pub use plan::{Axis, Cell, Map, NoMap, Plan, Spacing};
pub use report::{causes, counts, grid, table, write_ends};
pub use schemes::{Scheme, order_table, radius_table};
pub use sweep::{Swept, sweep};
