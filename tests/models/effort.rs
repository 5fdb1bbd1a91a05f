//! The cost of steps, and the memory of many of them.

use std::f64::consts::TAU;

use flexcrank::integrate::Effort;
use flexcrank::scene::ModelKind;

use crate::bench::{FINITE, MIDPOINT, MODAL, RIGID, asked, chord, energy_j, look, scene, simulation, start};

#[test]
fn regress_newton_needs_three_iterations_a_step_at_most() {
    for model in [MODAL, FINITE] {
        for scheme in [&["solver.integrator=generalized-alpha"][..], &MIDPOINT[..]] {
            let mut run = simulation("ref-r2s", &[&[model, "solver.step_s=1e-4"], scheme].concat());
            let mut iterations = 0;
            for _ in 0..20_000 {
                run.step().unwrap();
                iterations += run.newton_iterations().unwrap();
            }
            assert!(iterations <= 3 * 20_000, "{model}, {scheme:?}: {iterations} iterations in 20,000 steps");
        }
    }
}

/// Effort frozen: a slowdown that no timing would show. Half a second of R2s, its pulse included.
#[test]
fn regress_effort() {
    let effort = |(model, step_s): (&str, &str)| {
        let mut run = simulation("ref-r2s", &[model, "solver.integrator=generalized-alpha", &format!("solver.step_s={step_s}")]);
        let mut effort = [0; 2];
        while run.time_s() < 0.5 - 1e-9 {
            run.step().unwrap();
            let Effort { newton_iterations, factorizations, .. } = run.effort();
            effort = [effort[0] + newton_iterations, effort[1] + factorizations];
        }
        effort
    };
    let found = [(MODAL, "1e-3"), (MODAL, "1e-4"), (FINITE, "1e-3"), (FINITE, "1e-4")].map(effort);
    assert_eq!(found, [[998, 500], [5000, 5000], [1117, 500], [5000, 5000]]);
}

/// The default scene as it stands, to 1 s, and by finite elements.
#[test]
fn regress_effort_of_the_default_scene() {
    let effort = |keys: &[&str]| {
        let mut run = simulation("crank-slider", keys);
        let (mut newton_iterations, mut factorizations) = (0, 0);
        while run.time_s() < 1.0 - 1e-9 {
            run.step().unwrap();
            newton_iterations += run.effort().newton_iterations;
            factorizations += run.effort().factorizations;
        }
        assert_eq!(run.retried(), 0);
        [newton_iterations, factorizations]
    };
    let found = [&[][..], &["solver.step_s=1e-3"], &["solver.step_s=1e-4"], &[FINITE, "solver.step_s=1e-3"]].map(effort);
    assert_eq!(found, [[5791, 505], [9062, 1004], [50301, 10001], [16479, 3322]]);
}

/// Processor time of this thread, s.
fn thread_s() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// The least time of a Newton iteration with its solution, for an element. Sixteen times as many elements would take sixteen times
/// as long each if the cost were quadratic.
#[test]
fn prop_the_cost_of_a_step_is_linear_in_the_elements() {
    let cost_s = |elements: usize| {
        let mesh = [format!("crank.elements={elements}"), format!("rod.elements={elements}")];
        let keys = [&[FINITE, "solver.integrator=generalized-alpha"][..], &mesh.each_ref().map(String::as_str)].concat();
        let mut run = simulation("ref-r2s", &keys);
        let turn = |_| {
            let (begun_s, mut iterations) = (thread_s(), 0);
            for _ in 0..400 / elements.min(100) {
                run.step().unwrap();
                iterations += run.newton_iterations().unwrap();
            }
            (thread_s() - begun_s) / f64::from(iterations) / elements as f64
        };
        (0..20).map(turn).fold(f64::INFINITY, f64::min)
    };
    let (few, many) = (cost_s(50), cost_s(800));
    println!("{few:e} s and {many:e} s for an element");
    assert!(many < 2.0 * few, "{few:e} s for each of 50 elements a link, {many:e} s for each of 800");
}

/// A model's memory of the last state saves work and changes nothing: neither observations between steps nor a restart from a
/// checkpoint change a bit.
#[test]
fn prop_looks_and_checkpoints_change_no_bit() {
    const FINE: [&str; 1] = ["solver.step_s=1e-5"];
    let loaded = ["slider.friction_n_s_per_m=3.0", "slider.resistance_n=2.0", "base.damper_nm_s_per_rad=0.1"];
    let scenes = [
        // As it stands, except for the explicit scheme's step.
        ("crank-slider", Vec::new()),
        ("ref-r2s", FINE.to_vec()),
        ("crank-slider", [&FINE[..], &loaded].concat()),
        ("ref-r3", FINE.to_vec()),
        // At rest, but for rounding.
        ("crank-slider", [&FINE[..], &["pulse=[]", "start.angle_rad=0.7"]].concat()),
    ];
    for (name, overrides) in &scenes {
        for model in [ModelKind::Rigid, ModelKind::Modal, ModelKind::FiniteElement] {
            for integrator in model.integrators() {
                let kinds = [("model", model.as_str()), ("integrator", integrator.as_str())];
                let kinds = kinds.map(|(key, word)| format!("solver.{key}={word}"));
                let explicit = integrator.as_str() == "runge-kutta";
                let overrides = if explicit { [overrides, &FINE[..]].concat() } else { overrides.clone() };
                let scene = scene(name, &[overrides.as_slice(), &kinds.each_ref().map(String::as_str)].concat());
                let (mut plain, mut looked) = (start(&scene), start(&scene));
                for _ in 0..40 {
                    plain.step().unwrap();
                    looked.step().unwrap();
                    look(&mut looked);
                }
                let mut resumed = start(&scene);
                assert!(resumed.restore(&plain.checkpoint()));
                for run in [&mut plain, &mut looked, &mut resumed] {
                    (0..40).for_each(|_| run.step().unwrap());
                }
                let expected = format!("{:?}", plain.checkpoint());
                for run in [&looked, &resumed] {
                    assert_eq!(format!("{:?}", run.checkpoint()), expected, "{name}, {kinds:?}");
                }
            }
        }
    }
}

/// The default scene without damping and stretch: the crank's angle goes on without a jump, time is steps times step, and the rod's deflection
/// and the energy stay what they are once the pulse's ringing has settled, after a tenth of the turns.
///
/// The pulse is made rectangular: as long as the rod's first period, it leaves little of it, where the scene's own leaves the rod
/// vibrating by 4 % of its length and trading energy with the rotation for good.
///
/// With stretch, links that nothing damps take the energy of the rotation for good, by axial vibration and the sooner the finer the
/// step resolves it, by whatever scheme: within 300 revolutions the deflection is three times what it was (h = 0.2 ms).
///
/// The loss of a scheme grows with the turns: the second bound of each case is for 10,000 turns, or 10⁶ rigid ones, which
/// `tests/heavy/turns` asks for.
#[test]
fn prop_hundreds_of_revolutions_leave_the_motion_as_it_was() {
    const UNDAMPED: [&str; 5] =
        ["pulse.0.shape=rectangular", "crank.damping_s=0", "rod.damping_s=0", "crank.axial=false", "rod.axial=false"];
    let (flexible, rigid) = (asked("FLEXCRANK_TURNS", 300.0), asked("FLEXCRANK_RIGID_TURNS", 1000.0));
    let is_long = flexible > 300.0;
    let cases = [
        ("ESDIRK", [&UNDAMPED[..], &["solver.step_s=5e-4"]].concat(), flexible, [2e-3, 1.5e-2]),
        (
            "generalized-alpha",
            [&UNDAMPED[..], &["solver.integrator=generalized-alpha", "solver.step_s=1e-3", "crank.modes=2", "rod.modes=2"]]
                .concat(),
            flexible,
            [2e-3, 3e-3],
        ),
        ("midpoint", [&UNDAMPED[..], &MIDPOINT, &["solver.step_s=1e-3"]].concat(), flexible, [2e-3, 3e-3]),
        ("rigid", vec![RIGID, "solver.integrator=runge-kutta", "solver.step_s=1e-3"], rigid, [2e-6, 5e-4]),
    ];
    for (name, overrides, turns, bounds) in cases {
        let bound = bounds[usize::from(is_long)];
        let mut run = simulation("crank-slider", &overrides);
        let (run_step_s, begun_s) = (run.step_s(), thread_s());
        let (mut last, mut settled, mut bows) = (chord(look(&mut run)), None, [0.0_f64; 10]);
        while last < turns * TAU {
            run.step().unwrap();
            let seen = look(&mut run);
            let crank = &seen.links[0];
            let jump = crank.chord_rad - last - crank.rate_rad_per_s * run_step_s;
            assert!(jump.abs() < 0.02, "{name}: {} rad after {last} rad", crank.chord_rad);
            last = crank.chord_rad;
            let tenth = (last / TAU / turns * 10.0).clamp(0.0, 9.0) as usize;
            bows[tenth] = bows[tenth].max(seen.links[1].nodes[2].deflection_m.unwrap_or(0.0).abs());
            if tenth == 1 {
                settled.get_or_insert(energy_j(seen));
            }
        }
        let kept = energy_j(run.observation()) / settled.unwrap() - 1.0;
        println!("{name}: {turns} turns, {:.1} s; energy {kept:e}, deflections {bows:?}", thread_s() - begun_s);
        assert_eq!(run.time_s(), run.step_count() as f64 * run_step_s);
        assert!(kept.abs() < bound, "{name}: energy changes by {kept:e}");
        assert!((bows[9] - bows[1]).abs() <= 0.02 * bows[1], "{name}: deflections {bows:?} m");
    }
}
