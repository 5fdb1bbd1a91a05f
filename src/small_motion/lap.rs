//! A period and its steps, the motion over it, and the row that tells the crank's angle.

use nalgebra::{DMatrix, DVector};

use super::error::FloquetError;
use super::linear::set_torque;
use super::periodic::PeriodicSystem;
use super::variation::Trajectory;
use crate::integrate::StepError;

/// A period, divided into equal steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// T.
    pub period_s: f64,
    /// N, with `N h = T`.
    pub steps: u32,
}

impl Cycle {
    /// The division whose step is nearest to `step_s`.
    pub fn near(period_s: f64, step_s: f64) -> Self {
        let steps = (period_s / step_s).round().clamp(1.0, f64::from(u32::MAX));
        Self { period_s, steps: steps as u32 }
    }

    /// `h = T/N`.
    pub fn step_s(&self) -> f64 {
        self.period_s / f64::from(self.steps)
    }

    /// Refuses a period that has no length or no steps.
    pub(super) fn check(&self) -> Result<(), FloquetError> {
        let usable = self.period_s.is_finite() && self.period_s > 0.0 && self.steps > 0;
        if usable { Ok(()) } else { Err(FloquetError::NoPeriod) }
    }
}

/// A motion over one period.
pub(super) struct Lap {
    pub(super) end: DVector<f64>,
    pub(super) map: DMatrix<f64>,
    pub(super) by_torque: Option<DVector<f64>>,
}

/// Takes the steps of a period from the vectors carried.
pub(super) fn lap<S: PeriodicSystem>(
    system: &mut S,
    trajectory: &mut Trajectory,
    cycle: Cycle,
    carried: &[f64],
) -> Result<Lap, FloquetError> {
    let (mut time_s, h_s) = (0.0, cycle.step_s());
    let failed = |time_s: f64| move |cause: StepError| FloquetError::Step { time_s, cause };
    trajectory.begin(system, time_s, carried).map_err(failed(time_s))?;
    for _ in 0..cycle.steps {
        trajectory.step(system, time_s, h_s).map_err(failed(time_s))?;
        // As schemes add it, so that a step begins at the very time at which the one before ended.
        time_s += h_s;
    }
    Ok(Lap { end: trajectory.carried(), map: trajectory.map(), by_torque: trajectory.by_torque() })
}

/// `−∂r/∂τ` at the coordinates `q`, where the torque is unknown.
pub(super) fn crank_row<S: PeriodicSystem>(system: &mut S, q: &[f64]) -> Option<DVector<f64>> {
    let torque_nm = *system.torque_nm()?;
    let n = q.len();
    let rest = vec![0.0; n];
    let mut rows = [vec![0.0; n], vec![0.0; n]];
    for (row, torque_nm) in rows.iter_mut().zip([0.0, 1.0]) {
        set_torque(system, torque_nm);
        system.residual(0.0, q, &rest, &rest, row);
    }
    set_torque(system, torque_nm);
    Some(DVector::from_fn(n, |i, _| rows[0][i] - rows[1][i]))
}
