//! Against the reference solutions (`/work/shared/reference` at the start of the project, thinned).

use super::*;

/// Largest error of the crank's chord angle on R2s with `modes` a link.
fn r2s_error(modes: usize, axial: bool, steps_per_row: usize) -> f64 {
    let mut scene = crank_slider(8.333e-10);
    for link in &mut scene.chain.links {
        link.modes = modes;
        link.axial = axial;
    }
    let (mut system, mut state) = Driven::new(&scene, raised_cosine(20.0, 0.1));
    let mut scheme = Scheme::runge_kutta(state.q.len());
    let h = 0.02 / steps_per_row as f64;
    let mut worst = 0.0_f64;
    for (i, row) in reference("R2s").iter().enumerate() {
        worst = worst.max((state.q[0] - row[2]).abs());
        advance(&mut scheme, &mut system, h, i * steps_per_row, (i + 1) * steps_per_row, &mut state);
    }
    worst
}

#[test]
fn val_r2s_chord_angle() {
    for (modes, axial, steps, bound) in
        [(2, false, 200, 2.8e-3), (3, false, 200, 9e-4), (4, false, 400, 6e-4), (3, true, 400, 4.2e-4), (4, true, 400, 1.5e-4)]
    {
        let error = r2s_error(modes, axial, steps);
        println!("R2s {modes} modes, axial {axial}: {error:.2e}");
        assert!(error < bound, "{modes} modes, axial {axial}: {error:e}");
    }
}

/// Largest error of the crank's chord angle in `column` over a pulse of `torque_nm` on `[0, 0.1)` s; largest angle in its rows.
fn pulse_error(scene: &Scene, h: f64, torque_nm: f64, file: &str, column: usize) -> [f64; 2] {
    let (mut system, mut state) = Driven::new(scene, torque(torque_nm));
    let mut scheme = Scheme::generalized_alpha(state.q.len());
    let (mut step, mut worst, mut peak) = (0, 0.0_f64, 0.0_f64);
    let pulse = (0.1 / h).round() as usize;
    for row in reference(file) {
        let to = (row[0] / h).round() as usize;
        while step < to {
            if step == pulse {
                system.input = Box::new(torque(0.0));
            }
            advance(&mut scheme, &mut system, h, step, step + 1, &mut state);
            step += 1;
        }
        peak = peak.max(state.q[0]);
        worst = worst.max((state.q[0] - row[column]).abs());
    }
    [worst, peak]
}

#[test]
fn val_r1_practically_rigid() {
    let mut scene = crank_slider(1e-5);
    let [error, _] = pulse_error(&scene, 2e-4, 1.0, "R1", 1);
    println!("R1 flexible: {error:.2e}");
    assert!(error < 1e-5, "{error:e}");
    scene.chain.links.iter_mut().for_each(|link| link.rigid = true);
    let [error, _] = pulse_error(&scene, 1e-4, 1.0, "R1", 2);
    println!("R1 rigid: {error:.2e}");
    assert!(error < 1e-7, "{error:e}");
}

/// Time from the first to the third zero of the chord angle after a pulse.
fn period(scene: &Scene, h: f64) -> f64 {
    let (mut system, mut state) = Driven::new(scene, torque(0.1));
    let mut scheme = Scheme::generalized_alpha(state.q.len());
    let mut zeros = Vec::new();
    let mut step = 0;
    while zeros.len() < 3 {
        if step == (0.1 / h).round() as usize {
            system.input = Box::new(torque(0.0));
        }
        let last = state.q[0];
        advance(&mut scheme, &mut system, h, step, step + 1, &mut state);
        if last * state.q[0] < 0.0 {
            zeros.push(h * (step as f64 + last / (last - state.q[0])));
        }
        step += 1;
    }
    zeros[2] - zeros[0]
}

#[test]
fn val_r5_hinged_beam_on_a_spring() {
    // The peaks are those of the rows, 0.05 s apart.
    let cases = [(0.0, "R5_mtip0", 1.763173e-3, 3.558931), (100.0, "R5_mtip100", 0.5953069e-3, 10.552821)];
    for (tip_mass_kg, file, peak, expected) in cases {
        let beam = bar(LinkName::Beam, 0.5, 0.01, 1e-5, 7700.0, 2.1e11);
        let mut scene = scene(vec![beam], End::Free { tip_mass_kg });
        scene.chain.base.torsion_spring_nm_per_rad = 10.0;
        let [error, own_peak] = pulse_error(&scene, 1e-3, 0.1, file, 1);
        let period = period(&scene, 5e-4);
        println!("{file}: {error:.2e}, peak {own_peak:.9}, period {period:.7}");
        assert!(error < 1e-7, "{file}: {error:e}");
        assert!((own_peak / peak - 1.0).abs() < 5e-6 && (period / expected - 1.0).abs() < 5e-6, "{own_peak} {period}");
    }
}

/// A rod on a rigid crank at constant speed: largest errors of slider position and of mid-span deflection, largest deflection,
/// and whether the model ever called itself out of range.
fn driven_error(scene: &Scene, rad_per_s: f64, file: &str, steps_per_row: usize) -> ([f64; 3], bool) {
    let (mut system, mut state) = Driven::new(scene, speed(rad_per_s));
    let mut scheme = Scheme::runge_kutta(state.q.len());
    let rows = reference(file);
    let h = rows[1][0] / steps_per_row as f64;
    let (mut worst, mut flagged) = ([0.0_f64; 3], false);
    for (i, row) in rows.iter().enumerate() {
        let out = system.look(row[0], &mut state);
        let middle = out.links[1].nodes[4].deflection_m.unwrap();
        worst[0] = worst[0].max((out.links[1].nodes[8].position_m[0] - row[1]).abs());
        worst[1] = worst[1].max((middle - row[2]).abs());
        worst[2] = worst[2].max(row[2].abs());
        flagged |= out.out_of_range.is_some();
        advance(&mut scheme, &mut system, h, i * steps_per_row, (i + 1) * steps_per_row, &mut state);
    }
    (worst, flagged)
}

/// A rigid crank and a rod of one section with a prescribed speed.
fn driven_rod(lengths: [f64; 2], area: f64, moment: f64, density: f64, youngs: f64, slider_kg: f64) -> Scene {
    let link = |name, length| bar(name, length, area, moment, density, youngs);
    let mut scene = scene(vec![link(LinkName::Crank, lengths[0]), link(LinkName::Rod, lengths[1])], slider(slider_kg));
    scene.chain.links[0].rigid = true;
    scene.drive = Drive::Motion(Motion::Speed(0.0));
    scene
}

#[test]
fn val_r3_rod_at_150_rad_per_s() {
    let d = 6e-3_f64;
    let scene = driven_rod([0.15, 0.30], 0.25 * PI * d * d, PI * d.powi(4) / 64.0, 7870.0, 2e11, 0.033);
    let ([x, deflection, peak], flagged) = driven_error(&scene, 150.0, "R3", 40);
    println!("R3: x_C {x:.2e} m, mid-span {deflection:.2e} m of {peak:.3e}");
    assert!(deflection < 0.005 * peak && x < 4e-5 && !flagged);
}

#[test]
fn val_r4m_is_flagged() {
    let scene = driven_rod([0.5, 1.5], 2.5e-5, 5.2083333e-11, 7700.0, 2.1e11, 0.0);
    let ([x, deflection, peak], flagged) = driven_error(&scene, 20.0, "R4m", 100);
    println!("R4m: x_C {x:.2e} m, mid-span {deflection:.2e} m of {peak:.3e}");
    assert!(flagged && deflection < 0.1 * peak);
}
