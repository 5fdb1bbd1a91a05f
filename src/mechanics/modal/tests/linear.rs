//! Linear theory: natural frequencies, buckling, static deflection.

use super::*;
use nalgebra::DMatrix;

const HELD: Weights = Weights { acceleration: 0.0, velocity: 0.0, position: 1.0 };
const MASS: Weights = Weights { acceleration: 1.0, velocity: 0.0, position: 0.0 };

/// One of the tangents at a state.
fn matrix(model: &mut Modal, input: &Input, q: &[f64], w: Weights) -> DMatrix<f64> {
    let n = q.len();
    let zero = vec![0.0; n];
    let mut r = zero.clone();
    model.chain.residual(input, q, &zero, &zero, &mut r);
    DMatrix::from_row_slice(n, n, model.tangent.assemble(&mut model.chain, &zero, w))
}

/// Natural frequencies about `q = 0`, ascending, rad/s.
fn frequencies(scene: &Scene, input: &Input) -> Vec<f64> {
    let mut model = Modal::new(scene);
    let q = vec![0.0; model.degrees_of_freedom()];
    let (k, m) = (matrix(&mut model, input, &q, HELD), matrix(&mut model, input, &q, MASS));
    let inverse = m.cholesky().unwrap().l().try_inverse().unwrap();
    let mut squares: Vec<f64> = (&inverse * k * inverse.transpose()).symmetric_eigenvalues().iter().copied().collect();
    squares.sort_by(f64::total_cmp);
    squares.into_iter().map(f64::sqrt).collect()
}

/// A rod on a rigid crank held at angle 0, with a force `force_n` along −x on its massless slider.
fn held_rod(force_n: f64) -> Scene {
    let mut scene = crank_slider(8.333e-10);
    scene.chain.links[0].rigid = true;
    scene.drive = Drive::Motion(Motion::Speed(0.0));
    let resistance = Resistance::Constant(force_n);
    scene.chain.end = End::Slider(Slider { mass_kg: 0.0, resistance, friction_n_s_per_m: 0.0 });
    scene
}

#[test]
fn val_pinned_beam_frequencies_and_buckling() {
    let (ej, per_length, length) = (2.1e11 * 8.333e-10, 0.77, 1.5);
    let held = speed(0.0)(0.0);
    for (k, frequency) in frequencies(&held_rod(0.0), &held).iter().enumerate() {
        let expected = ((k + 1) as f64 * PI / length).powi(2) * f64::sqrt(ej / per_length);
        assert!((frequency / expected - 1.0).abs() < 1e-12);
    }
    let euler = PI * PI * ej / (length * length);
    assert!(frequencies(&held_rod(0.9999 * euler), &held)[0] > 0.0);
    assert!(frequencies(&held_rod(1.0001 * euler), &held)[0].is_nan());
}

#[test]
fn val_buckled_rod_follows_the_elastica_near_the_euler_load() {
    let (ej, length) = (2.1e11 * 8.333e-10, 1.5);
    let euler = PI * PI * ej / (length * length);
    let mut model = Modal::new(&held_rod(1.002 * euler));
    let held = speed(0.0)(0.0);
    let mut q = vec![0.06, 0.0];
    for _ in 0..20 {
        let k = matrix(&mut model, &held, &q, HELD);
        let mut r = vec![0.0; 2];
        model.chain.residual(&held, &q, &[0.0; 2], &[0.0; 2], &mut r);
        let step = k.lu().solve(&nalgebra::DVector::from_vec(r)).unwrap();
        q.iter_mut().zip(step.iter()).for_each(|(q, s)| *q -= s);
    }
    let slope = (8.0 * 0.002_f64).sqrt(); // P/P_E = 1 + α²/8 + …, w/L = α/π
    let [deflection, expected] = [q[0] / length, slope / PI];
    println!("elastica: w/L {deflection} expected {expected}");
    assert!((deflection / expected - 1.0).abs() < 0.01);
}

#[test]
fn val_clamped_and_spinning_beam_frequencies() {
    let (ej, per_length, length) = (2.1e11 * 8.333e-10, 0.77, 0.5_f64);
    let unit = f64::sqrt(ej / per_length) / (length * length);
    for (modes, bound) in [(2, 2e-3), (4, 7e-4), (8, 1e-4)] {
        let mut beam = bar(LinkName::Beam, length, 1e-4, 8.333e-10, 7700.0, 2.1e11);
        beam.modes = modes;
        let mut scene = scene(vec![beam], End::Free { tip_mass_kg: 0.0 });
        scene.drive = Drive::Motion(Motion::Speed(0.0));
        // Wright, Smith, Thresher & Wang (J. Appl. Mech. 49, 1982): flapping frequency of a rotating cantilever without hub;
        // in the plane of rotation its square is less by the square of the speed.
        for (spin, flap) in [(0.0, 3.5160), (1.0, 3.6817), (2.0, 4.1373), (4.0, 5.5850), (8.0, 9.2568)] {
            let expected = f64::sqrt(flap * flap - spin * spin);
            let frequency = frequencies(&scene, &speed(spin * unit)(0.0))[0] / unit;
            println!("{modes} modes, spin {spin}: {frequency:.5} expected {expected:.5} ({:.1e})", frequency / expected - 1.0);
            assert!((frequency / expected - 1.0).abs() < bound);
        }
    }
}

#[test]
fn val_static_equilibrium_of_a_held_beam() {
    // Crank angle held, gravity across: pinned beam under its own weight, w = 5 q L⁴/(384 EJ) at mid-span, and the base spring's
    // torque at its end.
    let mut scene = crank_slider(8.333e-10);
    scene.chain.links[0].rigid = true;
    scene.chain.gravity_m_per_s2 = [0.0, -9.81];
    scene.chain.start.static_equilibrium = true;
    scene.chain.links[1].modes = 4;
    let (mut system, mut state) = Driven::new(&scene, torque(0.0));
    let middle = system.look(0.0, &mut state).links[1].nodes[4].deflection_m.unwrap();
    let expected = -5.0 * 0.77 * 9.81 * 1.5_f64.powi(4) / (384.0 * 2.1e11 * 8.333e-10);
    println!("static {middle} {expected}");
    assert!((middle / expected - 1.0).abs() < 1e-3);
}
