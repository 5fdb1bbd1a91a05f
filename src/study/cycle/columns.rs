//! Names, units and values of the columns.

use super::machine::Instant;
use super::setup::Setup;
use crate::study::Table;

/// What values are divided by: powers of a length (m), a rate (rad/s) and a mass (kg).
#[derive(Debug, Clone, Copy)]
pub(super) struct Units {
    pub length: f64,
    pub rate: f64,
    pub mass: f64,
}

impl Units {
    pub const SI: Units = Units { length: 1.0, rate: 1.0, mass: 1.0 };
}

/// The kind of a quantity, which settles its unit.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Number,
    Angle,
    Rate,
    AngularAcceleration,
    Length,
    Velocity,
    Acceleration,
    Force,
    Torque,
    Energy,
    Mass,
    Inertia,
}

impl Kind {
    /// Every kind with a suffix; none of the suffixes ends in another.
    const ALL: [Kind; 11] = [
        Kind::Angle,
        Kind::Rate,
        Kind::AngularAcceleration,
        Kind::Length,
        Kind::Velocity,
        Kind::Acceleration,
        Kind::Force,
        Kind::Torque,
        Kind::Energy,
        Kind::Mass,
        Kind::Inertia,
    ];

    /// Suffix of an SI column and its unit as people write it, suffix of a dimensionless column and what it is divided by.
    fn names(self) -> [&'static str; 4] {
        match self {
            Kind::Number => ["", "", "", ""],
            Kind::Angle => ["_rad", "rad", "_rad", "rad"],
            Kind::Rate => ["_rad_per_s", "rad/s", "_over_omega", "/ ω"],
            Kind::AngularAcceleration => ["_rad_per_s2", "rad/s²", "_over_omega2", "/ ω²"],
            Kind::Length => ["_m", "m", "_over_l2", "/ l2"],
            Kind::Velocity => ["_m_per_s", "m/s", "_over_l2_omega", "/ l2 ω"],
            Kind::Acceleration => ["_m_per_s2", "m/s²", "_over_l2_omega2", "/ l2 ω²"],
            Kind::Force => ["_n", "N", "_over_m3_l2_omega2", "/ m3 l2 ω²"],
            Kind::Torque => ["_nm", "N·m", "_over_m3_l2_squared_omega2", "/ m3 l2² ω²"],
            Kind::Energy => ["_j", "J", "_over_m3_l2_squared_omega2", "/ m3 l2² ω²"],
            Kind::Mass => ["_kg", "kg", "_over_m3", "/ m3"],
            Kind::Inertia => ["_kg_m2", "kg·m²", "_over_m3_l2_squared", "/ m3 l2²"],
        }
    }

    /// The name of a column of this kind.
    pub fn column(self, stem: &str, dimensionless: bool) -> String {
        let [si, _, over, _] = self.names();
        format!("{stem}{}", if dimensionless { over } else { si })
    }

    /// `value` in these units.
    pub fn scaled(self, value: f64, units: &Units) -> f64 {
        let Units { length, rate, mass } = *units;
        let by = match self {
            Kind::Number | Kind::Angle => 1.0,
            Kind::Rate => rate,
            Kind::AngularAcceleration => rate * rate,
            Kind::Length => length,
            Kind::Velocity => length * rate,
            Kind::Acceleration => length * rate * rate,
            Kind::Force => mass * length * rate * rate,
            Kind::Torque | Kind::Energy => mass * length * length * rate * rate,
            Kind::Mass => mass,
            Kind::Inertia => mass * length * length,
        };
        value / by + 0.0 // no −0
    }
}

/// What a column holds, in words, and its unit: `m/s²`, or, dimensionless, what it is divided by: `/ l2 ω²`.
pub fn words(column: &str) -> (String, &'static str) {
    let split = Kind::ALL.iter().find_map(|kind| {
        let [si, unit, over, divisor] = kind.names();
        let si = column.strip_suffix(si).map(|stem| (stem, unit));
        si.or_else(|| column.strip_suffix(over).map(|stem| (stem, divisor)))
    });
    let (stem, unit) = split.unwrap_or((column, ""));
    let joint = |word: &str| if ["o", "a", "e"].contains(&word) { word.to_uppercase() } else { word.to_owned() };
    (stem.split('_').map(joint).collect::<Vec<_>>().join(" "), unit)
}

type Column = (&'static str, Kind, fn(&Setup, &Instant) -> f64);

const COLUMNS: [Column; 27] = [
    ("ratio", Kind::Number, |setup, _| setup.ratio),
    ("crank_angle", Kind::Angle, |_, now| now.crank[0]),
    ("crank_rate", Kind::Rate, |_, now| now.crank[1]),
    ("rod_angle", Kind::Angle, |_, now| now.rod[0]),
    ("rod_rate", Kind::Rate, |_, now| now.rod[1]),
    ("rod_acceleration", Kind::AngularAcceleration, |_, now| now.rod[2]),
    ("piston_position", Kind::Length, |_, now| now.piston[0]),
    ("piston_velocity", Kind::Velocity, |_, now| now.piston[1]),
    ("piston_acceleration", Kind::Acceleration, |_, now| now.piston[2]),
    ("centre_of_mass_x", Kind::Length, |_, now| now.centre[0][0]),
    ("centre_of_mass_y", Kind::Length, |_, now| now.centre[0][1]),
    ("centre_of_mass_velocity_x", Kind::Velocity, |_, now| now.centre[1][0]),
    ("centre_of_mass_velocity_y", Kind::Velocity, |_, now| now.centre[1][1]),
    ("centre_of_mass_acceleration_x", Kind::Acceleration, |_, now| now.centre[2][0]),
    ("centre_of_mass_acceleration_y", Kind::Acceleration, |_, now| now.centre[2][1]),
    ("force_o_x", Kind::Force, |_, now| now.o[0]),
    ("force_o_y", Kind::Force, |_, now| now.o[1]),
    ("force_a_x", Kind::Force, |_, now| now.a[0]),
    ("force_a_y", Kind::Force, |_, now| now.a[1]),
    ("force_e_x", Kind::Force, |_, now| now.e[0]),
    ("force_e_y", Kind::Force, |_, now| now.e[1]),
    ("guide_force", Kind::Force, |_, now| now.guide),
    ("resistance", Kind::Force, |_, now| now.resistance),
    ("shaking_force_x", Kind::Force, |_, now| now.shaking[0]),
    ("shaking_force_y", Kind::Force, |_, now| now.shaking[1]),
    ("driving_torque", Kind::Torque, |_, now| now.torque),
    ("kinetic_energy", Kind::Energy, |_, now| now.kinetic),
];

/// Rows becoming a table.
#[derive(Default)]
pub(super) struct Writer {
    columns: [Vec<f64>; COLUMNS.len()],
}

impl Writer {
    pub fn row(&mut self, setup: &Setup, now: &Instant, units: &Units) {
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
