//! The amplification of the running integrators on `a + c v + ω² q = 0` against theory.

use crate::problems::{Linear, generalized_alpha, run, runge_kutta, two_point};
use flexcrank::integrate::{Integrator, State};
use nalgebra::{Complex, DMatrix, Matrix3, Vector3};

const OMEGAS: [f64; 6] = [0.05, 0.3, 1.0, 2.5, 8.0, 40.0];

fn radius(matrix: DMatrix<f64>) -> f64 {
    matrix.complex_eigenvalues().iter().map(|x| x.norm()).fold(0.0, f64::max)
}

/// From one step of size 1 from each unit vector of `(q, v)`, or `(q, v, α)` with auxiliary accelerations.
fn measured(mut integrator: Integrator, omega: f64, c: f64, auxiliary: bool) -> f64 {
    let size = if auxiliary { 3 } else { 2 };
    let mut system = Linear::oscillator(omega, c);
    let columns = (0..size).map(|column| {
        let mut unit = [0.0; 3];
        unit[column] = 1.0;
        let mut state = State::new(vec![unit[0]], vec![unit[1]]);
        state.a[0] = -c * unit[1] - omega * omega * unit[0];
        state.alpha[0] = unit[2];
        run(&mut integrator, &mut system, 1.0, 1, &mut state, |_, _, _| {}).unwrap();
        [state.q[0], state.v[0], state.alpha[0]]
    });
    let columns: Vec<_> = columns.collect();
    radius(DMatrix::from_fn(size, size, |i, j| columns[j][i]))
}

/// `max |g(μ)|` over the roots of `μ² + c μ + ω² = 0`.
fn of_roots(omega: f64, c: f64, g: impl Fn(Complex<f64>) -> Complex<f64>) -> f64 {
    let root = (Complex::new(0.25 * c * c - omega * omega, 0.0)).sqrt();
    [root, -root].map(|root| g(root - 0.5 * c).norm()).into_iter().fold(0.0, f64::max)
}

#[test]
fn prop_spectral_radius_two_point() {
    for omega in OMEGAS {
        for c in [0.0, 0.4 * omega] {
            for weight in [0.0, 0.3, 0.5, 0.55, 0.9, 1.0] {
                let theory = of_roots(omega, c, |z| (1.0 + (1.0 - weight) * z) / (1.0 - weight * z));
                let measured = measured(two_point(1, weight), omega, c, false);
                assert!((measured / theory - 1.0).abs() < 1e-9, "ω {omega} c {c} ϑ {weight}: {measured} {theory}");
            }
        }
    }
}

#[test]
fn prop_spectral_radius_runge_kutta() {
    for omega in OMEGAS {
        for c in [0.0, 0.4 * omega] {
            let theory = of_roots(omega, c, |z| 1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0))));
            let measured = measured(runge_kutta(1), omega, c, false);
            assert!((measured / theory - 1.0).abs() < 1e-9, "ω {omega} c {c}: {measured} {theory}");
        }
    }
}

/// Chung & Hulbert's own form: `(1−α_m) a₁ + α_m a₀ + c (…v) + ω² ((1−α_f) d₁ + α_f d₀) = 0` with Newmark's formulas, h = 1.
fn chung_hulbert(omega: f64, c: f64, rho: f64) -> f64 {
    let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
    let (gamma, beta) = (0.5 - am + af, 0.25 * (1.0 - am + af) * (1.0 - am + af));
    let w2 = omega * omega;
    #[rustfmt::skip]
    let (new, old) = (
        Matrix3::new(1.0, 0.0, -beta,  0.0, 1.0, -gamma,  (1.0 - af) * w2, (1.0 - af) * c, 1.0 - am),
        Matrix3::new(1.0, 1.0, 0.5 - beta,  0.0, 1.0, 1.0 - gamma,  -af * w2, -af * c, -am),
    );
    let columns = [0, 1, 2].map(|j| new.lu().solve(&(old * Vector3::ith(j, 1.0))).unwrap());
    radius(DMatrix::from_fn(3, 3, |i, j| columns[j][i]))
}

#[test]
fn prop_spectral_radius_generalized_alpha() {
    for omega in OMEGAS {
        for c in [0.0, 0.4 * omega] {
            for rho in [0.0, 0.3, 0.6, 0.8, 0.95, 1.0] {
                let theory = chung_hulbert(omega, c, rho);
                let measured = measured(generalized_alpha(1, rho), omega, c, true);
                assert!((measured - theory).abs() < 1e-9, "ω {omega} c {c} ρ {rho}: {measured} {theory}");
                assert!(measured < 1.0 + 1e-9);
            }
        }
    }
}

#[test]
fn prop_spectral_radius_at_infinity_is_rho_infinity() {
    for rho in [0.0, 0.3, 0.6, 0.8, 0.95, 1.0] {
        let measured = measured(generalized_alpha(1, rho), 1e5, 0.0, true);
        assert!((measured - rho).abs() < 1e-3, "ρ {rho}: {measured}");
    }
}
