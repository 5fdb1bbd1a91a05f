//! Axes and signs of `cycle` are those of published samples and of the guide's sketch.

use std::f64::consts::TAU;

use flexcrank::scene::SceneSource;
use flexcrank::simulation::Simulation;
use flexcrank::study::cycle::{Options, cycle};

use crate::{Outcome, column, compressor, largest};

#[test]
fn regress_the_rod_turns_as_on_the_bus() -> Outcome {
    let table = cycle(&compressor(&[]), &Options { points: 361, ..Options::default() })?;
    let mut simulation = Simulation::new(&compressor(&[]).scene)?;
    let [angles, rods, rates] =
        ["crank_angle_rad", "rod_angle_rad", "rod_rate_rad_per_s"].map(|name| column(&table, name).to_vec());
    for _ in 0..50 {
        simulation.step()?;
        let seen = simulation.observe()?;
        let crank = seen.links[0].chord_rad.rem_euclid(TAU);
        let row = angles.iter().rposition(|angle| *angle <= crank).unwrap_or(0).min(359);
        let within = (crank - angles[row]) / (angles[row + 1] - angles[row]);
        let at = |values: &[f64]| values[row] + within * (values[row + 1] - values[row]);
        assert!((seen.links[1].chord_rad - at(&rods)).abs() < 1e-4, "{} and {}", seen.links[1].chord_rad, at(&rods));
        assert!((seen.links[1].rate_rad_per_s - at(&rates)).abs() < 1e-2 * largest(&rates));
    }
    Ok(())
}

/// The guide's formula: `a = (fx − resistance − c v)/m + gravity_x`, from what the bus publishes.
#[test]
fn val_the_acceleration_of_the_slider_follows_from_published_loads() {
    let (step_s, friction, gravity, mass) = (1e-4, 3.0, 2.0, 0.5);
    let keys = [
        "solver.model=rigid".to_owned(),
        "solver.integrator=runge-kutta".to_owned(),
        format!("solver.step_s={step_s}"),
        format!("slider.mass_kg={mass}"),
        format!("slider.friction_n_s_per_m={friction}"),
        format!("gravity.x_m_per_s2={gravity}"),
        "slider.resistance_n=7".to_owned(),
    ];
    let mut simulation = Simulation::new(&SceneSource::open("crank-slider", &keys).unwrap().scene).unwrap();
    let mut seen = Vec::new();
    for _ in 0..5000 {
        simulation.step().unwrap();
        let now = simulation.observe().unwrap();
        let v = now.links[1].nodes.last().unwrap().velocity_m_per_s[0];
        let a = (now.slider_pin_n.unwrap()[0] - now.resistance_n.unwrap() - friction * v) / mass + gravity;
        seen.push([v, a]);
    }
    let most = seen.iter().map(|[_, a]| a.abs()).fold(0.0, f64::max);
    // The pulse ends at 0.1 s.
    for three in seen[1001..].windows(3) {
        let difference = (three[2][0] - three[0][0]) / (2.0 * step_s);
        assert!((difference - three[1][1]).abs() < 1e-5 * most, "{difference} for {three:?}, of {most}");
    }
}

/// Axes and signs as the guide's sketch has them: of angles, torque, resistance and deflections.
#[test]
fn val_axes_and_signs_are_those_of_the_sketch() {
    let after_a_step = |overrides: &[&str]| {
        let keys: Vec<String> = ["pulse=[]", "solver.step_s=1e-4"].iter().chain(overrides).map(|&key| key.to_owned()).collect();
        let mut simulation = Simulation::new(&SceneSource::open("crank-slider", &keys).unwrap().scene).unwrap();
        simulation.step().unwrap();
        simulation.observe().unwrap().clone()
    };
    let angle = 42.0_f64.to_radians();
    let pushed = after_a_step(&["start.angle_rad=0.7330382858376184", "torque.constant_nm=1"]);
    let [crank, rod] = &pushed.links[..] else { panic!("two links") };
    let [pin, slider] = [crank, rod].map(|link| link.nodes.last().unwrap().position_m);
    assert!((pin[0] - 0.5 * angle.cos()).abs() < 1e-6 && (pin[1] - 0.5 * angle.sin()).abs() < 1e-6, "{pin:?}");
    assert!(slider[0] > pin[0] && slider[1] == 0.0 && rod.chord_rad < 0.0, "{slider:?}, {}", rod.chord_rad);
    assert!(crank.rate_rad_per_s > 0.0, "torque turns counter-clockwise: {}", crank.rate_rad_per_s);
    let resisted = after_a_step(&["start.angle_rad=0.7330382858376184", "slider.resistance_n=10"]);
    let velocity = resisted.links[1].nodes.last().unwrap().velocity_m_per_s[0];
    assert!(velocity < 0.0, "resistance acts along −x: {velocity}");
    let hanging = after_a_step(&["gravity.y_m_per_s2=-9.81", "start.static_equilibrium=true"]);
    let sag = hanging.links[1].nodes[2];
    assert!(sag.deflection_m.unwrap() < -1e-3 && sag.position_m[1] < 0.0, "{sag:?}");
}
