//! No allocation after start-up, in any model, with any integrator that suits it.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

use flexcrank::scene::{IntegratorKind, ModelKind, SceneSource};
use flexcrank::simulation::{SetpointRequest, Simulation};

const MODELS: [ModelKind; 4] = [ModelKind::Rigid, ModelKind::Incremental, ModelKind::Modal, ModelKind::FiniteElement];

/// Allocations of the default scene's first 200 steps, each observed.
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
    let mut run = Simulation::new(&SceneSource::open("crank-slider", &overrides).unwrap().scene).unwrap();
    let counted = allocation_counter::measure(|| {
        for _ in 0..200 {
            run.step().unwrap();
            run.observe().unwrap();
        }
    });
    counted.count_total
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
