//! The motion over one period, and the row that tells the crank's angle.

use nalgebra::{DMatrix, DVector};

use super::error::FloquetError;
use super::linear::set_torque;
use super::orbit::{Cycle, Guess};
use super::periodic::PeriodicSystem;
use super::variation::Trajectory;
use crate::integrate::StepError;

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
    let failed = |time_s: f64| move |source: StepError| FloquetError::Step { time_s, source };
    trajectory.begin(system, time_s, carried).map_err(failed(time_s))?;
    for _ in 0..cycle.steps {
        trajectory.step(system, time_s, h_s).map_err(failed(time_s))?;
        // As schemes add it, so that a step begins at the very time at which the one before ended.
        time_s += h_s;
    }
    Ok(Lap { end: trajectory.carried(), map: trajectory.map(), by_torque: trajectory.by_torque() })
}

/// `−∂r/∂τ` at the guess, where the torque is unknown.
pub(super) fn crank_row<S: PeriodicSystem>(system: &mut S, guess: &Guess) -> Option<DVector<f64>> {
    let torque_nm = *system.torque_nm()?;
    let n = guess.q.len();
    let rest = vec![0.0; n];
    let mut rows = [vec![0.0; n], vec![0.0; n]];
    for (row, torque_nm) in rows.iter_mut().zip([0.0, 1.0]) {
        set_torque(system, torque_nm);
        system.residual(0.0, &guess.q, &rest, &rest, row);
    }
    set_torque(system, torque_nm);
    Some(DVector::from_fn(n, |i, _| rows[0][i] - rows[1][i]))
}
