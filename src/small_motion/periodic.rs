//! Systems whose equations repeat after a period, and a driven mechanism as one of them.

use crate::integrate::{Power, Singular, System, Weights};
use crate::mechanics::{self, Input, Mechanism};

/// A [`System`] that hands out its tangent, so that small motion about a trajectory can be computed without differences.
pub trait PeriodicSystem: System {
    /// Hands the entries of `w.acceleration ∂r/∂a + w.velocity ∂r/∂v + w.position ∂r/∂q` to `entry(row, column, value)`.
    /// Entries of one place add up.
    fn tangent(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64));

    /// The constant torque that holds the mean speed, where it is unknown; `r` is affine in it.
    fn torque_nm(&mut self) -> Option<&mut f64> {
        None
    }
}

/// The drive of a crank that turns periodically.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CrankDrive {
    /// The crank's tangent turns at this speed; for a mechanism built with prescribed motion.
    Speed {
        /// Angle at `t = 0`.
        start_rad: f64,
        /// Speed, of either sign.
        speed_rad_per_s: f64,
    },
    /// The crank is free under this torque; for a mechanism built without prescribed motion.
    Torque {
        /// Constant torque, or the first guess of it.
        torque_nm: f64,
    },
}

/// A mechanism under a [`CrankDrive`], as the integrators see it.
pub struct DrivenMechanism<'a, M: ?Sized> {
    mechanism: &'a mut M,
    drive: CrankDrive,
}

impl<'a, M: Mechanism + ?Sized> DrivenMechanism<'a, M> {
    /// A mechanism and its drive.
    pub fn new(mechanism: &'a mut M, drive: CrankDrive) -> Self {
        Self { mechanism, drive }
    }

    /// Torque and prescribed motion at an instant.
    pub fn input(&self, time_s: f64) -> Input {
        match self.drive {
            CrankDrive::Speed { start_rad, speed_rad_per_s } => {
                let motion = [start_rad + speed_rad_per_s * time_s, speed_rad_per_s, 0.0];
                Input { time_s, torque_nm: 0.0, motion: Some(motion) }
            }
            CrankDrive::Torque { torque_nm } => Input { time_s, torque_nm, motion: None },
        }
    }
}

fn weights(w: Weights) -> mechanics::Weights {
    mechanics::Weights { acceleration: w.acceleration, velocity: w.velocity, position: w.position }
}

impl<M: Mechanism + ?Sized> System for DrivenMechanism<'_, M> {
    fn degrees_of_freedom(&self) -> usize {
        self.mechanism.degrees_of_freedom()
    }
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.mechanism.residual(&self.input(t_s), q, v, a, r);
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        self.mechanism.residual_size(r)
    }
    fn factor(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        self.mechanism.factor(&self.input(t_s), q, v, a, weights(w)).map_err(|mechanics::Singular| Singular)
    }
    fn solve(&mut self, x: &mut [f64]) {
        self.mechanism.solve(x);
    }
    fn power(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64]) -> Power {
        let [put_in_w, dissipated_w] = self.mechanism.power(&self.input(t_s), q, v, a);
        Power { put_in_w, dissipated_w }
    }
}

impl<M: Mechanism + ?Sized> PeriodicSystem for DrivenMechanism<'_, M> {
    fn tangent(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        self.mechanism.tangent(&self.input(t_s), q, v, a, weights(w), entry);
    }

    fn torque_nm(&mut self) -> Option<&mut f64> {
        match &mut self.drive {
            CrankDrive::Speed { .. } => None,
            CrankDrive::Torque { torque_nm } => Some(torque_nm),
        }
    }
}
