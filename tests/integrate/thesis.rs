//! The two-point method against the figures of the thesis's own listings (5.2.1–5.2.3; `tests/data/README.md`: good to 4e-14).

use crate::problems::{Linear, run, two_point};
use flexcrank::integrate::State;
use nalgebra::{DMatrix, DVector};

fn rows(csv: &str) -> Vec<Vec<f64>> {
    csv.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}

/// Runs beside the rows (`t, q…, v…`) and returns the largest difference.
fn difference(csv: &str, mut system: Linear, q: Vec<f64>, h_s: f64) -> f64 {
    let n = q.len();
    let mut state = State::new(q, vec![0.0; n]);
    let mut integrator = two_point(n, 0.5);
    let mut worst = 0.0_f64;
    for row in rows(csv) {
        for (x, reference) in state.q.iter().chain(&state.v).zip(&row[1..]) {
            worst = worst.max((x - reference).abs());
        }
        run(&mut integrator, &mut system, h_s, 1, &mut state, |_, _, _| {}).unwrap();
    }
    worst
}

fn two_masses(k2: f64) -> Linear {
    Linear::new(
        DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 2.0]),
        DMatrix::zeros(2, 2),
        DMatrix::from_row_slice(2, 2, &[10.0, -10.0, -10.0, 10.0 + k2]),
        DVector::zeros(2),
    )
}

#[test]
fn val_one_degree_of_freedom() {
    let mut system = Linear::oscillator(1.0, 0.0);
    system.load[0] = 1.0;
    let worst = difference(include_str!("../data/thesis/sdof_h0.1_theta0.5.csv"), system, vec![0.0], 0.1);
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn val_two_degrees_of_freedom() {
    let worst = difference(include_str!("../data/thesis/twodof_h0.01_theta0.5.csv"), two_masses(10.0), vec![1.0, 0.0], 0.01);
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn val_two_degrees_of_freedom_stiff() {
    let csv = include_str!("../data/thesis/twodof_stiff_k2_9990_h0.1_theta0.5.csv");
    let worst = difference(csv, two_masses(9990.0), vec![1.0, 0.0], 0.1);
    assert!(worst < 1e-12, "{worst:e}");
}
