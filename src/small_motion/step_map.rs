//! Discrete time as an integration scheme has it: the map of one of its steps.

use nalgebra::{Complex, DMatrix, DVector, Dyn, LU};

use super::NoModes;
use super::floquet::eigenvalues;
use super::scheme::Scheme;
use super::state_space::StateSpace;
use crate::integrate::{NewtonSettings, Singular, State, StepError, System, Weights, solve_acceleration};

/// One correction solves a linear system, whatever the tolerance.
const LINEAR: NewtonSettings = NewtonSettings { tolerance: 1e-10, max_iterations: 10 };

/// `δq̈ = A₂₁ δq + A₂₂ δq̇ + load`, as the schemes see it.
struct Linear {
    position: DMatrix<f64>,
    velocity: DMatrix<f64>,
    load: DVector<f64>,
    factors: Option<(Weights, LU<f64, Dyn, Dyn>)>,
}

impl System for Linear {
    fn degrees_of_freedom(&self) -> usize {
        self.load.len()
    }

    fn residual(&mut self, _: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let [q, v, a] = [q, v, a].map(DVector::from_column_slice);
        r.copy_from_slice((a - &self.position * q - &self.velocity * v - &self.load).as_slice());
    }

    /// Nil: small motion bears no load that is large.
    fn residual_size(&self, _: &[f64]) -> f64 {
        0.0
    }

    fn factor(&mut self, _: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        if self.factors.as_ref().is_none_or(|(weights, _)| *weights != w) {
            let n = self.load.len();
            let matrix = DMatrix::identity(n, n) * w.acceleration - &self.velocity * w.velocity - &self.position * w.position;
            self.factors = Some((w, matrix.lu()));
        }
        Ok(())
    }

    fn solve(&mut self, x: &mut [f64]) {
        let solved = self.factors.as_ref().and_then(|(_, factors)| factors.solve(&DVector::from_column_slice(x)));
        match solved {
            Some(solved) => x.copy_from_slice(solved.as_slice()),
            None => x.fill(f64::NAN),
        }
    }
}

/// Inputs that a step depends on.
#[derive(Clone, Copy)]
struct Load {
    /// During the step before.
    before: f64,
    /// With what the step before carried on, at its end.
    acting: f64,
    /// During this step.
    during: f64,
}

impl Load {
    const NONE: Load = Load { before: 0.0, acting: 0.0, during: 0.0 };
}

impl StateSpace {
    /// The map of one step of a scheme, exact to rounding: it takes this linear system's step from every unit vector.
    ///
    /// States that the scheme keeps beside q and q̇ follow them: with generalised-α its auxiliary accelerations. Both it and ESDIRK
    /// spread a change of the load over steps. So they also keep each input of the step before, and generalised-α its value with what
    /// is carried on, `p + ½ Δp`. ESDIRK begins a step anew under a load that jumps by over a hundredth of the forces at work; that
    /// is not linear, and not part of the map.
    ///
    /// # Errors
    /// [`NoModes::NotFound`] where the step cannot be taken: its matrix is singular, or a number is not finite.
    pub fn stepped_by(&self, scheme: Scheme, step_s: f64) -> Result<StateSpace, NoModes> {
        let n = self.a.nrows() / 2;
        let (carried, memory) = (scheme.carried_vectors() * n, memory(scheme));
        let (a, b) = step_matrices([&self.a, &self.b], scheme, step_s)?;
        let size = a.nrows();
        let mut c = self.c.clone().resize_horizontally(size, 0.0);
        c.columns_mut(2 * n, size - 2 * n).fill(0.0);
        let auxiliary = self.states.iter().take(n).map(|name| format!("{name}_auxiliary_per_s2")).take(carried - 2 * n);
        let kept = self
            .inputs
            .iter()
            .flat_map(|name| ["before", "carried"].into_iter().take(memory).map(move |when| format!("{name}_{when}")));
        let states = self.states.iter().cloned().chain(auxiliary).chain(kept).collect();
        Ok(StateSpace { a, b, c, states, step_s: Some(step_s), ..self.clone() })
    }
}

/// The map of one step and that of the inputs, of `ẋ = A x + B u` with A and B given.
fn step_matrices([a, b]: [&DMatrix<f64>; 2], scheme: Scheme, step_s: f64) -> Result<(DMatrix<f64>, DMatrix<f64>), NoModes> {
    let (n, m) = (a.nrows() / 2, b.ncols());
    let (carried, memory) = (scheme.carried_vectors() * n, memory(scheme));
    let mut system = Linear {
        position: a.view((n, 0), (n, n)).into_owned(),
        velocity: a.view((n, n), (n, n)).into_owned(),
        load: DVector::zeros(n),
        factors: None,
    };
    let force = b.rows(n, n).into_owned();
    let mut step = |state: &DVector<f64>, input: usize, load: Load| {
        let force = if input < m { force.column(input).into_owned() } else { DVector::zeros(n) };
        take(scheme, &mut system, step_s, state, &force, load).map_err(|_| NoModes::NotFound)
    };
    let size = carried + memory * m;
    let (mut map, mut of_inputs) = (DMatrix::zeros(size, size), DMatrix::zeros(size, m));
    let still = DVector::zeros(carried);
    for k in 0..carried {
        let mut unit = still.clone();
        unit[k] = 1.0;
        map.view_mut((0, k), (carried, 1)).copy_from(&step(&unit, m, Load::NONE)?);
    }
    for input in 0..m {
        let during = step(&still, input, Load { during: 1.0, ..Load::NONE })?;
        of_inputs.view_mut((0, input), (carried, 1)).copy_from(&during);
        let loads = match memory {
            0 => Vec::new(),
            1 => vec![Load { before: 1.0, acting: 1.0, during: 0.0 }],
            _ => vec![Load { before: 1.0, ..Load::NONE }, Load { acting: 1.0, ..Load::NONE }],
        };
        let first = carried + memory * input;
        for (place, load) in (first..).zip(loads) {
            map.view_mut((0, place), (carried, 1)).copy_from(&step(&still, input, load)?);
        }
        if memory > 0 {
            of_inputs[(first, input)] = 1.0;
        }
        if memory > 1 {
            of_inputs[(first + 1, input)] = 1.5;
            map[(first + 1, first)] = -0.5;
        }
    }
    Ok((map, of_inputs))
}

/// Parts of a step in which a vibration's multiplier is followed.
const PARTS: u32 = 64;

/// The multiplier by which one step of a scheme changes a vibration of eigenvalue λ. A step has several multipliers for
/// `ẍ − 2 Re λ ẋ + |λ|² x = 0`. This is the one that is `exp(λh)` for a short step h, followed as the step grows. The others
/// belong to values that the scheme keeps, and to no vibration.
///
/// Close to critical damping, multipliers meet as the step grows, and either may be followed. The sign of the imaginary part is
/// not kept beyond half a turn a step.
///
/// # Errors
/// [`NoModes::NotFound`] where the step cannot be taken.
pub fn multiplier_of_vibration(scheme: Scheme, eigenvalue: Complex<f64>, step_s: f64) -> Result<Complex<f64>, NoModes> {
    let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -eigenvalue.norm_sqr(), 2.0 * eigenvalue.re]);
    let b = DMatrix::zeros(2, 0);
    let (mut exponents, mut multiplier) = ([eigenvalue; 2], Complex::from(1.0));
    for part in 1..=PARTS {
        let h_s = step_s * f64::from(part) / f64::from(PARTS);
        let (map, _) = step_matrices([&a, &b], scheme, h_s)?;
        let (found, _) = eigenvalues(&map).map_err(|_| NoModes::NotFound)?;
        let expected = ((2.0 * exponents[1] - exponents[0]) * h_s).exp();
        let nearest = found.into_iter().min_by(|one, other| (one - expected).norm().total_cmp(&(other - expected).norm()));
        multiplier = nearest.ok_or(NoModes::NotFound)?;
        exponents = [exponents[1], multiplier.ln() / h_s];
    }
    Ok(multiplier)
}

/// Values of each input that a scheme keeps from the step before.
fn memory(scheme: Scheme) -> usize {
    match scheme {
        Scheme::TwoPoint(_) | Scheme::RungeKutta => 0,
        Scheme::Esdirk => 1,
        Scheme::GeneralizedAlpha(_) => 2,
    }
}

/// One step from a state, with the loads that belong to it.
fn take(
    scheme: Scheme,
    system: &mut Linear,
    step_s: f64,
    carried: &DVector<f64>,
    force: &DVector<f64>,
    load: Load,
) -> Result<DVector<f64>, StepError> {
    let n = system.load.len();
    let part = |k: usize| carried.as_slice()[k * n..(k + 1) * n].to_vec();
    let mut state = State::new(part(0), part(1));
    let State { q, v, a, alpha, residual } = &mut state;
    system.load = force * load.acting;
    solve_acceleration(system, 0.0, q, v, a, residual)?;
    system.load = force * load.before;
    system.residual(0.0, q, v, a, residual);
    alpha.clone_from(a);
    if scheme.carried_vectors() == 3 {
        *alpha = part(2);
    }
    system.load = force * load.during;
    scheme.integrator(n, LINEAR).step(system, 0.0, step_s, &mut state)?;
    let State { q, v, alpha, .. } = state;
    let vectors = [q, v, alpha].into_iter().take(scheme.carried_vectors());
    Ok(DVector::from_vec(vectors.flatten().collect()))
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::multiplier_of_vibration;
    use crate::small_motion::scheme::Scheme;

    /// The generalised-α method with ρ∞ = 0.8 has the roots -0.15183 ± 0.87183i and -0.50911, by its own difference equation elsewhere. The
    /// last one, which is no vibration's, is nearer to `exp(λh)`.
    #[test]
    fn val_the_multiplier_of_a_vibration_is_no_root_of_the_scheme_alone() -> Result<(), Box<dyn std::error::Error>> {
        let (eigenvalue, step_s) = (Complex::new(-296.902, 2419.89), 1e-3);
        let found = multiplier_of_vibration(Scheme::GeneralizedAlpha(0.8), eigenvalue, step_s)?;
        assert!((found - Complex::new(-0.15183, 0.87183)).norm() < 2e-5, "{found}");
        // Short steps give every scheme the vibration's own.
        for scheme in [Scheme::TwoPoint(0.5), Scheme::GeneralizedAlpha(0.8), Scheme::GeneralizedAlpha(0.0), Scheme::Esdirk] {
            let found = multiplier_of_vibration(scheme, eigenvalue, 1e-5)?;
            assert!((found - (eigenvalue * 1e-5).exp()).norm() < 1e-5, "{scheme:?}: {found}");
        }
        // Without damping, the midpoint rule turns by 2 atan(ωh/2).
        let found = multiplier_of_vibration(Scheme::TwoPoint(0.5), Complex::new(0.0, 2.8), 1.0)?;
        assert!((found.arg() - 2.0 * 1.4_f64.atan()).abs() < 1e-9 && (found.norm() - 1.0).abs() < 1e-9, "{found}");
        Ok(())
    }
}
