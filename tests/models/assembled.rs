//! Mechanisms by themselves: their matrices, natural frequencies, tangents.

use flexcrank::mechanics::{FiniteElement, Input, Mechanism, Modal, Observation, Rigid, Weights};
use flexcrank::scene::{Drive, ModelKind, Scene};
use nalgebra::{DMatrix, DVector};

/// The mechanism that a scene asks for.
pub fn mechanism(scene: &Scene) -> Box<dyn Mechanism> {
    let prescribed = matches!(scene.drive, Drive::Motion(_));
    let chain = scene.chain().unwrap();
    match scene.solver.model {
        ModelKind::Rigid => Box::new(Rigid::new(chain, prescribed)),
        ModelKind::Modal => Box::new(Modal::new(chain, prescribed)),
        ModelKind::FiniteElement => Box::new(FiniteElement::new(chain, prescribed)),
        other => panic!("{other:?} is no mechanism of a chain"),
    }
}

/// Its coordinates and velocities at the start.
pub fn start(mechanism: &mut dyn Mechanism, input: &Input) -> [Vec<f64>; 2] {
    let zero = vec![0.0; mechanism.degrees_of_freedom()];
    let (mut q, mut v) = (zero.clone(), zero);
    mechanism.start(input, &mut q, &mut v);
    [q, v]
}

const STIFFNESS: Weights = Weights { acceleration: 0.0, velocity: 0.0, position: 1.0 };

/// Mass matrix, column by column from the residual, which is linear in accelerations, and flexibility `K⁻¹` from the factored
/// tangent, both at rest at `q`.
fn matrices(model: &mut dyn Mechanism, input: &Input, q: &[f64]) -> [DMatrix<f64>; 2] {
    let n = q.len();
    let zero = vec![0.0; n];
    let (mut at_rest, mut moved) = (zero.clone(), zero.clone());
    model.residual(input, q, &zero, &zero, &mut at_rest);
    let (mut mass, mut flexibility) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    for j in 0..n {
        let mut unit = zero.clone();
        unit[j] = 1.0;
        model.residual(input, q, &zero, &unit, &mut moved);
        (0..n).for_each(|i| mass[(i, j)] = moved[i] - at_rest[i]);
    }
    model.factor(input, q, &zero, &zero, STIFFNESS).unwrap();
    for j in 0..n {
        let mut unit = zero.clone();
        unit[j] = 1.0;
        model.solve(&mut unit);
        (0..n).for_each(|i| flexibility[(i, j)] = unit[i]);
    }
    [mass, flexibility]
}

/// The pivot held at the scene's start.
fn held(scene: &Scene) -> Input {
    Input { motion: Some([scene.chain().unwrap().start.angle_rad, 0.0, 0.0]), ..Input::default() }
}

/// Squares of the natural frequencies of a scene whose pivot stands still, ascending, (rad/s)²: `K x = λ M x` by `1/λ` from
/// `Lᵀ K⁻¹ L` with `M = L Lᵀ`.
pub fn squared_frequencies(scene: &Scene) -> Vec<f64> {
    let (mut model, input) = (mechanism(scene), held(scene));
    let [q, _] = start(&mut *model, &input);
    let [mass, flexibility] = matrices(&mut *model, &input, &q);
    let lower = mass.cholesky().unwrap().l();
    let mut squares: Vec<f64> =
        (lower.transpose() * flexibility * lower).symmetric_eigenvalues().iter().map(|x| 1.0 / x).collect();
    squares.sort_by(f64::total_cmp);
    squares
}

/// The rod's mid-span deflection in an equilibrium with the pivot held, found by Newton's iteration from the start bent by
/// `guess_m` in its slowest mode.
pub fn bent_equilibrium_m(scene: &Scene, guess_m: f64) -> f64 {
    let (mut model, input) = (mechanism(scene), held(scene));
    let [mut q, zero] = start(&mut *model, &input);
    let middle_m = |model: &mut dyn Mechanism, q: &[f64]| {
        let mut out = Observation::default();
        out.links.resize_with(2, Default::default);
        model.observe(&input, q, &zero, &zero, &mut out);
        crate::bench::middle(&out.links[1])
    };
    let [mass, flexibility] = matrices(&mut *model, &input, &q);
    let mut mode = DVector::from_fn(q.len(), |i, _| (1.0 + i as f64).sin());
    for _ in 0..40 {
        mode = (&flexibility * &mass * mode).normalize();
    }
    let tilted = |by: f64| q.iter().zip(mode.iter()).map(|(q, mode)| q + by * mode).collect::<Vec<f64>>();
    let scale = guess_m / (1e6 * middle_m(&mut *model, &tilted(1e-6)));
    q = tilted(scale);
    let mut r = zero.clone();
    for _ in 0..50 {
        model.residual(&input, &q, &zero, &zero, &mut r);
        model.factor(&input, &q, &zero, &zero, STIFFNESS).unwrap();
        model.solve(&mut r);
        q.iter_mut().zip(&r).for_each(|(q, r)| *q -= r);
    }
    assert!(crate::bench::largest(r) < 1e-9, "Newton's iteration comes to rest");
    middle_m(&mut *model, &q)
}
