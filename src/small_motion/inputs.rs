//! Inputs of a linearised mechanism: torque, a force on the slider or the tip, forces on masses.

use nalgebra::{DMatrix, DVector};

use super::linearised::Linearised;
use super::outputs::Outputs;
use super::point::Point;
use super::subject::Subject;
use crate::mechanics::Mechanism;
use crate::scene::{Chain, End, Resistance};

/// A force beside which the residual of a mechanism in equilibrium is rounding, N or N·m.
const LARGE: f64 = 1_048_576.0;

/// One input.
pub(super) struct InputColumn {
    /// The name, with its unit.
    pub(super) name: String,
    /// `−∂r/∂u`.
    pub(super) force: DVector<f64>,
    /// Change of the readings by the input itself, at the same motion.
    pub(super) direct: DVector<f64>,
}

/// Every input at a point.
pub(super) fn inputs(subject: &Subject, point: &Point, system: &Linearised, outputs: &mut Outputs<'_>) -> Vec<InputColumn> {
    let mut inputs = Vec::new();
    if subject.is_oscillator() {
        for mass in 0..point.q.len() {
            let force = DVector::from_fn(point.q.len(), |k, _| if k == mass { 1.0 } else { 0.0 });
            let direct = DVector::zeros(outputs.names.len());
            inputs.push(InputColumn { name: format!("mass_{}_force_n", mass + 1), force, direct });
        }
        return inputs;
    }
    if !subject.is_held() {
        let mut mechanism = subject.mechanism();
        let direct = slope(|torque_nm| {
            let mut turned = point.clone();
            turned.input.torque_nm += torque_nm;
            outputs.values(mechanism.as_mut(), &turned)
        });
        inputs.push(InputColumn { name: "torque_nm".to_owned(), force: DVector::from_vec(system.torque.clone()), direct });
    }
    if let Some(force) = slider_row(subject, point) {
        let direct = slope(|force_n| outputs.values(subject.changed(|chain| push(chain, force_n)).as_mut(), point));
        inputs.push(InputColumn { name: "slider_force_n".to_owned(), force, direct });
    }
    if subject.chain().is_some_and(|chain| matches!(chain.end, End::Free { .. })) {
        inputs.extend(["x", "y"].into_iter().enumerate().map(|(axis, name)| {
            let force = -by_tip_force(subject, axis, |mechanism| residual(mechanism, point));
            let direct = by_tip_force(subject, axis, |mechanism| outputs.values(mechanism, point));
            InputColumn { name: format!("tip_force_{name}_n"), force, direct }
        }));
    }
    inputs
}

/// Change of residuals or readings by a force of 1 N along an axis at the free end: by gravity with 1 kg there, less that without a mass.
/// Both are affine in gravity, so that this is exact but for rounding of the links' weight.
fn by_tip_force(subject: &Subject, axis: usize, mut of: impl FnMut(&mut dyn Mechanism) -> DVector<f64>) -> DVector<f64> {
    let mut by_gravity = |carried_kg: f64| {
        slope(|gravity_m_per_s2| {
            let mut mechanism = subject.changed(|chain| {
                chain.gravity_m_per_s2 = [0.0; 2];
                chain.gravity_m_per_s2[axis] = gravity_m_per_s2;
                if let End::Free { tip_mass_kg } = &mut chain.end {
                    *tip_mass_kg = carried_kg;
                }
            });
            of(mechanism.as_mut())
        })
    };
    by_gravity(1.0) - by_gravity(0.0)
}

fn residual(mechanism: &mut dyn Mechanism, point: &Point) -> DVector<f64> {
    let mut r = vec![0.0; point.q.len()];
    mechanism.residual(&point.input, &point.q, &point.v, &point.a, &mut r);
    DVector::from_vec(r)
}

/// The slope of an affine function, exact to rounding.
fn slope(mut of: impl FnMut(f64) -> DVector<f64>) -> DVector<f64> {
    (of(LARGE) - of(-LARGE)) / (2.0 * LARGE)
}

/// `J = ∂x/∂q` of the slider, on which a force along x acts: `r(F) = r(0) − Jᵀ F`, exact to rounding since r is affine in F.
pub(super) fn slider_row(subject: &Subject, point: &Point) -> Option<DVector<f64>> {
    if !matches!(subject.chain()?.end, End::Slider(_)) {
        return None;
    }
    Some(-slope(|force_n| residual(subject.changed(|chain| push(chain, force_n)).as_mut(), point)))
}

/// Adds a force along x to the resistance of the slider, which acts against x.
fn push(chain: &mut Chain, force_n: f64) {
    let End::Slider(slider) = &mut chain.end else { return };
    match &mut slider.resistance {
        Resistance::Constant(resistance_n) => *resistance_n -= force_n,
        Resistance::Table(rows) => rows.iter_mut().for_each(|row| row[1] -= force_n),
    }
}

/// The inputs' columns side by side.
pub(super) fn beside(columns: &[InputColumn], of: fn(&InputColumn) -> &DVector<f64>, rows: usize) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(rows, columns.len());
    for (mut place, column) in matrix.column_iter_mut().zip(columns) {
        place.copy_from(of(column));
    }
    matrix
}
