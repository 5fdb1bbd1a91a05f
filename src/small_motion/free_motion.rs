//! The free motions of a chain that no strain and no load holds, and what grows with them without bound.

use nalgebra::{DMatrix, DVector, RowDVector};

use super::linearised::Linearised;
use super::mode::Mode;
use super::state_space::StateSpace;

/// Free motions are found about this part of the squared size of the lowest eigenvalue that is not 0, and about no more than 1 1/s². That of
/// a vibration is its frequency, and of one that creeps less.
const BELOW: f64 = 1e-4;
/// Steps of inverse iteration, each of which takes other motions in them down by at least that part.
const ITERATIONS: usize = 6;
/// Part of a row times the largest coordinate from which the row's product with a motion is not taken for rounding.
const SIGNIFICANT: f64 = 1e-7;
/// A decay slower than this, 1/s, is rounding.
const CREEPS_PER_S: f64 = 1e-8;

/// Displacements `Φ z` with `K Φ = 0`, `Φᵀ M Φ = 1` and `Φᵀ D Φ = diag(d)`, so that each part of z has an equation of its own:
///
/// ```text
/// z̈ + d ż = φᵀ f
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FreeMotions {
    /// Φ: a column for each.
    shapes: DMatrix<f64>,
    /// d, 1/s.
    decays_per_s: Vec<f64>,
}

impl FreeMotions {
    /// Those of a space with these lowest modes, one for each eigenvalue 0; none where they are not found.
    pub fn new(space: &StateSpace, modes: &[Mode]) -> Self {
        let system = &space.equations.system;
        let sizes = || modes.iter().map(|mode| mode.eigenvalue.norm());
        let count = sizes().filter(|size| *size == 0.0).count();
        let lowest = sizes().filter(|size| *size > 0.0).fold(1.0, f64::min);
        let basis = (count > 0).then(|| slowest(system, count, BELOW * lowest * lowest)).flatten();
        let Some(basis) = basis else {
            return FreeMotions { shapes: DMatrix::zeros(system.mass.rows(), 0), decays_per_s: Vec::new() };
        };
        let mut damped = basis.clone();
        damped.column_iter_mut().for_each(|mut column| column.copy_from_slice(&system.damping.times(column.as_slice())));
        let split = (basis.transpose() * damped).symmetric_eigen();
        FreeMotions { shapes: basis * split.eigenvectors, decays_per_s: split.eigenvalues.iter().copied().collect() }
    }

    /// Whether an output grows without bound after a step of an input, and towards 0 Hz: what follows the speed of a free motion that the
    /// input drives and nothing brakes; and what turns with the chain as it then goes on, at `ż = φᵀf/d` under a damper.
    pub fn let_grow(&self, space: &StateSpace, [input, output]: [usize; 2]) -> bool {
        let n = self.shapes.nrows();
        let force = space.equations.force.column(input).transpose();
        let row = |first: usize| RowDVector::from_iterator(n, space.c.view((output, first), (1, n)).iter().copied());
        let (turns, follows_speed) = (row(0), row(n));
        let mut goes_on = DVector::zeros(n);
        for (shape, decay_per_s) in self.shapes.column_iter().zip(&self.decays_per_s) {
            let shape = shape.into_owned();
            if !is_significant(&force, &shape) {
                continue;
            }
            if *decay_per_s > CREEPS_PER_S {
                goes_on += &shape * ((&force * &shape)[0] / *decay_per_s);
            } else if is_significant(&turns, &shape) || is_significant(&follows_speed, &shape) {
                return true;
            }
        }
        is_significant(&turns, &goes_on)
    }
}

/// Whether the product of a row and displacements is more than the rounding of its terms.
fn is_significant(row: &RowDVector<f64>, displacements: &DVector<f64>) -> bool {
    let terms: f64 = row.iter().map(|entry| entry.abs()).sum();
    (row * displacements)[0].abs() > SIGNIFICANT * displacements.amax() * terms
}

/// The `count` slowest motions without damping, by inverse iteration about a squared frequency, 1/s²: `Φᵀ M Φ = 1`.
fn slowest(system: &Linearised, count: usize, about: f64) -> Option<DMatrix<f64>> {
    let factors = system.stiffness.combine(1.0, &system.mass, about).factor().ok()?;
    // Any vectors with a part in every motion.
    let mut basis = DMatrix::from_fn(system.mass.rows(), count, |i, k| 1.0 + ((i + 7 * k) as f64 * 1.234_567).sin());
    for _ in 0..ITERATIONS {
        for k in 0..count {
            let mut next = DVector::from_vec(system.mass.times(basis.column(k).into_owned().as_slice()));
            factors.solve(next.as_mut_slice());
            basis.set_column(k, &next);
        }
        for k in 0..count {
            let mut own = basis.column(k).into_owned();
            let inertia = |x: &DVector<f64>| DVector::from_vec(system.mass.times(x.as_slice()));
            for _ in 0..2 {
                let parts = basis.columns(0, k).tr_mul(&inertia(&own));
                own -= basis.columns(0, k) * parts;
            }
            let norm = own.dot(&inertia(&own)).sqrt();
            basis.set_column(k, &(own / norm));
        }
    }
    basis.iter().all(|entry| entry.is_finite()).then_some(basis)
}

#[cfg(test)]
mod tests {
    use std::error::Error;

    use super::super::examples::arm;
    use super::super::{StateSpace, Subject, modes};
    use super::FreeMotions;

    /// Of two free links, a constant torque under a damper turns the first at `τ/c` for ever, and brings the second to a constant rate;
    /// without one, both rates grow. The crank's angle was not named: both eigenvalues 0 came with the second link's turning.
    #[test]
    fn regress_what_grows_of_two_free_links_is_told() -> Result<(), Box<dyn Error>> {
        for model in ["rigid", "modal", "finite-element"] {
            for (damper_nm_s, speeds_grow) in [(0.0, true), (5e-4, false), (0.05, false), (5.0, false)] {
                let overrides = [format!("solver.model={model}"), format!("base.damper_nm_s_per_rad={damper_nm_s}")];
                let subject = Subject::new(&arm(&overrides.each_ref().map(String::as_str))?, None)?;
                let point = subject.at_rest(0.5)?;
                let space = StateSpace::new(&subject, &point)?;
                let free = FreeMotions::new(&space, &modes(&subject, &point, 6)?);
                assert_eq!(free.decays_per_s.len(), 2, "{model}, {damper_nm_s}");
                let grows = |name: &str| {
                    let output =
                        space.outputs.iter().position(|output| output == name).ok_or_else(|| format!("{:?}", space.outputs))?;
                    Ok::<bool, Box<dyn Error>>(free.let_grow(&space, [0, output]))
                };
                assert!(grows("crank_angle_rad")? && grows("rod_chord_rad")?, "{model}, {damper_nm_s}");
                assert_eq!(grows("crank_speed_rad_per_s")?, speeds_grow, "{model}, {damper_nm_s}");
                assert!(model == "rigid" || !grows("crank_deflection_m")?, "{model}, {damper_nm_s}");
            }
        }
        Ok(())
    }

    /// A slow swing beside the free motion had a part in it: what swings was said to grow.
    #[test]
    fn regress_a_slow_swing_is_not_taken_for_free() -> Result<(), Box<dyn Error>> {
        let [angles, speeds] = [["crank_angle_rad", "rod_chord_rad"], ["crank_speed_rad_per_s", "rod_chord_speed_rad_per_s"]];
        for (keys, angle_rad, grow) in [
            (["gravity.y_m_per_s2=-9.81", "rod.length_m=10"], 0.0, vec![angles[0], speeds[0], "tip_y_m"]),
            (["gravity.y_m_per_s2=-9.81", "rod.length_m=30"], 0.0, vec![angles[0], speeds[0], "tip_y_m"]),
            (["base.torsion_spring_nm_per_rad=1e-4", "gravity.y_m_per_s2=0"], 0.5, vec![]),
        ] {
            let overrides = [&["solver.model=rigid"][..], &keys].concat();
            let subject = Subject::new(&arm(&overrides)?, None)?;
            let point = subject.at_rest(angle_rad)?;
            let space = StateSpace::new(&subject, &point)?;
            let free = FreeMotions::new(&space, &modes(&subject, &point, 6)?);
            let names = space.outputs.iter().enumerate().filter(|(output, _)| free.let_grow(&space, [0, *output]));
            let names: Vec<&str> = names.map(|(_, name)| name.as_str()).filter(|name| !name.starts_with("crank_chord")).collect();
            assert_eq!(names, grow, "{keys:?}");
        }
        Ok(())
    }
}
