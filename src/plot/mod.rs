//! Pictures of numbers: figures and maps drawn from tables, as SVG and PNG, without any font of the system.
//!
//! ```
//! use flexcrank::plot::{Axis, Figure, Format, Picture};
//! let times: Vec<f64> = (0..100).map(|k| 0.1 * f64::from(k)).collect();
//! let sines: Vec<f64> = times.iter().map(|t| t.sin()).collect();
//! let figure = Figure::new("A sine", Axis::new("time", "s"), Axis::new("displacement", "m")).line("sin t", &times, &sines);
//! assert!(figure.render(Format::Png)?.starts_with(b"\x89PNG"));
//! # Ok::<(), flexcrank::plot::PlotError>(())
//! ```

mod animation;
mod band;
pub mod campaign;
mod canvas;
mod curve;
mod error;
mod figure;
mod frame;
mod heat_map;
mod joined;
mod legend;
mod lettering;
mod link_places;
mod mechanism;
mod mechanism_picture;
mod mode_shape;
mod numbered;
mod output;
mod overlay;
mod page;
mod panels;
mod playback;
mod quantity;
mod recorded;
mod recorded_motion;
mod rows;
mod selection;
mod session_time;
mod sheet;
pub mod stability;
mod strobe;
mod style;
pub mod thesis;
mod ticks;
mod time_range;
mod work_precision;

pub use canvas::{Lettering, escape};
pub use error::PlotError;
pub use figure::{Axis, Band, Figure, Mark, Numbered, Panel, Scale, Series};
pub use heat_map::{HeatMap, Key};
pub use link_places::{PlacedColumn, deflection_columns};
pub use mechanism_picture::MechanismPicture;
pub use mode_shape::mode_shape;
pub use output::{Format, PNG_SCALE, Picture};
pub use overlay::overlaid;
pub use page::{Entry, page};
pub use quantity::{axis as quantity, title as title_of_columns};
pub use recorded::{DEFLECTIONS, recorded, shade_levels};
pub use rows::SIMULATED_TIME;
pub use selection::{Named, add_name, add_under_full_name, column_name, figure, overview};
pub use session_time::{SESSION_TIME, add_session_time, time_column};
pub use time_range::{cut, recorded_time};
pub use work_precision::work_precision;
