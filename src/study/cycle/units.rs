//! Units of the quantities, in SI or dimensionless.

/// Units of values: powers of a length (m), a rate (rad/s) and a mass (kg).
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
pub(super) enum QuantityKind {
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

impl QuantityKind {
    /// Every kind with a suffix; none of the suffixes ends in another.
    const ALL: [QuantityKind; 11] = [
        QuantityKind::Angle,
        QuantityKind::Rate,
        QuantityKind::AngularAcceleration,
        QuantityKind::Length,
        QuantityKind::Velocity,
        QuantityKind::Acceleration,
        QuantityKind::Force,
        QuantityKind::Torque,
        QuantityKind::Energy,
        QuantityKind::Mass,
        QuantityKind::Inertia,
    ];

    /// Suffix of an SI column and its unit as people write it, suffix of a dimensionless column and what it is divided by.
    fn names(self) -> [&'static str; 4] {
        match self {
            QuantityKind::Number => ["", "", "", ""],
            QuantityKind::Angle => ["_rad", "rad", "_rad", "rad"],
            QuantityKind::Rate => ["_rad_per_s", "rad/s", "_over_omega", "/ ω"],
            QuantityKind::AngularAcceleration => ["_rad_per_s2", "rad/s²", "_over_omega2", "/ ω²"],
            QuantityKind::Length => ["_m", "m", "_over_l2", "/ l2"],
            QuantityKind::Velocity => ["_m_per_s", "m/s", "_over_l2_omega", "/ l2 ω"],
            QuantityKind::Acceleration => ["_m_per_s2", "m/s²", "_over_l2_omega2", "/ l2 ω²"],
            QuantityKind::Force => ["_n", "N", "_over_m3_l2_omega2", "/ m3 l2 ω²"],
            QuantityKind::Torque => ["_nm", "N·m", "_over_m3_l2_squared_omega2", "/ m3 l2² ω²"],
            QuantityKind::Energy => ["_j", "J", "_over_m3_l2_squared_omega2", "/ m3 l2² ω²"],
            QuantityKind::Mass => ["_kg", "kg", "_over_m3", "/ m3"],
            QuantityKind::Inertia => ["_kg_m2", "kg·m²", "_over_m3_l2_squared", "/ m3 l2²"],
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
            QuantityKind::Number | QuantityKind::Angle => 1.0,
            QuantityKind::Rate => rate,
            QuantityKind::AngularAcceleration => rate * rate,
            QuantityKind::Length => length,
            QuantityKind::Velocity => length * rate,
            QuantityKind::Acceleration => length * rate * rate,
            QuantityKind::Force => mass * length * rate * rate,
            QuantityKind::Torque | QuantityKind::Energy => mass * length * length * rate * rate,
            QuantityKind::Mass => mass,
            QuantityKind::Inertia => mass * length * length,
        };
        value / by + 0.0 // no −0
    }
}

/// The quantity of a column in words, and its unit: `m/s²`, or, if dimensionless, its divisor: `/ l2 ω²`.
pub fn words(column: &str) -> (String, &'static str) {
    let split = QuantityKind::ALL.iter().find_map(|kind| {
        let [si, unit, over, divisor] = kind.names();
        let si = column.strip_suffix(si).map(|stem| (stem, unit));
        si.or_else(|| column.strip_suffix(over).map(|stem| (stem, divisor)))
    });
    let (stem, unit) = split.unwrap_or((column, ""));
    let joint = |word: &str| if ["o", "a", "e"].contains(&word) { word.to_uppercase() } else { word.to_owned() };
    (stem.split('_').map(joint).collect::<Vec<_>>().join(" "), unit)
}
