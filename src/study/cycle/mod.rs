//! One turn of a rigid crank-slider at a given speed: kinematics, joint forces, torque, balance (thesis chapter 4).
//!
//! Links are taken as rigid whatever model the scene runs with; its gravity, base spring, damper and friction are kept. Masses,
//! centres and inertias are the scene's own or come from the links' sections. Kinematics and forces are those of
//! [`Rigid`](crate::mechanics::Rigid), the model that also runs.
//!
//! ```
//! use flexcrank::{scene::SceneSource, study::cycle};
//! let source = SceneSource::open("thesis-compressor", &[])?;
//! let options = cycle::Options { ratios: vec![0.1, 0.25, 0.5], dimensionless: true, ..Default::default() };
//! let table = cycle::cycle(&source, &options)?;
//! assert_eq!(table.rows(), 3 * options.points);
//! let least = table.column("piston_acceleration_over_l2_omega2").unwrap()[0];
//! assert!((least + 0.1 * 1.1).abs() < 1e-15); // at θ = 0, λ = 0.1: −λ (1 + λ)
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Columns
//!
//! [`cycle`] gives one row an angle, ratio after ratio, with these columns; a name is a stem and a suffix that says its unit.
//! Dimensionless, the suffix says what the value is divided by: `l2` the rod's length, `m3` the slider's mass, `omega` the
//! crank's rate at the beginning of the turn. [`words`] takes a name apart again.
//!
//! | stem | SI | dimensionless | what |
//! |---|---|---|---|
//! | `ratio` | – | – | `λ = l₁/l₂` |
//! | `crank_angle` | `_rad` | `_rad` | `θ`, from 0 to a full turn in the direction of motion, both ends included |
//! | `crank_rate` | `_rad_per_s` | `_over_omega` | `θ̇` |
//! | `rod_angle` | `_rad` | `_rad` | `−φ`: counter-clockwise from x, as `chord_rad` on the bus; the thesis's `φ` is clockwise |
//! | `rod_rate` | `_rad_per_s` | `_over_omega` | `−φ̇` |
//! | `rod_acceleration` | `_rad_per_s2` | `_over_omega2` | `−φ̈` |
//! | `piston_position`, `piston_velocity`, `piston_acceleration` | `_m`, `_m_per_s`, `_m_per_s2` | `_over_l2`, `_over_l2_omega`, `_over_l2_omega2` | `x_E`, `v_E`, `a_E` |
//! | `centre_of_mass_x`, `…_y`, `centre_of_mass_velocity_x`, `…_y`, `centre_of_mass_acceleration_x`, `…_y` | the same | the same | of crank, rod and slider together |
//! | `force_o_x`, `force_o_y` | `_n` | `_over_m3_l2_omega2` | of the ground on the crank, at O |
//! | `force_a_x`, `force_a_y` | `_n` | the same | of the crank on the rod, at A |
//! | `force_e_x`, `force_e_y` | `_n` | the same | of the rod on the slider, at E |
//! | `guide_force` | `_n` | the same | of the guide on the slider, along +y |
//! | `resistance` | `_n` | the same | `F_E` on the slider, positive along −x |
//! | `shaking_force_x`, `shaking_force_y` | `_n` | the same | on the frame: minus total mass times the centre's acceleration |
//! | `driving_torque` | `_nm` | `_over_m3_l2_squared_omega2` | `M_O` on the crank |
//! | `kinetic_energy` | `_j` | the same | of all three bodies |

mod balance;
mod columns;
mod error;
mod extremes;
mod machine;
mod options;
mod setup;
mod sweep;
mod units;

pub use balance::{Arms, balance};
pub use error::CycleError;
pub use extremes::{Extreme, ExtremeValue, Extremes, extremes};
pub use options::Options;
pub use setup::speed_rad_per_s;
pub use sweep::{ratios_between, sweep};
pub use units::words;

use super::Table;
use crate::scene::SceneSource;
use setup::Setup;

/// One turn for every ratio asked for, as the columns above.
///
/// # Errors
/// [`CycleError`] when the scene is no crank-slider or the options don't suit it.
pub fn cycle(source: &SceneSource, options: &Options) -> Result<Table, CycleError> {
    let mut table = columns::Writer::default();
    for setup in Setup::all(source, options)? {
        let units = setup.units(options.dimensionless)?;
        for instant in setup.turn(options.points) {
            table.row(&setup, &instant, &units);
        }
    }
    Ok(table.finish(options.dimensionless))
}
