//! Names and values of the columns.

use super::machine::CycleInstant;
use super::setup::Setup;
use super::units::{QuantityKind, Units};
use crate::study::Table;

// The thesis counts the rod's angle φ clockwise; columns count it counter-clockwise, as the bus and recordings do.
type Column = (&'static str, QuantityKind, fn(&Setup, &CycleInstant) -> f64);

const COLUMNS: [Column; 27] = [
    ("ratio", QuantityKind::Number, |setup, _| setup.ratio),
    ("crank_angle", QuantityKind::Angle, |_, now| now.crank[0]),
    ("crank_rate", QuantityKind::Rate, |_, now| now.crank[1]),
    ("rod_angle", QuantityKind::Angle, |_, now| 0.0 - now.rod[0]),
    ("rod_rate", QuantityKind::Rate, |_, now| 0.0 - now.rod[1]),
    ("rod_acceleration", QuantityKind::AngularAcceleration, |_, now| 0.0 - now.rod[2]),
    ("piston_position", QuantityKind::Length, |_, now| now.piston[0]),
    ("piston_velocity", QuantityKind::Velocity, |_, now| now.piston[1]),
    ("piston_acceleration", QuantityKind::Acceleration, |_, now| now.piston[2]),
    ("centre_of_mass_x", QuantityKind::Length, |_, now| now.centre[0][0]),
    ("centre_of_mass_y", QuantityKind::Length, |_, now| now.centre[0][1]),
    ("centre_of_mass_velocity_x", QuantityKind::Velocity, |_, now| now.centre[1][0]),
    ("centre_of_mass_velocity_y", QuantityKind::Velocity, |_, now| now.centre[1][1]),
    ("centre_of_mass_acceleration_x", QuantityKind::Acceleration, |_, now| now.centre[2][0]),
    ("centre_of_mass_acceleration_y", QuantityKind::Acceleration, |_, now| now.centre[2][1]),
    ("force_o_x", QuantityKind::Force, |_, now| now.o[0]),
    ("force_o_y", QuantityKind::Force, |_, now| now.o[1]),
    ("force_a_x", QuantityKind::Force, |_, now| now.a[0]),
    ("force_a_y", QuantityKind::Force, |_, now| now.a[1]),
    ("force_e_x", QuantityKind::Force, |_, now| now.e[0]),
    ("force_e_y", QuantityKind::Force, |_, now| now.e[1]),
    ("guide_force", QuantityKind::Force, |_, now| now.guide),
    ("resistance", QuantityKind::Force, |_, now| now.resistance),
    ("shaking_force_x", QuantityKind::Force, |_, now| now.shaking[0]),
    ("shaking_force_y", QuantityKind::Force, |_, now| now.shaking[1]),
    ("driving_torque", QuantityKind::Torque, |_, now| now.torque),
    ("kinetic_energy", QuantityKind::Energy, |_, now| now.kinetic),
];

/// Rows becoming a table.
#[derive(Default)]
pub(super) struct Writer {
    columns: [Vec<f64>; COLUMNS.len()],
}

impl Writer {
    pub fn row(&mut self, setup: &Setup, now: &CycleInstant, units: &Units) {
        for ((_, kind, value), column) in COLUMNS.iter().zip(&mut self.columns) {
            column.push(kind.scaled(value(setup, now), units));
        }
    }

    pub fn finish(self, dimensionless: bool) -> Table {
        let mut table = Table::default();
        for ((stem, kind, _), values) in COLUMNS.iter().zip(self.columns) {
            table.push(kind.column(stem, dimensionless), values);
        }
        table
    }
}
