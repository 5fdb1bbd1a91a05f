//! State spaces beside closed forms and the models themselves.

use std::error::Error;

use nalgebra::{Complex, DMatrix, DVector};

use super::{Crank, NoModes, Point, StateSpace, Subject};
use crate::scene::SceneSource;

type Outcome = Result<(), Box<dyn Error>>;

fn subject(scene: &str, overrides: &[&str], crank: Option<Crank>) -> Result<Subject, Box<dyn Error>> {
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    Ok(Subject::new(&SceneSource::open(scene, &overrides)?.scene, crank)?)
}

const TWO_MASSES: [&str; 2] = ["oscillator.masses_kg=[1.0,2.0]", "oscillator.springs=[[0,1,300.0],[1,2,200.0]]"];

fn two_masses() -> Result<StateSpace, Box<dyn Error>> {
    let subject = subject("thesis-two-masses", &TWO_MASSES, None)?;
    Ok(StateSpace::new(&subject, &subject.at_rest(0.0)?)?)
}

/// `[500 − ω², −200; −200, 200 − 2ω²]⁻¹ (1, 0)`.
#[test]
fn val_the_frequency_response_of_two_masses_is_their_closed_form() -> Outcome {
    let space = two_masses()?;
    assert_eq!(space.states, ["mass_1_m", "mass_2_m", "mass_1_m_per_s", "mass_2_m_per_s"]);
    assert_eq!(space.inputs, ["mass_1_force_n", "mass_2_force_n"]);
    for frequency_hz in [0.01, 0.5, 1.3, 2.9, 10.0] {
        let square = (std::f64::consts::TAU * frequency_hz).powi(2);
        let whole = (500.0 - square) * (200.0 - 2.0 * square) - 40_000.0;
        let found = space.frequency_response(0, frequency_hz)?;
        for (name, exact) in [("mass_1_m", (200.0 - 2.0 * square) / whole), ("mass_2_m", 200.0 / whole)] {
            let place = space.outputs.iter().position(|output| output == name).ok_or("no output")?;
            assert!((found[place] - exact).norm() < 1e-12 * exact.abs(), "{name} at {frequency_hz} Hz");
        }
    }
    Ok(())
}

/// Poles where the response is infinite are the eigenvalues: `2ω⁴ − 1200ω² + 60000 = 0`.
#[test]
fn val_eigenvalues_of_two_masses_are_their_closed_form() -> Outcome {
    let root = (1200.0_f64.powi(2) - 8.0 * 60000.0).sqrt();
    let exact = [(1200.0 - root) / 4.0, (1200.0 + root) / 4.0].map(f64::sqrt);
    for (found, exact) in two_masses()?.eigenvalues().iter().step_by(2).zip(exact) {
        assert!((found.norm() / exact - 1.0).abs() < 1e-13, "{found} for {exact}");
    }
    Ok(())
}

/// One mass on a spring, with `ωh` up to 1e4: `cos ωh`, `sin ωh/ω`, and `(1 − cos ωh)/k` by a force.
#[test]
fn val_the_hold_of_a_stiff_mass_is_its_closed_form() -> Outcome {
    for omega in [1.0, 1e3, 1e5, 1e7] {
        let stiffness = format!("oscillator.springs=[[0,1,{:e}]]", omega * omega);
        let one = ["oscillator.masses_kg=[1.0]", &stiffness, "oscillator.start_m=[0.0]", "oscillator.forces_n=[0.0]"];
        let subject = subject("thesis-two-masses", &one, None)?;
        let step_s = 1e-3;
        let held = StateSpace::new(&subject, &subject.at_rest(0.0)?)?.zero_order_hold(step_s)?;
        let (sin, cos) = (omega * step_s).sin_cos();
        let turn = [cos, sin / omega, -omega * sin, cos];
        let units = [1.0, 1.0 / omega, omega, 1.0];
        for (place, (exact, unit)) in turn.into_iter().zip(units).enumerate() {
            let error = (held.a[(place / 2, place % 2)] - exact).abs() / unit;
            assert!(error < 1e-10, "{place} of {omega}: {error:e}");
        }
        let by_force = [(1.0 - cos) * omega.powi(-2), sin / omega];
        for (row, unit) in [omega.powi(-2), 1.0 / omega].into_iter().enumerate() {
            let error = (held.b[(row, 0)] - by_force[row]).abs() / unit;
            assert!(error < 1e-10, "force {row} of {omega}: {error:e}");
        }
    }
    Ok(())
}
