//! Symmetries and limits.

use super::*;

/// Chord angles after 0.05 s from a pulse.
fn run(scene: &Scene, torque_nm: f64, time: f64) -> State {
    let (mut system, mut state) = Driven::new(scene, raised_cosine(torque_nm, 0.04 * time));
    let mut scheme = Scheme::runge_kutta(state.q.len());
    advance(&mut scheme, &mut system, 2e-5 * time, 0, 2500, &mut state);
    state
}

#[test]
fn prop_mirror_image() {
    let mut scene = everything();
    scene.chain.end = slider(0.3);
    let mut mirror = scene.clone();
    mirror.chain.gravity_m_per_s2[1] *= -1.0;
    mirror.chain.start.angle_rad *= -1.0;
    mirror.chain.start.rate_rad_per_s *= -1.0;
    let (a, b) = (run(&scene, 20.0, 1.0), run(&mirror, -20.0, 1.0));
    let links = &Modal::new(&scene).chain.links;
    for (k, (a, b)) in a.q.iter().zip(&b.q).enumerate() {
        let axial = links.iter().any(|link| (link.at + link.bending..link.at + link.coordinates()).contains(&k));
        assert!((a + if axial { -b } else { *b }).abs() < 1e-12, "{k}: {a} {b}");
    }
}

#[test]
fn prop_scaling() {
    let (length, mass, time) = (2.3, 0.7, 1.9);
    let scene = everything();
    let mut scaled = scene.clone();
    let force = mass * length / (time * time);
    for link in &mut scaled.chain.links {
        link.length_m *= length;
        link.mass_kg *= mass;
        link.centre_of_mass_m *= length;
        link.inertia_kg_m2 *= mass * length * length;
        link.damping_s *= time;
        if let Some(bar) = &mut link.bar {
            bar.area_m2 *= length * length;
            bar.second_moment_m4 *= length.powi(4);
            bar.density_kg_per_m3 *= mass / length.powi(3);
            bar.youngs_modulus_pa *= force / (length * length);
        }
    }
    scaled.chain.gravity_m_per_s2 = scaled.chain.gravity_m_per_s2.map(|g| g * length / (time * time));
    scaled.chain.base.torsion_spring_nm_per_rad *= force * length;
    scaled.chain.base.damper_nm_s_per_rad *= force * length * time;
    scaled.chain.start.rate_rad_per_s /= time;
    let resistance = Resistance::Table([[0.5, 3.0], [2.0, 40.0], [5.0, -7.0]].map(|[a, f]| [a, f * force]).to_vec());
    scaled.chain.end = End::Slider(Slider { mass_kg: 0.4 * mass, resistance, friction_n_s_per_m: 3.0 * force * time / length });
    let (a, b) = (run(&scene, 20.0, 1.0), run(&scaled, 20.0 * force * length, time));
    for (k, (a, b)) in a.q.iter().zip(&b.q).enumerate() {
        let scale = if k == 0 { 1.0 } else { length };
        assert!((a - b / scale).abs() < 1e-9, "{k}: {a} {b}");
    }
}

#[test]
fn prop_free_rotation_makes_no_strain_but_the_centrifugal() {
    // A straight chain turning freely stays straight: its coordinates of bending stay zero to round-off.
    let mut scene = crank_slider(8.333e-10);
    scene.chain.end = End::Free { tip_mass_kg: 0.5 };
    scene.chain.start = Start { angle_rad: 0.3, rate_rad_per_s: 20.0, static_equilibrium: false };
    let (mut system, mut state) = Driven::new(&scene, torque(0.0));
    let mut scheme = Scheme::runge_kutta(state.q.len());
    advance(&mut scheme, &mut system, 5e-5, 0, 20_000, &mut state);
    let angles = [state.q[0], state.q[system.model.chain.links[1].at - 1]];
    assert!(angles.iter().all(|angle| (angle - 20.3).abs() < 1e-10), "{angles:?}");
    let out = system.look(1.0, &mut state);
    assert!(out.energy.strain_j.unwrap() < 1e-20, "{:?}", out.energy);
}

#[test]
fn prop_stiff_link_tends_to_rigid() {
    let mut rigid = crank_slider(8.333e-10);
    rigid.chain.links[0].rigid = true;
    let run = |scene: &Scene| {
        let (mut system, mut state) = Driven::new(scene, raised_cosine(20.0, 0.04));
        let mut scheme = Scheme::generalized_alpha(state.q.len());
        advance(&mut scheme, &mut system, 1e-4, 0, 2000, &mut state);
        state.q[0]
    };
    let expected = run(&rigid);
    let errors = [1.0, 1e2, 1e4].map(|factor| {
        let mut stiff = rigid.clone();
        stiff.chain.links[0].rigid = false;
        if let Some(bar) = &mut stiff.chain.links[0].bar {
            bar.youngs_modulus_pa *= factor;
        }
        (run(&stiff) - expected).abs()
    });
    println!("stiffer crank, distance to the rigid one: {errors:?}");
    assert!(errors[2] < 1e-5 && errors[2] < errors[1] && errors[1] < errors[0]);
}

#[test]
fn val_rigid_links_follow_the_closed_form() {
    let mut scene = everything();
    scene.chain.base = Base::default();
    scene.chain.end = slider(0.4);
    let (l1, l2) = (0.5, 1.5);
    for link in &mut scene.chain.links {
        link.rigid = true;
        link.centre_of_mass_m *= 0.7;
        link.inertia_kg_m2 *= 1.6;
    }
    let (m1, m2, m3) = (scene.chain.links[0].mass_kg, scene.chain.links[1].mass_kg, 0.4);
    let (r1, r2) = (scene.chain.links[0].centre_of_mass_m, scene.chain.links[1].centre_of_mass_m);
    let (i1, i2) = (scene.chain.links[0].inertia_kg_m2, scene.chain.links[1].inertia_kg_m2);
    let mut model = Modal::new(&scene);
    let mut random = random(7);
    for _ in 0..100 {
        let (angle, rate, acceleration) = (4.0 * random(), 20.0 * random(), 300.0 * random());
        let mut r = [0.0];
        model.residual(&torque(2.0)(0.0), &[angle], &[rate], &[acceleration], &mut r);
        // the thesis, equations 4.3 to 4.23
        let lambda = l1 / l2;
        let (sin, cos) = angle.sin_cos();
        let c = (1.0 - (lambda * sin).powi(2)).sqrt();
        let per_angle = lambda * cos / c; // ∂φ/∂θ
        let phi2 = lambda.powi(3) * cos * cos * sin / c.powi(3) - lambda * sin / c; // ∂²φ/∂θ²
        let second = |first: f64, curvature: f64| first * acceleration + curvature * rate * rate;
        let phi = second(per_angle, phi2);
        let (x_phi, x_phi2) = (-lambda * sin * per_angle, -c * per_angle * per_angle - lambda * sin * phi2); // of cos φ
        let (y_phi, y_phi2) = (-lambda * cos, lambda * sin); // of −sin φ
        let gravity = [1.3, -9.81];
        let bodies = [
            (m1, [-r1 * sin, r1 * cos], [-r1 * cos, -r1 * sin]),
            (m2, [-l1 * sin + r2 * x_phi, l1 * cos + r2 * y_phi], [-l1 * cos + r2 * x_phi2, -l1 * sin + r2 * y_phi2]),
            (m3, [-l1 * sin + l2 * x_phi, 0.0], [-l1 * cos + l2 * x_phi2, 0.0]),
        ];
        let mut expected = i1 * acceleration + i2 * phi * per_angle - 2.0;
        for (mass, first, curvature) in bodies {
            for axis in 0..2 {
                expected += mass * (second(first[axis], curvature[axis]) - gravity[axis]) * first[axis];
            }
        }
        assert!((r[0] - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{} {expected}", r[0]);
    }
}
