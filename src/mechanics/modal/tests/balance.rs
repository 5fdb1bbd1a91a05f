//! Balance of energy, forces and moments.

use super::*;

/// Motion for chains whose tangent is prescribed.
fn wobble(t: f64) -> [f64; 3] {
    let w = 3.0 * t;
    [0.4 + w + 5.0 * w.sin(), 3.0 + 15.0 * w.cos(), -45.0 * w.sin()]
}

fn energy_j(out: &Observation) -> f64 {
    out.energy.kinetic_j + out.energy.strain_j.unwrap() + out.energy.potential_j.unwrap()
}

/// Momentum of links and end, from velocities of many nodes by Simpson's rule.
fn momentum(scene: &Scene, out: &Observation) -> [f64; 2] {
    let mut p = [0.0; 2];
    for (link, observed) in scene.chain.links.iter().zip(&out.links) {
        let n = observed.nodes.len() - 1;
        for (i, node) in observed.nodes.iter().enumerate() {
            let weight = if i == 0 || i == n {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            };
            for (p, v) in p.iter_mut().zip(node.velocity_m_per_s) {
                *p += link.mass_kg * weight / (3 * n) as f64 * v;
            }
        }
    }
    let mass = match &scene.chain.end {
        End::Free { tip_mass_kg } => *tip_mass_kg,
        End::Slider(slider) => slider.mass_kg,
    };
    let end = out.links.last().unwrap().nodes.last().unwrap().velocity_m_per_s;
    [p[0] + mass * end[0], p[1] + mass * end[1]]
}

#[test]
fn prop_power_and_forces_balance() {
    for (name, mut scene) in every_chain() {
        scene.chain.links.iter_mut().for_each(|link| link.elements = 128);
        let motion = name == "driven";
        let input = move |t: f64| Input { torque_nm: 2.0, motion: motion.then(|| wobble(t)) };
        let (mut system, mut state) = Driven::new(&scene, input);
        let (h, mut scheme) = (2e-6, Scheme::runge_kutta(state.q.len()));
        let mut looks = Vec::new();
        let mut power = [0.0; 2];
        advance(&mut scheme, &mut system, h, 0, 9_999, &mut state);
        for step in 9_999..10_002 {
            let t = step as f64 * h;
            looks.push(system.look(t, &mut state));
            if step == 10_000 {
                power = system.model.power(&input(t), &state.q, &state.v, &state.a);
            }
            advance(&mut scheme, &mut system, h, step, step + 1, &mut state);
        }
        let rate = (energy_j(&looks[2]) - energy_j(&looks[0])) / (2.0 * h);
        let unexplained = rate - power[0] + power[1];
        assert!(unexplained.abs() < 1e-5 * (power[0].abs() + power[1].abs()), "{name}: {unexplained:e} of {power:?}");

        let out = &looks[1];
        let (before, after) = (momentum(&scene, &looks[0]), momentum(&scene, &looks[2]));
        let mut outside = out.pivot_n.unwrap();
        outside[1] += out.guide_n.unwrap_or(0.0);
        outside[0] -= out.resistance_n.unwrap_or(0.0);
        let end = out.links.last().unwrap().nodes.last().unwrap();
        if let End::Slider(slider) = &scene.chain.end {
            outside[0] -= slider.friction_n_s_per_m * end.velocity_m_per_s[0];
            outside = [outside[0] + slider.mass_kg * 1.3, outside[1] - slider.mass_kg * 9.81];
        } else {
            outside = [outside[0] + 0.7 * 1.3, outside[1] - 0.7 * 9.81];
        }
        let mass: f64 = scene.chain.links.iter().map(|link| link.mass_kg).sum();
        for (axis, gravity) in [1.3, -9.81].into_iter().enumerate() {
            let rate = (after[axis] - before[axis]) / (2.0 * h);
            let error = rate - outside[axis] - mass * gravity;
            assert!(error.abs() < 1e-5 * (1.0 + outside[axis].abs()), "{name} axis {axis}: {error:e} of {outside:?}");
        }
    }
}

#[test]
fn prop_internal_forces_meet_the_ends() {
    for (name, scene) in every_chain() {
        let motion = name == "driven";
        let input = move |t: f64| Input { torque_nm: 2.0, motion: motion.then(|| wobble(t)) };
        let (mut system, mut state) = Driven::new(&scene, input);
        let mut scheme = Scheme::runge_kutta(state.q.len());
        advance(&mut scheme, &mut system, 4e-6, 0, 5_000, &mut state);
        let out = system.look(0.02, &mut state);
        let [tangent, rate] = system.model.chain.tangent();
        let root = out.links[0].elements[0].moment_start_nm;
        let torque = 2.0 + out.motion_torque_nm.unwrap_or(0.0) - 30.0 * tangent - 0.2 * rate;
        assert!((root + torque).abs() < 1e-9 * (1.0 + torque.abs()), "{name}: {root} {torque}");
        for link in &out.links {
            let end = link.elements.last().unwrap();
            assert!(end.moment_end_nm.abs() < 1e-9 * (1.0 + torque.abs()), "{name}");
        }
        if let (Some(rod), Some(pin)) = (out.links.get(1), out.crank_pin_n) {
            assert!(rod.elements[0].moment_start_nm.abs() < 1e-9 * (1.0 + torque.abs()), "{name}");
            let force = rod.elements[0].axial_n.hypot(rod.elements[0].shear_n);
            assert!((force / pin[0].hypot(pin[1]) - 1.0).abs() < 0.3, "{name}: {force} {pin:?}");
        }
    }
}

#[test]
fn prop_energy_stays_over_100_revolutions() {
    let (mut system, mut state) = Driven::new(&crank_slider(8.333e-10), raised_cosine(20.0, 0.1));
    let (h, mut scheme) = (1e-4, Scheme::midpoint(state.q.len()));
    advance(&mut scheme, &mut system, h, 0, 1000, &mut state);
    let energy = |system: &mut Driven, t: f64, state: &State| energy_j(&system.look(t, &mut state.clone()));
    let first = energy(&mut system, 0.1, &state);
    let (mut worst, mut halves, mut step) = (0.0_f64, [0.0; 2], 1000);
    while state.q[0] < 100.0 * TAU {
        advance(&mut scheme, &mut system, h, step, step + 50, &mut state);
        step += 50;
        let error = energy(&mut system, step as f64 * h, &state) / first - 1.0;
        worst = worst.max(error.abs());
        let half = &mut halves[usize::from(state.q[0] > 50.0 * TAU)];
        *half = f64::max(*half, error.abs());
    }
    println!("energy: largest relative error {worst:.2e}, first and second half {halves:?}");
    assert!(worst < 1e-5 && halves[1] < 1.5 * halves[0]);
}
