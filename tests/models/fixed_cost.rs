//! Steps of fixed cost: counts, errors, impulses, and what happens where the corrections are too few.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Instant;

use flexcrank::integrate::Effort;
use flexcrank::scene::{IntegratorKind, ModelKind, PulseShape, SceneSource};
use flexcrank::simulation::{EnergyVerdict, PulseRequest, SetpointRequest, Simulation};
use flexcrank::study::fixed_cost::{PART, TrialErrors, rate};

use flexcrank::study::trade::{Corrections, OutputGroup, Question, Selection, study, table};

use crate::bench::{FINITE, MIDPOINT, MODAL, RIGID, chord, look, run_to, scene, simulation, start};

/// Pulses that begin and end inside steps, several in one step, and a setpoint that ends inside one.
fn disturb(run: &mut Simulation) {
    let step_s = run.step_s();
    for (n, [at, lasts]) in [[0.3, 0.2], [0.7, 12.45], [20.15, 0.6], [20.85, 9.4], [25.0, 30.5]].into_iter().enumerate() {
        let shape = if n % 2 == 0 { PulseShape::Rectangular } else { PulseShape::RaisedCosine };
        let torque_nm = if n % 2 == 0 { 15.0 } else { -10.0 };
        run.add_pulse(&PulseRequest { torque_nm, duration_s: lasts * step_s, delay_s: at * step_s, shape }).unwrap();
    }
    run.set_torque(&SetpointRequest { torque_nm: 5.0, hold_s: 7.3 * step_s }).unwrap();
}

/// The efforts of a hundred steps under such loads.
fn efforts(name: &str, keys: &[&str]) -> BTreeSet<[u32; 3]> {
    let mut run = simulation(name, keys);
    disturb(&mut run);
    let step = |_| {
        run.step().unwrap();
        let Effort { residuals, newton_iterations, factorizations } = run.effort();
        [residuals, newton_iterations, factorizations]
    };
    (0..100).map(step).collect()
}

#[test]
fn regress_every_step_of_fixed_cost_takes_the_same_effort() {
    let esdirk: &[&str] = &["solver.integrator=esdirk"];
    let alpha: &[&str] = &["solver.integrator=generalized-alpha"];
    let explicit: &[&str] = &["solver.integrator=runge-kutta"];
    for (name, model, scheme, corrections, effort) in [
        ("crank-slider", &[MODAL, "solver.step_s=2e-3"][..], esdirk, 2, [12, 10, 1]),
        ("crank-slider", &[MODAL, "solver.step_s=2e-3"], esdirk, 3, [17, 15, 1]),
        ("crank-slider", &[FINITE, "solver.step_s=5e-4"], esdirk, 4, [22, 20, 1]),
        ("crank-slider", &[MODAL, "solver.step_s=1e-3"], alpha, 4, [6, 4, 1]),
        ("ref-r2s", &[FINITE, "solver.step_s=2e-4"], alpha, 4, [6, 4, 1]),
        ("crank-slider", &[RIGID, "solver.step_s=2e-3"], esdirk, 3, [17, 15, 1]),
        ("crank-slider", &[RIGID, "solver.step_s=2e-3"], &MIDPOINT, 3, [4, 3, 1]),
        ("crank-slider", &[RIGID, "solver.step_s=2e-3"], explicit, 0, [4, 0, 4]),
    ] {
        let fixed = format!("solver.corrections={corrections}");
        let found = efforts(name, &[model, scheme, &[fixed.as_str()]].concat());
        assert_eq!(found, BTreeSet::from([effort]), "{name}, {model:?}, {scheme:?}");
        let free = efforts(name, &[model, scheme].concat());
        assert!(free.len() > 1 || scheme == MIDPOINT, "{name}, {model:?}, {scheme:?}: {free:?}");
    }
}

/// Angles and deflections at the end of every fifth step.
fn motion(run: &mut Simulation, until_s: f64) -> Vec<[f64; 3]> {
    let mut motion = Vec::new();
    while run.time_s() < until_s {
        (0..5).for_each(|_| run.step().unwrap());
        let seen = look(run);
        let middle = |i: usize| seen.links.get(i).and_then(|link| link.nodes[link.nodes.len() / 2].deflection_m).unwrap_or(0.0);
        motion.push([chord(seen), middle(0), middle(1)]);
    }
    motion
}

fn difference(one: &[[f64; 3]], other: &[[f64; 3]]) -> f64 {
    assert_eq!(one.len(), other.len());
    one.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The number is the least that suffices, and the motion keeps to what the rating states.
#[test]
fn prop_a_rated_scene_keeps_to_its_rating() {
    for (name, keys) in [
        ("crank-slider", &[][..]),
        ("crank-slider", &["solver.step_s=5e-4"]),
        ("ref-r2s", &["solver.step_s=5e-4"]),
        ("ref-r2s", &["solver.integrator=esdirk", "solver.step_s=5e-4"]),
        ("ref-r3", &["solver.step_s=5e-5"]),
        ("ref-r2s", &[RIGID, "solver.integrator=runge-kutta", "solver.step_s=1e-3"]),
    ] {
        let rating = rate(&scene(name, keys), &mut |_| {}).unwrap();
        println!("{name} {keys:?}: {rating}");
        let rated: Vec<String> = rating.keys();
        let rated: Vec<&str> = [keys, &rated.iter().map(String::as_str).collect::<Vec<_>>()].concat();
        let mut run = simulation(name, &rated);
        let until_s = 0.9 * rating.until_s;
        let added = difference(&motion(&mut run, until_s), &motion(&mut simulation(name, keys), until_s));
        let own = &rating.trials[0];
        assert!(added <= 1.1 * (own.by_iteration + own.by_loads) + 1e-12, "{name}: {added:e}, rated {own:?}");
        assert_eq!(run.unconverged(), 0, "{name}");
        assert!(rating.trials.iter().all(|trial| trial.by_iteration <= PART * trial.of_step), "{name}: {rating:?}");
        if rating.corrections > 1 {
            let fewer = format!("solver.corrections={}", rating.corrections - 1);
            let fewer = [rated.as_slice(), &[&fewer]].concat();
            let fails = |trial: &TrialErrors| {
                let run = |keys: &[&str]| {
                    let mut run = simulation(name, keys);
                    trial.pulse.map(|pulse| run.add_pulse(&pulse).unwrap());
                    let mut left_over = 0.0_f64;
                    let angles = std::iter::from_fn(|| {
                        run.step().ok()?;
                        left_over = left_over.max(run.left_over());
                        Some(chord(look(&mut run)))
                    });
                    (
                        angles.take((0.9 * rating.until_s / scene(name, keys).solver.step_s) as usize).collect::<Vec<_>>(),
                        left_over,
                    )
                };
                let ((few, left_over), (many, _)) = (run(&fewer), run(&[keys, &["solver.corrections=20"]].concat()));
                let off = few.iter().zip(&many).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                few.len() < many.len() || off > 0.5 * PART * trial.of_step || left_over > 2.5e-3
            };
            assert!(rating.trials.iter().any(fails), "{name} {keys:?}: one correction fewer would do");
        }
    }
}

/// Rigid links under a smooth pulse keep the scheme's order. A pulse that begins and ends inside steps, by a third, leaves the second.
#[test]
fn order_of_steps_of_fixed_cost() {
    let disturbed = "pulse=[{start_s=0.00933333333333333, torque_nm=20.0, duration_s=0.0533333333333333}]";
    for (scheme, fixed) in [("esdirk", "solver.corrections=3"), ("runge-kutta", "solver.corrections=0")] {
        for (pulse, least) in [(None, 3.7), (Some(disturbed), 1.8)] {
            let angle = |halvings: i32| {
                let integrator = format!("solver.integrator={scheme}");
                let step = format!("solver.step_s={}", 4e-3 * 0.5_f64.powi(halvings));
                let keys: Vec<&str> = [RIGID, &integrator, &step, fixed].into_iter().chain(pulse).collect();
                let mut run = simulation("crank-slider", &keys);
                run_to(&mut run, 0.8);
                chord(look(&mut run))
            };
            let angles: Vec<f64> = (0..6).map(angle).collect();
            let errors: Vec<f64> = angles.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
            let order = (errors[0] / errors[4]).log2() / 4.0;
            println!("{scheme}, {pulse:?}: {errors:?}, order {order:.2}");
            assert!(order > least, "{scheme}, {pulse:?}: order {order:.2} of {errors:?}");
        }
    }
}

/// A rigid beam that turns freely gains the whole impulse, wherever the edges of pulses fall: `I Δω = Σ τ Δt`.
#[test]
fn prop_no_impulse_is_lost_at_a_fixed_cost() {
    let text = "[beam]\nlength_m = 1.0\nrigid = true\nmass_kg = 4.0\ncentre_of_mass_m = 0.3\ninertia_kg_m2 = 0.5\n\
                [start]\nrate_rad_per_s = 10.0\n";
    let inertia = 0.5 + 4.0 * 0.3 * 0.3;
    for model in [ModelKind::Rigid, ModelKind::Modal, ModelKind::FiniteElement] {
        for &integrator in model.integrators() {
            let keys = [
                format!("solver.model={}", model.as_str()),
                format!("solver.integrator={}", integrator.as_str()),
                format!("solver.corrections={}", if integrator == IntegratorKind::RungeKutta { 0 } else { 2 }),
            ];
            let mut run = simulation(text, &[&keys.each_ref().map(String::as_str)[..], &["solver.step_s=0.01"]].concat());
            disturb(&mut run);
            let step_s = run.step_s();
            (0..300).for_each(|_| run.step().unwrap());
            let impulse = step_s * (15.0 * (0.2 + 0.6 + 30.5) - 10.0 * (12.45 + 9.4) + 5.0 * 7.3);
            let error = inertia * (look(&mut run).links[0].rate_rad_per_s - 10.0) / impulse - 1.0;
            assert!(error.abs() < 1e-11, "{model:?}, {integrator:?}: {error:e} of {impulse} N·m·s");
        }
    }
}

/// A pulse may begin anywhere in a step, from rest too: no energy is lost or made, and nothing is declared diverged.
#[test]
fn prop_pulses_from_rest_keep_the_balance() {
    // Steps to the tolerance leave 1.8e-2 of it, in axial vibrations that the step does not resolve.
    const TOLERANCE: &str = "solver.balance_tolerance=2e-2";
    for scheme in
        [["solver.integrator=esdirk", "solver.corrections=4"], ["solver.integrator=runge-kutta", "solver.corrections=0"]]
    {
        for model in [RIGID, MODAL] {
            for twentieths in (0..20).filter(|_| !(model == MODAL && scheme[1].ends_with('0'))) {
                for shape in ["rectangular", "raised-cosine"] {
                    let start_s = 2e-3 * (3.0 + f64::from(twentieths) / 20.0);
                    let pulse = format!("pulse=[{{start_s={start_s}, torque_nm=20.0, duration_s=0.0513, shape='{shape}'}}]");
                    let mut run =
                        simulation("crank-slider", &[&[model, "solver.step_s=2e-3", TOLERANCE, &pulse], &scheme[..]].concat());
                    let ended = (0..100).try_for_each(|_| run.step());
                    assert_eq!(ended, Ok(()), "{scheme:?}, {model}, {pulse}");
                    assert_eq!(run.energy_verdict(), EnergyVerdict::Balanced, "{scheme:?}, {model}, {pulse}");
                }
            }
        }
    }
}

/// A pulse far beyond the trial's leaves residuals that are counted; one that no correction can follow is divergence.
#[test]
fn regress_corrections_that_are_too_few_are_counted_and_end_in_divergence() {
    let rated = rate(&scene("crank-slider", &[]), &mut |_| {}).unwrap().keys();
    let keys: Vec<&str> = rated.iter().map(String::as_str).collect();
    let ended = |torque_nm: f64| {
        let mut run = simulation("crank-slider", &keys);
        let request = PulseRequest { torque_nm, duration_s: 0.02, delay_s: 0.2003, shape: PulseShape::Rectangular };
        run.add_pulse(&request).unwrap();
        let ended = (0..300).try_for_each(|_| run.step());
        (run.unconverged(), ended.map_err(|diverged| diverged.to_string()))
    };
    let endings = [20.0, 200.0, 300.0, 400.0, 1e4].map(ended);
    println!("{endings:?}");
    assert_eq!(endings[0], (0, Ok(())));
    assert!(endings.iter().any(|(unconverged, ending)| *unconverged > 0 && ending.is_ok()), "{endings:?}");
    assert!(endings[4].1.as_ref().is_err_and(|why| why.contains("diverged in step")), "{endings:?}");
    // Corrections by hand are counted against the scene's own tolerance.
    let mut by_hand = simulation("crank-slider", &["solver.corrections=1"]);
    (0..50).for_each(|_| by_hand.step().unwrap());
    assert!(by_hand.unconverged() > 0 && by_hand.left_over() > 1e-9);
}

/// The strengths that the guide states: it named those of a raised cosine for pulses of any shape.
#[test]
fn val_the_default_scene_takes_the_pulses_that_the_guide_names() {
    let ended = |torque_nm, shape| {
        let mut run = simulation("crank-slider", &["solver.corrections=3"]);
        run.add_pulse(&PulseRequest { torque_nm, duration_s: 0.02, delay_s: 0.2, shape }).unwrap();
        (0..1000).try_for_each(|_| run.step()).is_ok().then(|| run.energy_verdict() == EnergyVerdict::Balanced)
    };
    let [cosine, rectangular] = [PulseShape::RaisedCosine, PulseShape::Rectangular];
    assert_eq!([400.0, 480.0].map(|torque_nm| ended(torque_nm, cosine)), [Some(true), None]);
    assert_eq!([100.0, 200.0].map(|torque_nm| ended(torque_nm, rectangular)), [Some(false), None]);
}

#[test]
fn prop_a_scene_that_does_not_iterate_is_rated_too() {
    for (name, keys) in [("thesis-crank-slider", &[][..]), ("thesis-compressor", &[]), ("thesis-two-masses", &[])] {
        let scene = scene(name, keys);
        let rating = rate(&scene, &mut |_| {}).unwrap();
        println!("{name}: {rating}");
        assert_eq!(rating.corrections == 0, !scene.solver.iterates(), "{name}: {rating:?}");
        assert_eq!(rating.tolerance.is_some(), scene.solver.iterates(), "{name}");
    }
}

/// A study says how many corrections suffice only if it is asked.
#[test]
fn prop_trade_reports_the_corrections_that_suffice() {
    let source = SceneSource::open("crank-slider", &[]).unwrap();
    let selection = Selection {
        models: vec![ModelKind::Modal, ModelKind::Rigid],
        integrators: vec![IntegratorKind::Esdirk, IntegratorKind::RungeKutta],
        steps_s: vec![1e-3],
        modes: vec![2],
        ..Selection::default()
    };
    let outputs = OutputGroup::DEFAULT.to_vec();
    let question = Question { selection, outputs, until_s: Some(0.2), budget_s: 60.0, enough: None };
    let mut study = study(&source.scene, &question, &mut |_| ControlFlow::Continue(())).unwrap();
    assert!(table(&study, None).column("corrections").is_none());
    study.rate_fixed_cost(&source.scene, &mut |_| ControlFlow::Continue(()));
    for (row, measured) in study.measured() {
        let explicit = row.configuration.family.integrator == IntegratorKind::RungeKutta;
        let Corrections::Suffice(number) = measured.corrections else {
            panic!("{}: {:?}", row.configuration, measured.corrections)
        };
        assert!(if explicit { number == 0 } else { (1..=4).contains(&number) }, "{}: {number}", row.configuration);
    }
    // `rigid`, and `modal` by both integrators; without stretch alone by Runge–Kutta, for which that is too stiff.
    assert_eq!(table(&study, None).column("corrections").map(<[f64]>::len), Some(4));
}

/// Steps of a measurement; FLEXCRANK_STEPS names another number.
const STEPS: usize = 1_000;
/// Repeats of the same steps: what the machine adds to one of them is not in the quickest. FLEXCRANK_REPEATS names another number.
const REPEATS: usize = 15;

/// Prints the wall time of single steps under a pulse every 50 ms: as the clock saw them, and the quickest of the repeats of each step,
/// beside constant work. It judges no time.
#[test]
fn measure_the_slowest_step() {
    let named = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let (steps, repeats) = (named("FLEXCRANK_STEPS").unwrap_or(STEPS), named("FLEXCRANK_REPEATS").unwrap_or(REPEATS));
    for (name, keys) in [
        ("crank-slider", &[][..]),
        ("ref-r2s", &["solver.step_s=5e-4"]),
        ("ref-r2s", &["solver.integrator=esdirk", "solver.step_s=5e-4"]),
    ] {
        // Damped, so that pulses do not add up.
        let keys = &[keys, &["base.damper_nm_s_per_rad=0.5", "slider.friction_n_s_per_m=5"]].concat()[..];
        let rated = rate(&scene(name, keys), &mut |_| {}).unwrap().keys();
        let fixed: Vec<&str> = [keys, &rated.iter().map(String::as_str).collect::<Vec<_>>()].concat();
        for (kind, keys) in [("to the tolerance", keys), ("fixed cost", fixed.as_slice())] {
            let scene = scene(name, keys);
            let (mut seen, mut best, mut unconverged) = (Vec::new(), vec![f64::INFINITY; steps], 0);
            for _ in 0..repeats {
                let mut run = start(&scene);
                let every = (0.05 / run.step_s()).round() as usize;
                for (n, best) in best.iter_mut().enumerate() {
                    if n % every == 0 {
                        let torque_nm = if (n / every).is_multiple_of(2) { 20.0 } else { -15.0 };
                        let (duration_s, delay_s) = (0.0213, 0.37 * run.step_s());
                        run.add_pulse(&PulseRequest { torque_nm, duration_s, delay_s, shape: PulseShape::Rectangular }).unwrap();
                    }
                    let begun = Instant::now();
                    run.step().unwrap();
                    let took_us = 1e6 * begun.elapsed().as_secs_f64();
                    *best = best.min(took_us);
                    seen.push(took_us);
                }
                unconverged = run.unconverged();
            }
            println!("{name} {keys:?}, {kind}: {unconverged} unconverged");
            println!("  as seen       {}\n  best of all  {}", quantiles(&mut seen), quantiles(&mut best));
        }
    }
    let mut work: Vec<f64> = (0..STEPS).map(|_| (0..repeats).map(|_| constant_work_us()).fold(f64::INFINITY, f64::min)).collect();
    println!("constant work\n  best of all  {}", quantiles(&mut work));
}

/// Median, the largest over it, and what lies between, µs.
fn quantiles(times_us: &mut [f64]) -> String {
    times_us.sort_by(f64::total_cmp);
    let last = times_us.len() - 1;
    let [p50, p99, p999, p9999, most] = [0.5, 0.99, 0.999, 0.9999, 1.0].map(|part| times_us[(part * last as f64) as usize]);
    format!("p50 {p50:.1}  p99 {p99:.1}  p99.9 {p999:.1}  p99.99 {p9999:.1}  max {most:.1} µs  max/p50 {:.2}", most / p50)
}

/// Time of a fixed number of dependent multiplications, about as long as a step.
fn constant_work_us() -> f64 {
    let begun = Instant::now();
    let mut x = 1.000_000_1_f64;
    for _ in 0..10_000 {
        x = std::hint::black_box(x * 1.000_000_000_1);
    }
    std::hint::black_box(x);
    1e6 * begun.elapsed().as_secs_f64()
}

/// A step in which the load jumps has no estimate of its own: none of an earlier step, which a checkpoint does not hold.
#[test]
fn regress_the_estimate_of_a_step_with_a_jump_is_that_of_a_restored_run() {
    let keys = &[MODAL, "solver.integrator=esdirk", "solver.step_s=2e-3", "solver.corrections=3"];
    let (mut run, mut restored) = (simulation("crank-slider", keys), simulation("crank-slider", keys));
    (0..50).for_each(|_| run.step().unwrap());
    assert!(restored.restore(&run.checkpoint()));
    for simulation in [&mut run, &mut restored] {
        simulation
            .add_pulse(&PulseRequest { torque_nm: 20.0, duration_s: 0.1, delay_s: 0.0, shape: PulseShape::Rectangular })
            .unwrap();
        simulation.step().unwrap();
    }
    assert!(run.effort().newton_iterations > 0 && run.checkpoint() == restored.checkpoint());
    assert_eq!(run.error_estimate(), restored.error_estimate());
}
