//! States of rest at an angle and of steady rotation.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::linearised::Linearised;
use super::masses_at_rest::masses_at_rest;
use super::point::Point;
use super::{NoModes, Subject};
use crate::mechanics::{Input, Mechanism};

/// Relative residual at which steady rotation is found.
const TOLERANCE: f64 = 1e-10;
/// A correction below this part of the largest coordinate is rounding.
const ROUNDING: f64 = 1e-11;
/// Most of Newton's steps towards it.
const STEPS: usize = 40;
/// Angles of a turn at which its torque is computed.
const TURN: u32 = 64;

impl Subject {
    /// At rest with the first link's tangent at `angle_rad`, bent by weight and constant loads; a torque that is part of the point
    /// balances them there. The masses of an oscillator are where its springs balance its forces, or
    /// at its start where nothing does.
    ///
    /// # Errors
    /// [`NoModes::NoEquilibrium`] where no such state is found.
    pub fn at_rest(&self, angle_rad: f64) -> Result<Point, NoModes> {
        let held = self.is_held().then_some([angle_rad, 0.0, 0.0]);
        let input = Input { motion: held, ..Input::default() };
        let mut unsprung = self.starting_at(angle_rad);
        let n = unsprung.degrees_of_freedom();
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        unsprung.start(&input, &mut q, &mut v).map_err(|_| NoModes::NoEquilibrium { angle_deg: angle_rad.to_degrees() })?;
        v.fill(0.0);
        q = self.masses().and_then(masses_at_rest).unwrap_or(q);
        let mut point = Point { input, q, a: v.clone(), v, speed_rad_per_s: 0.0 };
        self.balance(&mut point);
        Ok(point)
    }

    /// The constant torque that puts into a turn what friction and resistance take from it, were the links rigid and the speed constant:
    /// `∮ (dissipated − put in) dt / 2π`, by the trapezoidal rule.
    ///
    /// # Errors
    /// [`NoModes::NoEquilibrium`] where links do not stand at rest at an angle of the turn.
    pub(super) fn mean_torque_nm(&self, speed_rad_per_s: f64) -> Result<f64, NoModes> {
        let mut mechanism = self.mechanism();
        let mut taken_w = 0.0;
        for k in 0..TURN {
            let mut point = self.at_rest(TAU * f64::from(k) / f64::from(TURN))?;
            point.input.torque_nm = 0.0;
            let Point { input, q, v, a, .. } = &mut point;
            mechanism.rigid_motion(input, speed_rad_per_s, q, v, a);
            let [put_in_w, dissipated_w] = mechanism.power(input, q, v, a);
            taken_w += dissipated_w - put_in_w;
        }
        Ok(taken_w / f64::from(TURN) / speed_rad_per_s)
    }

    /// Turning steadily at `speed_rad_per_s`, the link bent until inertia, weight and constant loads balance in it.
    ///
    /// # Errors
    /// [`NoModes`] where no such state is found, or the chain has two links: its rotation is periodic, not steady.
    pub fn turning(&self, angle_rad: f64, speed_rad_per_s: f64) -> Result<Point, NoModes> {
        let mut point = self.at_rest(angle_rad)?;
        if speed_rad_per_s == 0.0 {
            return Ok(point);
        }
        if self.has_free_second_link() {
            return Err(NoModes::FreeSecondLink);
        }
        if !self.turns_steadily() {
            return Err(match (self.has_base_spring(), self.chain().map_or(0, |chain| chain.links.len())) {
                (true, 1) => NoModes::WeightOnSpring,
                (true, _) => NoModes::BaseSpring,
                (false, _) => NoModes::NotSteady,
            });
        }
        point.input.motion = self.is_held().then_some([angle_rad, speed_rad_per_s, 0.0]);
        point.speed_rad_per_s = speed_rad_per_s;
        let mut mechanism = self.mechanism();
        for step in 0..STEPS {
            let residual = self.carried_along(mechanism.as_mut(), &mut point);
            if !residual.is_finite() {
                break;
            }
            if residual <= TOLERANCE && step > 1 || point.q.is_empty() {
                return Ok(point);
            }
            let Some(change) = correction(mechanism.as_mut(), &point) else { break };
            point.q.iter_mut().zip(change.iter()).for_each(|(q, x)| *q -= x);
            // Stiff sections leave residuals that no step takes away.
            let rounding = ROUNDING * point.q.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
            if change.amax() <= rounding {
                self.carried_along(mechanism.as_mut(), &mut point);
                return Ok(point);
            }
        }
        Err(NoModes::NoSteadyRotation { speed_rad_per_s, angle_deg: angle_rad.to_degrees() })
    }

    /// Gives the point its velocities, accelerations and torque, and returns its relative residual.
    fn carried_along(&self, mechanism: &mut dyn Mechanism, point: &mut Point) -> f64 {
        mechanism.rigid_motion(&point.input, point.speed_rad_per_s, &point.q, &mut point.v, &mut point.a);
        self.balance(point);
        let mut r = vec![0.0; point.q.len()];
        mechanism.residual(&point.input, &point.q, &point.v, &point.a, &mut r);
        mechanism.residual_size(&r)
    }

    /// The torque that the point needs: of `r(τ) = r(0) − τ b`, the one that leaves least.
    fn balance(&self, point: &mut Point) {
        point.input.torque_nm = 0.0;
        if self.is_held() || point.q.is_empty() {
            return;
        }
        let mut mechanism = self.mechanism();
        let row = Linearised::new(mechanism.as_mut(), point).torque;
        let mut r = vec![0.0; point.q.len()];
        mechanism.residual(&point.input, &point.q, &point.v, &point.a, &mut r);
        // The row has one entry, of the tangent's angle, but for a first link in a floating frame.
        let Some((first, entry)) = row.iter().enumerate().find(|(_, entry)| **entry != 0.0) else { return };
        point.input.torque_nm = r[first] / entry;
    }
}

/// Newton's step `[K, b; bᵀ, 0]⁻¹ (r, 0)`, K as in the frame that turns along; the tangent at the pivot, `bᵀ q`, stays.
fn correction(mechanism: &mut dyn Mechanism, point: &Point) -> Option<DVector<f64>> {
    let n = point.q.len();
    let system = Linearised::new(mechanism, point);
    let (whole, row) = (system.stiffness.dense(), DVector::from_vec(system.torque));
    let mut r = vec![0.0; n];
    mechanism.residual(&point.input, &point.q, &point.v, &point.a, &mut r);
    let bordered = n + usize::from(row.norm() > 0.0);
    let mut matrix = DMatrix::zeros(bordered, bordered);
    matrix.view_mut((0, 0), (n, n)).copy_from(&whole);
    if bordered > n {
        let scaled = &row * (whole.amax().max(1.0) / row.amax());
        matrix.view_mut((0, n), (n, 1)).copy_from(&scaled);
        matrix.view_mut((n, 0), (1, n)).copy_from(&scaled.transpose());
    }
    let mut right = DVector::zeros(bordered);
    right.rows_mut(0, n).copy_from_slice(&r);
    let solution = matrix.lu().solve(&right)?;
    solution.iter().all(|x| x.is_finite()).then(|| solution.rows(0, n).into_owned())
}

#[cfg(test)]
mod tests {
    use super::NoModes;

    #[test]
    fn regress_refusals_show_angles_and_speeds_without_digits_of_rounding() {
        let angle_deg = 0.5_f64.to_degrees();
        let refused = NoModes::NoEquilibrium { angle_deg }.to_string();
        assert_eq!(refused, "no static equilibrium was found with the crank at 28.6479°");
        let refused = NoModes::NoSteadyRotation { speed_rad_per_s: 3.0 * 0.1, angle_deg }.to_string();
        assert!(refused.starts_with("no steady rotation at 0.3 rad/s was found with the crank at 28.6479°: "), "{refused}");
    }
}
