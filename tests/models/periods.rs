//! R3 and R5 against figures that stand in the literature and in closed forms; the thesis's method on a flexible case.

use std::f64::consts::PI;

use crate::bench::{FINITE, MODAL, chord, look, rod_middle, rows, simulation, slider, worst};

/// The hinged beam on a spring. Its largest chord angle is stated as the largest of the reference's rows, every 0.05 s; the crest
/// itself falls between two rows (a parabola through the three highest gives 1.763178 and 0.595315 mrad).
#[test]
fn val_r5_periods_and_peaks() {
    let cases = [("ref-r5", 3.558931, [1.763173e-3, 1.763178e-3]), ("ref-r5-tip", 10.552821, [0.595_306_9e-3, 0.595_314_8e-3])];
    for (scene, period_s, [of_rows, of_all]) in cases {
        for (model, detail) in [(MODAL, "beam.modes=2"), (FINITE, "beam.elements=16")] {
            let mut run = simulation(scene, &[model, detail, "solver.step_s=5e-4"]);
            let (mut rises, mut row_peak, mut peak, mut last) = (Vec::new(), 0.0_f64, 0.0_f64, 0.0);
            while rises.len() < 2 {
                run.step().unwrap();
                let angle = chord(look(&mut run));
                if last < 0.0 && angle >= 0.0 {
                    rises.push(run.time_s() - run.step_s() * angle / (angle - last));
                }
                peak = peak.max(angle);
                if run.step_count().is_multiple_of(100) && run.time_s() < 20.0 {
                    row_peak = row_peak.max(angle);
                }
                last = angle;
            }
            let errors = [(rises[1] - rises[0]) / period_s, row_peak / of_rows, peak / of_all].map(|ratio| ratio - 1.0);
            assert!(errors.iter().all(|error| error.abs() < 5e-6), "{scene}, {model}: {errors:?}");
        }
    }
}

/// Mid-span deflection over length of the rod at 150 rad/s, at 45°, 90°, 270°, 450°, and at its peak.
#[test]
fn val_r3_deflections_to_the_digits_stated() {
    let stated = [(1, 0.01535), (2, 0.00561), (6, -0.00759), (10, 0.00650)];
    let steps = 4000; // in an eighth of a turn
    let step = format!("solver.step_s={}", PI / 4.0 / 150.0 / f64::from(steps));
    for (model, bound) in [(FINITE, 5e-6), (MODAL, 0.02 * 0.01554)] {
        let mut run = simulation("ref-r3", &[model, &step, "rod.elements=8"]);
        let mut peak = 0.0_f64;
        for k in 1..=16 * steps {
            run.step().unwrap();
            if k % 10 == 0 {
                let ratio = rod_middle(look(&mut run)) / 0.3;
                peak = peak.max(ratio.abs());
                if let Some((_, value)) = stated.iter().find(|(eighths, _)| eighths * steps == k) {
                    assert!((ratio - value).abs() < bound, "{model}: {ratio} for {value}");
                }
            }
        }
        assert!((peak - 0.01554).abs() < bound, "{model}: peak {peak}");
    }
}

/// Against the true motion of the thesis's own elements, one a link, in a case that bends: its method tends to a wrong limit as
/// the step shrinks.
#[test]
fn val_the_thesis_method_is_off_on_flexible_links() {
    let reference = rows("thesis/ref_flexible_crank_slider_Jz1e-9.csv");
    let cases = [
        ("solver.model=incremental", "two-point", "0.1", "0.55", 1.2e-2..1.5e-2),
        ("solver.model=incremental", "two-point", "0.001", "0.55", 1.0e-3..1.2e-3),
        ("solver.model=incremental", "two-point", "0.0001", "0.55", 1.4e-3..1.7e-3),
    ];
    for (model, integrator, step, weight, bounds) in cases {
        let solver = [("integrator", integrator), ("step_s", step), ("weight", weight)];
        let solver = solver.map(|(key, value)| format!("solver.{key}={value}"));
        let bars = [model, "crank.second_moment_m4=1e-9", "rod.second_moment_m4=1e-9"];
        let overrides: Vec<&str> = solver.iter().map(String::as_str).chain(bars).collect();
        let [angle, x] = worst(&mut simulation("thesis-crank-slider", &overrides), &reference, [(8, chord), (6, slider)]);
        assert!(bounds.contains(&angle) && x < angle, "{model}, step {step} s: {angle:e} rad, {x:e} m");
    }
}

#[test]
fn regress_a_slow_beam_gains_no_energy() {
    for model in ["solver.model=modal", "solver.model=finite-element"] {
        let mut run = simulation("ref-r5-tip", &[model, "solver.step_s=5e-4"]);
        let [one, other] = [1.0, 21.0].map(|until_s| {
            while run.time_s() < until_s - 1e-9 {
                run.step().unwrap();
            }
            let energy = run.observe().unwrap().energy;
            energy.kinetic_j + energy.strain_j.unwrap()
        });
        assert!((other / one - 1.0).abs() < 1e-7, "{model}: {one} J becomes {other} J");
    }
}
