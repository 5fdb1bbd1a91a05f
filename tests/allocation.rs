//! No allocation after start-up, in any model, with any integrator that suits it.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

use flexcrank::scene::{IntegratorKind, ModelKind, SceneSource, builtin};
use flexcrank::simulation::{SetpointRequest, Simulation};

const MODELS: [ModelKind; 4] = [ModelKind::Rigid, ModelKind::Incremental, ModelKind::Modal, ModelKind::FiniteElement];

/// Allocations of a scene's first 200 steps, each observed.
fn of_scene(name: &str, overrides: &[String]) -> u64 {
    let mut run = Simulation::new(&SceneSource::open(name, overrides).unwrap().scene).unwrap();
    let counted = allocation_counter::measure(|| {
        for _ in 0..200 {
            run.step().unwrap();
            run.observe().unwrap();
        }
    });
    counted.count_total
}

/// Those of the default scene with another model.
fn allocations(model: ModelKind, integrator: IntegratorKind, elements: u32) -> u64 {
    let mut overrides = vec![
        format!("solver.model={}", model.as_str()),
        format!("solver.integrator={}", integrator.as_str()),
        format!("crank.elements={elements}"),
        format!("rod.elements={elements}"),
    ];
    if integrator == IntegratorKind::RungeKutta {
        // The links' stretch asks for it.
        overrides.push("solver.step_s=1e-5".to_owned());
    }
    of_scene("crank-slider", &overrides)
}

/// Oscillators, beams, single links, and what prescribes a motion or a load.
#[test]
fn regress_no_scene_allocates_in_a_step() {
    for scene in builtin::BUILTIN {
        assert_eq!(of_scene(scene.name, &[]), 0, "{}", scene.name);
    }
    for given in [
        "drive={ speed_rad_per_s = 20.0 }",
        "drive={ ramp = { to_rad_per_s = 20.0, over_s = 0.1 } }",
        "drive={ table = [[0, 0], [0.1, 1], [0.3, 2], [0.6, 3]] }",
        "slider.resistance_table=[[0.0, 10], [1.0, 50], [2.0, 0]]",
        "gravity.y_m_per_s2=-9.81",
    ] {
        let overrides = ["pulse=[]", given].map(str::to_owned);
        assert_eq!(of_scene("crank-slider", &overrides), 0, "{given}");
    }
}

#[test]
fn regress_steps_and_looks_allocate_nothing() {
    for model in MODELS {
        let elements = if model == ModelKind::Incremental { 1 } else { 8 };
        for &integrator in model.integrators() {
            let count = allocations(model, integrator, elements);
            assert_eq!(count, 0, "{model:?}, {integrator:?}");
        }
    }
}

#[test]
fn regress_setpoints_allocate_nothing() {
    for model in MODELS {
        let integrator = model.usual_integrator().as_str();
        let elements = if model == ModelKind::Incremental { 1 } else { 4 };
        let overrides = [
            format!("solver.model={}", model.as_str()),
            format!("solver.integrator={integrator}"),
            format!("crank.elements={elements}"),
            format!("rod.elements={elements}"),
        ];
        let mut run = Simulation::new(&SceneSource::open("crank-slider", &overrides).unwrap().scene).unwrap();
        let counted = allocation_counter::measure(|| {
            for n in 0..200_u32 {
                run.set_torque(&SetpointRequest { torque_nm: f64::from(n % 3), hold_s: 3e-4 }).unwrap();
                run.step().unwrap();
            }
        });
        assert_eq!(counted.count_total, 0, "{model:?}");
    }
}

#[test]
fn regress_the_counter_counts() {
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![0.0_f64; 100])));
    assert_eq!(counted.count_total, 1);
}

/// The counter replaces the allocator of every program that links it.
#[test]
fn regress_the_counter_is_a_dependency_of_tests_only() {
    let manifest: toml::Table = include_str!("../Cargo.toml").parse().unwrap();
    let counter = |table: Option<&toml::Value>| table.is_some_and(|table| table.get("allocation-counter").is_some());
    let targets = manifest.get("target").and_then(toml::Value::as_table).into_iter().flat_map(|targets| targets.values());
    let of_target = targets.filter_map(toml::Value::as_table);
    for of in of_target.chain([&manifest]) {
        for kind in ["dependencies", "build-dependencies"] {
            assert!(!counter(of.get(kind)), "[{kind}] has the counter");
        }
    }
    assert!(counter(manifest.get("dev-dependencies")));
}
