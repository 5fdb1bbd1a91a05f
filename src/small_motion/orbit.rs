//! Periodic motion of a system, found by shooting.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix2, SVD, Vector2};

use super::error::FloquetError;
pub use super::lap::Cycle;
use super::lap::{Lap, crank_row, lap};
use super::linear::set_torque;
use super::periodic::PeriodicSystem;
use super::scheme::Scheme;
use super::variation::{TIGHT, Trajectory};
use crate::integrate::NewtonSettings;

/// Where the search for a periodic motion begins.
#[derive(Debug, Clone, PartialEq)]
pub struct Guess {
    /// Coordinates at `t = 0`. A free crank keeps the angle that they give it.
    pub q: Vec<f64>,
    /// Velocities at `t = 0`.
    pub v: Vec<f64>,
    /// Change of each coordinate over a period: multiples of 2π for angles that turn. If `None`, it is that of the motion from the
    /// guess, rounded to whole turns.
    pub advance: Option<Vec<f64>>,
}

/// When the search ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrbitSettings {
    /// Largest [`Orbit::residual`].
    pub tolerance: f64,
    /// Most Newton corrections.
    pub max_iterations: u32,
    /// Most laps that are taken instead of a correction that does not help.
    pub max_relaxations: u32,
    /// Newton's iteration within a step.
    pub newton: NewtonSettings,
}

impl Default for OrbitSettings {
    fn default() -> Self {
        Self { tolerance: 1e-10, max_iterations: 25, max_relaxations: 8, newton: TIGHT }
    }
}

/// A periodic motion of a system as a scheme computes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Orbit {
    /// The period and its steps.
    pub cycle: Cycle,
    /// Coordinates at `t = 0`.
    pub q: Vec<f64>,
    /// Velocities at `t = 0`.
    pub v: Vec<f64>,
    /// Generalised-α's auxiliary accelerations at `t = 0`; empty with other schemes.
    pub alpha: Vec<f64>,
    /// Change of each coordinate over a period.
    pub advance: Vec<f64>,
    /// The constant torque that holds the mean speed, where it was unknown.
    pub torque_nm: Option<f64>,
    /// Largest component of `|q_T − q_0 − advance|`, `|v_T − v_0|/Ω` and `|α_T − α_0|/Ω²`, `Ω = 2π/T`, in the units of the coordinates.
    pub residual: f64,
    /// Newton corrections made.
    pub iterations: u32,
    /// Derivative of `(q, v, α)` after a period by the same at its beginning.
    pub monodromy: DMatrix<f64>,
}

/// Finds the periodic motion near a guess by Newton's method on the state at `t = 0` (single shooting):
///
/// ```text
/// x(T; x₀, τ) − x₀ − advance = 0      [Φ − I, ∂x_T/∂τ; g, 0] (δx₀, δτ) = −(x_T − x₀ − advance, g (q₀ − guess))
/// ```
///
/// Φ is the monodromy matrix. If the system's torque τ is unknown, the row `g = −∂r/∂τ`, the derivative of the crank's angle by q,
/// holds that angle at `t = 0`. Corrections are halved twice if they do not make the residual smaller. Then the search goes on from the
/// end of the lap instead, as friction and the scheme let vibrations fade that the guess set off.
///
/// On success the system keeps the torque found.
///
/// # Errors
/// See [`FloquetError`].
pub fn periodic_orbit<S: PeriodicSystem>(
    system: &mut S,
    scheme: Scheme,
    cycle: Cycle,
    guess: &Guess,
    settings: &OrbitSettings,
) -> Result<Orbit, FloquetError> {
    cycle.check()?;
    let search = Search::new(system, scheme, cycle, guess, settings)?;
    search.run(settings)
}

struct Search<'a, S> {
    system: &'a mut S,
    cycle: Cycle,
    trajectory: Trajectory,
    unknowns: usize,
    advance: DVector<f64>,
    /// Derivative of the crank's angle by q, and that angle's coordinates at `t = 0`.
    held: Option<(DVector<f64>, DVector<f64>)>,
    /// The vectors carried, then the torque if it is unknown.
    x: DVector<f64>,
    lap: Lap,
    residual: DVector<f64>,
}

impl<'a, S: PeriodicSystem> Search<'a, S> {
    fn new(
        system: &'a mut S,
        scheme: Scheme,
        cycle: Cycle,
        guess: &Guess,
        settings: &OrbitSettings,
    ) -> Result<Self, FloquetError> {
        let n = system.degrees_of_freedom();
        let advance = guess.advance.as_deref().unwrap_or(&guess.q);
        for given in [guess.q.len(), guess.v.len(), advance.len()] {
            if given != n {
                return Err(FloquetError::WrongLength { given, needed: n });
            }
        }
        let mut trajectory = Trajectory::new(scheme, n, settings.newton);
        let mut carried = [&guess.q[..], &guess.v].concat();
        if trajectory.carried_len() > carried.len() {
            let a = trajectory.accelerations(system, 0.0, &guess.q, &guess.v);
            carried.extend(a.map_err(|cause| FloquetError::Step { time_s: 0.0, cause })?);
        }
        let held = crank_row(system, &guess.q).map(|row| (row, DVector::from_column_slice(&guess.q)));
        let lap = lap(system, &mut trajectory, cycle, &carried)?;
        carried.extend(system.torque_nm().copied());
        let x = DVector::from_vec(carried);
        let mut search = Self {
            system,
            cycle,
            unknowns: n,
            advance: DVector::zeros(trajectory.carried_len()),
            trajectory,
            held,
            residual: DVector::zeros(x.len()),
            x,
            lap,
        };
        search.set_advance(guess)?;
        search.check_period()?;
        search.settle_crank();
        search.residual = search.residual_of(&search.x, &search.lap);
        Ok(search)
    }

    fn set_advance(&mut self, guess: &Guess) -> Result<(), FloquetError> {
        for i in 0..self.unknowns {
            let turned = || ((self.lap.end[i] - self.x[i]) / TAU).round() * TAU;
            self.advance[i] = guess.advance.as_ref().map_or_else(turned, |advance| advance[i]);
        }
        let Some((row, _)) = &self.held else { return Ok(()) };
        let turns = row.dot(&self.advance.rows(0, self.unknowns)) / TAU;
        let whole = turns != 0.0 && (turns - turns.round()).abs() < 1e-6;
        if whole { Ok(()) } else { Err(FloquetError::NoTurn { turns }) }
    }

    /// The same accelerations must follow from the state a period later. They are compared with the largest acceleration or `Ω v`.
    fn check_period(&mut self) -> Result<(), FloquetError> {
        let (n, period_s) = (self.unknowns, self.cycle.period_s);
        let (q, v) = (self.x.rows(0, n).into_owned(), self.x.rows(n, n).into_owned());
        let later = &q + self.advance.rows(0, n);
        let mut accelerations = |time_s: f64, q: &DVector<f64>| {
            let a = self.trajectory.accelerations(self.system, time_s, q.as_slice(), v.as_slice());
            a.map(DVector::from_vec).map_err(|cause| FloquetError::Step { time_s, cause })
        };
        let (first, last) = (accelerations(0.0, &q)?, accelerations(period_s, &later)?);
        let difference = (&last - &first).amax();
        let scale = first.amax().max(last.amax()).max(v.amax() * TAU / period_s);
        // Of accelerations that are all rounding, the forces that they leave unbalanced tell.
        let mut unbalanced = vec![0.0; n];
        self.system.residual(period_s, later.as_slice(), v.as_slice(), first.as_slice(), &mut unbalanced);
        let of_forces = self.system.residual_size(&unbalanced);
        let mismatch = if difference == 0.0 { 0.0 } else { of_forces.min(difference / scale) };
        if mismatch <= PERIODIC { Ok(()) } else { Err(FloquetError::NotPeriodic { mismatch }) }
    }

    /// Torque τ and a common factor s of all velocities that let a free crank end where it began, and as fast. Without this, coordinates
    /// along a circle are corrected along its chord, and links would have to stretch.
    fn settle_crank(&mut self) {
        let (n, len) = (self.unknowns, self.advance.len());
        let Some((row, _)) = self.held.clone() else { return };
        let crank = |x: &DVector<f64>| Vector2::new(row.dot(&x.rows(0, n)), row.dot(&x.rows(n, n)));
        for _ in 0..SETTLING {
            let Some(by_torque) = &self.lap.by_torque else { return };
            let start = self.x.rows(0, len).into_owned();
            let missed = crank(&(&self.lap.end - &start - &self.advance));
            if missed.x.abs() < SETTLED && missed.y.abs() * self.cycle.period_s < SETTLED {
                return;
            }
            let mut faster = DVector::zeros(len);
            faster.rows_mut(n, n).copy_from(&start.rows(n, n));
            let columns = [crank(&(&self.lap.map * &faster - &faster)), crank(by_torque)];
            let Some(correction) = Matrix2::from_columns(&columns).lu().solve(&-missed) else { return };
            let mut x = self.x.clone();
            x.rows_mut(n, n).scale_mut(1.0 + correction.x.clamp(-0.5, 0.5));
            x[len] += correction.y;
            set_torque(self.system, x[len]);
            match lap(self.system, &mut self.trajectory, self.cycle, &x.as_slice()[..len]) {
                Ok(lap) => (self.x, self.lap) = (x, lap),
                Err(_) => return set_torque(self.system, self.x[len]),
            }
        }
    }

    fn run(mut self, settings: &OrbitSettings) -> Result<Orbit, FloquetError> {
        let (mut iterations, mut relaxed) = (0, 0);
        while self.residual.amax() > settings.tolerance {
            let failed = FloquetError::NotConverged { residual: self.residual.amax(), iterations };
            if iterations >= settings.max_iterations {
                return Err(failed);
            }
            iterations += 1;
            let correction = self.correction()?;
            if self.correct(&correction) {
                continue;
            }
            relaxed += 1;
            if relaxed > settings.max_relaxations || !self.relax() {
                return Err(failed);
            }
        }
        Ok(self.orbit(iterations))
    }

    /// Least squares of least length, so that a direction in which the motion may be shifted at will does no harm.
    fn correction(&self) -> Result<DVector<f64>, FloquetError> {
        let (carried, size) = (self.advance.len(), self.x.len());
        let mut matrix = DMatrix::zeros(size, size);
        matrix.view_mut((0, 0), (carried, carried)).copy_from(&self.lap.map);
        for i in 0..carried {
            matrix[(i, i)] -= 1.0;
        }
        if let (Some((row, _)), Some(by_torque)) = (&self.held, &self.lap.by_torque) {
            matrix.view_mut((0, carried), (carried, 1)).copy_from(by_torque);
            matrix.view_mut((carried, 0), (1, self.unknowns)).copy_from(&row.transpose());
        }
        let mut scale = DVector::from_fn(size, |i, _| self.scale(i));
        // The torque counts by what it changes.
        let by_torque = matrix.column_iter().nth(carried).map(|column| column.component_mul(&scale).amax());
        if let Some(change) = by_torque.filter(|change| *change > 0.0) {
            scale[carried] = change;
        }
        for (i, mut row) in matrix.row_iter_mut().enumerate() {
            // The row behind them holds the crank's angle as it is.
            row *= if i < carried { scale[i] } else { 1.0 };
        }
        for (j, mut column) in matrix.column_iter_mut().enumerate() {
            column /= scale[j];
        }
        if !matrix.iter().all(|x| x.is_finite()) {
            return Err(FloquetError::NotFinite);
        }
        let svd = SVD::try_new(matrix, true, true, f64::EPSILON, ITERATIONS * size).ok_or(FloquetError::NotFinite)?;
        let smallest = SINGULAR * svd.singular_values.amax();
        let correction = svd.solve(&-&self.residual, smallest).map_err(|_| FloquetError::NotFinite)?;
        Ok(correction.component_div(&scale))
    }

    /// Corrects by as much as makes the residual smaller; whether any part of the correction did.
    fn correct(&mut self, correction: &DVector<f64>) -> bool {
        let better = PARTS.iter().any(|part| {
            let x = &self.x + correction * *part;
            x.iter().all(|x| x.is_finite()) && self.attempt(&x)
        });
        if let (false, Some(torque_nm)) = (better, self.torque(&self.x)) {
            set_torque(self.system, torque_nm);
        }
        better
    }

    /// Goes on from the end of the lap, in which vibrations have faded that the guess set off; whether the next lap could be taken.
    fn relax(&mut self) -> bool {
        let len = self.advance.len();
        let start = &self.lap.end - &self.advance;
        let Ok(lap) = lap(self.system, &mut self.trajectory, self.cycle, start.as_slice()) else { return false };
        self.x.rows_mut(0, len).copy_from(&start);
        self.lap = lap;
        self.settle_crank();
        self.residual = self.residual_of(&self.x, &self.lap);
        true
    }

    fn attempt(&mut self, x: &DVector<f64>) -> bool {
        if let Some(torque_nm) = self.torque(x) {
            set_torque(self.system, torque_nm);
        }
        let carried = &x.as_slice()[..self.advance.len()];
        let Ok(lap) = lap(self.system, &mut self.trajectory, self.cycle, carried) else { return false };
        let residual = self.residual_of(x, &lap);
        let better = residual.amax() < self.residual.amax();
        if better {
            (self.x, self.lap, self.residual) = (x.clone(), lap, residual);
        }
        better
    }

    fn torque(&self, x: &DVector<f64>) -> Option<f64> {
        x.get(self.advance.len()).copied()
    }

    fn residual_of(&self, x: &DVector<f64>, lap: &Lap) -> DVector<f64> {
        let carried = self.advance.len();
        let mut residual = DVector::zeros(x.len());
        for i in 0..carried {
            residual[i] = self.scale(i) * (lap.end[i] - x[i] - self.advance[i]);
        }
        if let Some((row, start)) = &self.held {
            residual[carried] = row.dot(&(x.rows(0, self.unknowns) - start));
        }
        residual
    }

    /// `1`, `1/Ω` and `1/Ω²` of coordinates, velocities and α; 1 of the torque.
    fn scale(&self, i: usize) -> f64 {
        if i >= self.advance.len() {
            return 1.0;
        }
        let order = i32::try_from(i / self.unknowns).unwrap_or(0);
        (self.cycle.period_s / TAU).powi(order)
    }

    fn orbit(self, iterations: u32) -> Orbit {
        let part = |which: usize| {
            let of = which * self.unknowns..(which + 1) * self.unknowns;
            if of.end <= self.advance.len() { self.x.as_slice()[of].to_vec() } else { Vec::new() }
        };
        Orbit {
            cycle: self.cycle,
            q: part(0),
            v: part(1),
            alpha: part(2),
            advance: self.advance.as_slice()[..self.unknowns].to_vec(),
            torque_nm: self.torque(&self.x),
            residual: self.residual.amax(),
            iterations,
            monodromy: self.lap.map,
        }
    }
}

/// Accelerations that differ by more than this part are not those of a period before; stiff links turn rounding into some 1e-6.
const PERIODIC: f64 = 1e-4;
/// Most corrections of the torque and the rate of a free crank before all else.
const SETTLING: usize = 8;
/// Error of the crank's angle that is small enough to go on, rad.
const SETTLED: f64 = 1e-3;
/// Most sweeps of an iteration for singular values, for each row.
const ITERATIONS: usize = 100;
/// Singular values below this part of the largest are nil.
const SINGULAR: f64 = 1e-13;
/// Parts of a correction that are tried.
const PARTS: [f64; 3] = [1.0, 0.5, 0.25];
