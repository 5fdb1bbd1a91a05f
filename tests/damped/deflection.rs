//! The estimate of a deflection's error, beside the true error: against the same run with a step that is converged.

use flexcrank::scene::SceneSource;
use flexcrank::simulation::Simulation;

/// A plunger pump, turned at a constant speed. Its rod's vibration fades within a turn.
const PUMP: &str = "
[crank]
length_m = 0.012
rigid = true
mass_kg = 0.5
inertia_kg_m2 = 0.005
[rod]
length_m = 0.07
section = { shape = \"round\", diameter_m = 0.005 }
density_kg_per_m3 = 7900
youngs_modulus_pa = 1.95e11
axial = true
elements = 4
damping_s = 5e-7
[slider]
mass_kg = 0.25
resistance_table = [[0, 0], [3.1416, 0], [3.2416, 150], [6.1832, 150], [6.2831, 0]]
[solver]
model = \"modal\"
";
const DRIVEN: &str = "drive.ramp={to_rad_per_s=43.98,over_s=0.5}";
const MOTOR: [&str; 2] = ["torque.constant_nm=9", "base.damper_nm_s_per_rad=0.19"];
/// Differences of the last second of a run count: the estimate is of the present error.
const LAST_S: f64 = 1.0;
const LOOK_EVERY_S: f64 = 0.01;

/// Deflections of the last link's middle in the last second, m, and the largest estimate there, m.
fn run(scene: &str, given: &[&str], until_s: f64, step_s: f64) -> (Vec<f64>, f64) {
    let given: Vec<String> = given.iter().map(|key| (*key).to_owned()).chain([format!("solver.step_s={step_s:e}")]).collect();
    let source = if scene.contains('\n') { SceneSource::parse("pump", scene, &given) } else { SceneSource::open(scene, &given) };
    let mut simulation = Simulation::new(&source.unwrap().scene).unwrap();
    let (steps, between) = ((until_s / step_s).round() as u64, (LOOK_EVERY_S / step_s).round() as u64);
    let (mut deflections_m, mut estimate_m) = (Vec::new(), 0.0_f64);
    for step in 1..=steps {
        simulation.step().unwrap();
        if step % between == 0 && step as f64 * step_s > until_s - LAST_S {
            let nodes = &simulation.observe().unwrap().links.last().unwrap().nodes;
            deflections_m.push(nodes[nodes.len() / 2].deflection_m.unwrap());
            estimate_m = estimate_m.max(simulation.error_estimate().unwrap().deflection_m());
        }
    }
    (deflections_m, estimate_m)
}

/// A sum that never fades was 230 times the error of the driven pump after 10 s, and grew on; 60 times that of the pump on a motor. What
/// an error of the angle brings in is 0.8 of the default scene's.
#[test]
fn val_the_estimate_of_a_deflection_fades_as_vibration_does_and_follows_the_angle() {
    let one = ["solver.integrator=esdirk"];
    let driven: &[&str] = &[&one[..], &[DRIVEN]].concat();
    let motor: &[&str] = &[&one[..], &MOTOR].concat();
    let gentle: &[&str] = &["pulse=[]", "drive.speed_rad_per_s=10.0"];
    let second: &[&str] = &["solver.integrator=generalized-alpha"];
    // Nothing fades that the crank, or both links, do beside turning.
    let ringing: &[&str] = &[gentle, &["crank.damping_s=0"]].concat();
    let undamped: &[&str] = &[ringing, &["rod.damping_s=0"]].concat();
    let ringing_of_second: &[&str] = &[ringing, second].concat();
    for (scene, given, until_s, step_s, range) in [
        (PUMP, driven, 4.0, 4e-5, [0.5, 2.0]),
        (PUMP, motor, 4.0, 4e-5, [0.3, 3.0]),
        ("crank-slider", gentle, 20.0, 2e-3, [1.0, 15.0]),
        ("crank-slider", &one, 20.0, 2e-3, [0.3, 3.0]),
        ("crank-slider", &one, 2.0, 1e-3, [0.3, 3.0]),
        ("crank-slider", second, 2.0, 1e-3, [0.3, 3.0]),
        ("crank-slider", second, 20.0, 1e-3, [0.05, 3.0]),
        ("ref-r2s", &one, 2.0, 1e-3, [0.3, 3.0]),
        ("crank-slider", ringing, 4.0, 2e-3, [1.0, 15.0]),
        ("crank-slider", undamped, 4.0, 2e-3, [0.3, 3.0]),
        ("crank-slider", ringing_of_second, 4.0, 1e-3, [1.0, 15.0]),
    ] {
        let (found_m, estimate_m) = run(scene, given, until_s, step_s);
        let (converged_m, _) = run(scene, given, until_s, step_s / 4.0);
        let error_m = found_m.iter().zip(&converged_m).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let of_error = estimate_m / error_m;
        println!("{given:?}, {until_s} s: {error_m:.1e} m, estimate {of_error:.2} of it");
        assert!((range[0]..range[1]).contains(&of_error), "{given:?}, {until_s} s: {error_m:e} m, estimate {of_error}");
    }
}
