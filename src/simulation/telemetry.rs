//! Parts of a sample, each published at its own rate.

use super::rate::PublishRate;

/// A value for each part of a sample that is published on a topic of its own.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PerTelemetry<T> {
    /// State of every node.
    pub displacements: T,
    /// Angles of the links.
    pub angles: T,
    /// Loads and forces; the driving torque is the mean since the previous message, of a prescribed motion that of the instant.
    pub loads: T,
    /// Energies and works.
    pub energies: T,
}

/// Publishing rates.
pub type PublishRates = PerTelemetry<PublishRate>;

impl<T: Copy> From<T> for PerTelemetry<T> {
    fn from(all: T) -> Self {
        PerTelemetry { displacements: all, angles: all, loads: all, energies: all }
    }
}

impl<T> PerTelemetry<T> {
    /// Maps every value.
    pub fn map<U>(self, map: impl Fn(T) -> U) -> PerTelemetry<U> {
        PerTelemetry {
            displacements: map(self.displacements),
            angles: map(self.angles),
            loads: map(self.loads),
            energies: map(self.energies),
        }
    }

    /// Pairs the values with those of `other`.
    pub fn zip<U>(self, other: PerTelemetry<U>) -> PerTelemetry<(T, U)> {
        PerTelemetry {
            displacements: (self.displacements, other.displacements),
            angles: (self.angles, other.angles),
            loads: (self.loads, other.loads),
            energies: (self.energies, other.energies),
        }
    }
}
