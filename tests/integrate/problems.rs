//! Test problems and the schemes to run them with.

use flexcrank::integrate::{
    Effort, Esdirk, GeneralizedAlpha, Integrator, NewtonSettings, RungeKutta, Singular, State, StepError, System, TwoPoint,
    Weights,
};
use nalgebra::{DMatrix, DVector, Dyn, LU};

pub(crate) const SETTINGS: NewtonSettings = NewtonSettings { tolerance: 1e-12, max_iterations: 20 };

pub(crate) fn two_point(n: usize, weight: f64) -> Integrator {
    Integrator::TwoPoint(TwoPoint::new(n, weight, SETTINGS))
}

pub(crate) fn generalized_alpha(n: usize, rho_infinity: f64) -> Integrator {
    Integrator::GeneralizedAlpha(GeneralizedAlpha::new(n, rho_infinity, SETTINGS))
}

pub(crate) fn runge_kutta(n: usize) -> Integrator {
    Integrator::RungeKutta(RungeKutta::new(n))
}

pub(crate) fn esdirk(n: usize) -> Integrator {
    Integrator::Esdirk(Esdirk::new(n, SETTINGS))
}

/// Steps `steps` times with `before` telling the system what the coming step brings.
pub(crate) fn run<S: System>(
    integrator: &mut Integrator,
    system: &mut S,
    h_s: f64,
    steps: usize,
    state: &mut State,
    mut before: impl FnMut(&mut S, f64, f64),
) -> Result<Effort, StepError> {
    let mut total = Effort::default();
    for n in 0..steps {
        let t_s = n as f64 * h_s;
        before(system, t_s, h_s);
        total += integrator.step(system, t_s, h_s, state)?.effort;
    }
    Ok(total)
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |most, x| x.abs().max(most))
}

/// `M a + C v + K q = p`.
pub(crate) struct Linear {
    pub(crate) mass: DMatrix<f64>,
    pub(crate) damping: DMatrix<f64>,
    pub(crate) stiffness: DMatrix<f64>,
    pub(crate) load: DVector<f64>,
    factors: Option<LU<f64, Dyn, Dyn>>,
    at_work: f64,
}

impl Linear {
    pub(crate) fn new(mass: DMatrix<f64>, damping: DMatrix<f64>, stiffness: DMatrix<f64>, load: DVector<f64>) -> Self {
        Self { mass, damping, stiffness, load, factors: None, at_work: 0.0 }
    }

    /// `a + c v + ω² q = 0`.
    pub(crate) fn oscillator(omega: f64, c: f64) -> Self {
        let one = |x| DMatrix::from_element(1, 1, x);
        Self::new(one(1.0), one(c), one(omega * omega), DVector::zeros(1))
    }
}

impl System for Linear {
    fn degrees_of_freedom(&self) -> usize {
        self.load.len()
    }
    fn residual(&mut self, _: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let [q, v, a] = [q, v, a].map(DVector::from_row_slice);
        let terms = [&self.mass * a, &self.damping * v, &self.stiffness * q, -self.load.clone()];
        self.at_work = terms.iter().map(|x| largest(x.as_slice())).fold(0.0, f64::max);
        r.copy_from_slice(terms.iter().sum::<DVector<f64>>().as_slice());
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        if largest(r) == 0.0 { 0.0 } else { largest(r) / self.at_work }
    }
    fn factor(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        let matrix = w.acceleration * &self.mass + w.velocity * &self.damping + w.position * &self.stiffness;
        let factors = matrix.lu();
        if !factors.is_invertible() {
            return Err(Singular);
        }
        self.factors = Some(factors);
        Ok(())
    }
    fn solve(&mut self, x: &mut [f64]) {
        let solution = self.factors.as_ref().unwrap().solve(&DVector::from_row_slice(x)).unwrap();
        x.copy_from_slice(solution.as_slice());
    }
}

/// A rigid crank's equation, `I(θ) θ̈ + ½ I′(θ) θ̇² = τ`, with `I = 2 + cos 2θ + 0.5 cos θ`.
#[derive(Default)]
pub(crate) struct Crank {
    /// Constant during a step.
    pub(crate) torque_nm: f64,
    /// A function of time, added to it.
    pub(crate) torque: Option<fn(f64) -> f64>,
    inertia: [f64; 3],
    matrix: f64,
    at_work: f64,
}

impl Crank {
    pub(crate) fn driven(torque_nm: f64) -> Self {
        Self { torque_nm, ..Self::default() }
    }

    /// `[I, I′, I″]`.
    pub(crate) fn inertia(theta: f64) -> [f64; 3] {
        let ((s, c), (s2, c2)) = (theta.sin_cos(), (2.0 * theta).sin_cos());
        [2.0 + c2 + 0.5 * c, -2.0 * s2 - 0.5 * s, -4.0 * c2 - 0.5 * c]
    }

    /// Kinetic energy.
    pub(crate) fn energy(theta: f64, rate: f64) -> f64 {
        0.5 * Self::inertia(theta)[0] * rate * rate
    }
}

impl System for Crank {
    fn degrees_of_freedom(&self) -> usize {
        1
    }
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.inertia = Self::inertia(q[0]);
        let [i, di, _] = self.inertia;
        let torque = self.torque_nm + self.torque.map_or(0.0, |f| f(t_s));
        let terms = [i * a[0], 0.5 * di * v[0] * v[0], -torque];
        self.at_work = largest(&terms);
        r[0] = terms.iter().sum();
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        if r[0] == 0.0 { 0.0 } else { r[0].abs() / self.at_work }
    }
    fn factor(&mut self, _: f64, _: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        let [i, di, ddi] = self.inertia;
        self.matrix = w.acceleration * i + w.velocity * di * v[0] + w.position * (di * a[0] + 0.5 * ddi * v[0] * v[0]);
        if self.matrix == 0.0 { Err(Singular) } else { Ok(()) }
    }
    fn solve(&mut self, x: &mut [f64]) {
        x[0] /= self.matrix;
    }
}

/// A unit mass in the plane on a spring of free length 1 from the origin: `q̈ + k (|q| − 1) q/|q| = τ ẑ × q/|q|²`.
pub(crate) struct SpringPendulum {
    pub(crate) stiffness: f64,
    pub(crate) torque_nm: f64,
    matrix: [f64; 4],
    at_work: f64,
}

impl SpringPendulum {
    pub(crate) fn new(stiffness: f64) -> Self {
        Self { stiffness, torque_nm: 0.0, matrix: [0.0; 4], at_work: 0.0 }
    }

    pub(crate) fn angular_momentum(state: &State) -> f64 {
        state.q[0] * state.v[1] - state.q[1] * state.v[0]
    }

    pub(crate) fn energy(&self, state: &State) -> f64 {
        0.5 * (state.v[0].powi(2) + state.v[1].powi(2)) + 0.5 * self.stiffness * (state.q[0].hypot(state.q[1]) - 1.0).powi(2)
    }

    fn force(&self, q: [f64; 2]) -> [f64; 2] {
        let length = q[0].hypot(q[1]);
        let (tension, push) = (self.stiffness * (length - 1.0) / length, self.torque_nm / (length * length));
        [tension * q[0] + push * q[1], tension * q[1] - push * q[0]]
    }
}

impl System for SpringPendulum {
    fn degrees_of_freedom(&self) -> usize {
        2
    }
    fn residual(&mut self, _: f64, q: &[f64], _: &[f64], a: &[f64], r: &mut [f64]) {
        let force = self.force([q[0], q[1]]);
        self.at_work = largest(a).max(largest(&force)).max(self.torque_nm.abs());
        r[0] = a[0] + force[0];
        r[1] = a[1] + force[1];
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        if largest(r) == 0.0 { 0.0 } else { largest(r) / self.at_work }
    }
    fn factor(&mut self, _: f64, q: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        let length = q[0].hypot(q[1]);
        let (c, s) = (q[0] / length, q[1] / length);
        let (k, g) = (self.stiffness, self.stiffness * (length - 1.0) / length);
        let push = self.torque_nm / (length * length);
        let tangent = [
            k * c * c + g * s * s - 2.0 * push * s * c,
            (k - g) * c * s + push * (1.0 - 2.0 * s * s),
            (k - g) * c * s - push * (1.0 - 2.0 * c * c),
            k * s * s + g * c * c + 2.0 * push * s * c,
        ];
        self.matrix = [0, 1, 2, 3].map(|i| w.position * tangent[i] + if i % 3 == 0 { w.acceleration } else { 0.0 });
        Ok(())
    }
    fn solve(&mut self, x: &mut [f64]) {
        let [a, b, c, d] = self.matrix;
        let determinant = a * d - b * c;
        (x[0], x[1]) = ((d * x[0] - b * x[1]) / determinant, (a * x[1] - c * x[0]) / determinant);
    }
}
