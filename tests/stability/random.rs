//! Random scenes from the whole range of every key: they run, or are refused with a reason.

use flexcrank::scene::{ModelKind, SceneSource};
use flexcrank::simulation::Simulation;
use proptest::prelude::*;
use proptest::sample::select;

/// A number of a given range, spread by ratios, of either sign or zero now and then.
fn wide(low: i32, high: i32) -> impl Strategy<Value = f64> {
    (f64::from(low)..=f64::from(high)).prop_map(|power| 10.0_f64.powf(power))
}

fn signed(high: i32) -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), wide(-6, high), wide(-6, high).prop_map(|value| -value)]
}

fn link(name: &'static str) -> impl Strategy<Value = String> {
    let section = prop_oneof![
        (wide(-5, 0), wide(-5, 0))
            .prop_map(|(b, h)| format!("section = {{ shape = \"rectangle\", width_m = {b:?}, height_m = {h:?} }}")),
        wide(-5, 0).prop_map(|d| format!("section = {{ shape = \"round\", diameter_m = {d:?} }}")),
        (wide(-12, 1), wide(-20, 1)).prop_map(|(area, moment)| format!("area_m2 = {area:?}\nsecond_moment_m4 = {moment:?}")),
    ];
    let more = prop_oneof![
        3 => Just(String::new()),
        1 => Just("axial = true\n".to_owned()),
        1 => Just("rigid = true\n".to_owned()),
    ];
    let damping = prop_oneof![Just(0.0), wide(-9, 1)].prop_map(|damping| format!("damping_s = {damping:?}"));
    let more = (more, damping).prop_map(|(more, damping)| more + &damping);
    (wide(-2, 2), section, wide(1, 5), wide(4, 15), 1..9_u32, 1..6_u32, more).prop_map(
        move |(length, section, density, modulus, elements, modes, more)| {
            format!(
                "[{name}]\nlength_m = {length:?}\n{section}\ndensity_kg_per_m3 = {density:?}\nyoungs_modulus_pa = {modulus:?}\n\
                 elements = {elements}\nmodes = {modes}\n{more}\n"
            )
        },
    )
}

fn drive() -> impl Strategy<Value = String> {
    prop_oneof![
        (signed(9), wide(-9, 1), select(vec!["rectangular", "raised-cosine"])).prop_map(|(torque, duration, shape)| format!(
            "[[pulse]]\nstart_s = 0.0\ntorque_nm = {torque:?}\nduration_s = {duration:?}\nshape = \"{shape}\"\n"
        )),
        signed(6).prop_map(|torque| format!("[torque]\nconstant_nm = {torque:?}\n")),
        signed(4).prop_map(|speed| format!("[drive]\nspeed_rad_per_s = {speed:?}\n")),
        (signed(4), wide(-6, 3))
            .prop_map(|(to, over)| format!("[drive]\nramp = {{ to_rad_per_s = {to:?}, over_s = {over:?} }}\n")),
        (signed(3), signed(3))
            .prop_map(|(one, two)| format!("[drive]\ntable = [[0.0, {one:?}], [0.001, {two:?}], [0.5, 0.0]]\n")),
    ]
}

fn surroundings() -> impl Strategy<Value = String> {
    let start = (signed(6), signed(4), any::<bool>()).prop_map(|(angle, rate, out_of_range)| {
        format!("[start]\nangle_rad = {angle:?}\nrate_rad_per_s = {rate:?}\nstatic_equilibrium = {out_of_range}\n")
    });
    let base = (wide(-6, 9), wide(-6, 6)).prop_map(|(spring, damper)| {
        format!("[base]\ntorsion_spring_nm_per_rad = {spring:?}\ndamper_nm_s_per_rad = {damper:?}\n")
    });
    let gravity = (signed(3), signed(3)).prop_map(|(x, y)| format!("[gravity]\nx_m_per_s2 = {x:?}\ny_m_per_s2 = {y:?}\n"));
    let or_none = |part: BoxedStrategy<String>| prop_oneof![Just(String::new()), part];
    (or_none(start.boxed()), or_none(base.boxed()), or_none(gravity.boxed())).prop_map(|(a, b, c)| a + &b + &c)
}

fn solver() -> impl Strategy<Value = String> {
    let models = [ModelKind::Rigid, ModelKind::Modal, ModelKind::FiniteElement, ModelKind::Incremental];
    let pairs =
        models.iter().flat_map(|model| model.integrators().iter().map(|integrator| (model.as_str(), integrator.as_str())));
    let pair = select(pairs.collect::<Vec<_>>());
    (pair, wide(-9, 1), 0.0..=1.0, 0.0..=1.0, wide(-15, -2), 1..30_u32).prop_map(
        |((model, integrator), step, weight, rho, tolerance, iterations)| {
            format!(
                "[solver]\nmodel = \"{model}\"\nintegrator = \"{integrator}\"\nstep_s = {step:?}\nweight = {weight:?}\n\
                 rho_infinity = {rho:?}\ntolerance = {tolerance:?}\nmax_iterations = {iterations}\n"
            )
        },
    )
}

fn crank_slider() -> impl Strategy<Value = String> {
    let slider = (wide(-6, 6), signed(6), wide(-6, 6)).prop_map(|(mass, resistance, friction)| {
        format!("[slider]\nmass_kg = {mass:?}\nresistance_n = {resistance:?}\nfriction_n_s_per_m = {friction:?}\n")
    });
    let end = prop_oneof![3 => slider, 1 => Just(String::new()), 1 => wide(-6, 6).prop_map(|mass| format!("[tip]\nmass_kg = {mass:?}\n"))];
    (link("crank"), link("rod"), end).prop_map(|(crank, rod, end)| crank + &rod + &end)
}

fn beam() -> impl Strategy<Value = String> {
    let tip = prop_oneof![Just(String::new()), wide(-6, 6).prop_map(|mass| format!("[tip]\nmass_kg = {mass:?}\n"))];
    (link("beam"), tip).prop_map(|(beam, tip)| beam + &tip)
}

fn mechanism() -> impl Strategy<Value = String> {
    let chain = prop_oneof![3 => crank_slider().boxed(), 1 => beam().boxed()];
    (chain, drive(), surroundings(), solver()).prop_map(|(chain, drive, around, solver)| chain + &drive + &around + &solver)
}

fn oscillator() -> impl Strategy<Value = String> {
    let integrators = ModelKind::MassSpring.integrators().iter().map(|integrator| integrator.as_str());
    let solver = (select(integrators.collect::<Vec<_>>()), wide(-9, 1), 0.0..=1.0);
    (1..7_usize, solver).prop_flat_map(|(count, (integrator, step, weight))| {
        let masses = prop::collection::vec(wide(-12, 12), count);
        let springs = prop::collection::vec((0..=count, 0..=count, wide(-18, 18)), 0..10);
        let start = prop::collection::vec(signed(12), count);
        (masses, springs, start).prop_map(move |(masses, springs, start)| {
            let springs: Vec<String> = springs.into_iter().map(|(i, j, k)| format!("[{i}, {j}, {k:?}]")).collect();
            format!(
                "[oscillator]\nmasses_kg = {masses:?}\nsprings = [{}]\nforces_n = {start:?}\nstart_m = {start:?}\n\
                 [solver]\nintegrator = \"{integrator}\"\nstep_s = {step:?}\nweight = {weight:?}\n",
                springs.join(", ")
            )
        })
    })
}

/// No number in what is printed for debugging is infinite or not one.
fn finite(what: &impl std::fmt::Debug) -> bool {
    let text = format!("{what:?}");
    !["NaN", "inf,", "inf]", "inf)", "inf }"].iter().any(|word| text.contains(word))
}

/// Fifty steps of a scene, if it is accepted; `Err` names an invalid result.
fn fifty_steps(text: &str) -> Result<&'static str, TestCaseError> {
    let Ok(source) = SceneSource::parse("random", text, &[]) else { return Ok("refused") };
    let mut simulation = match Simulation::new(&source.scene) {
        Ok(simulation) => simulation,
        Err(refused) => {
            prop_assert!(!refused.why.is_empty());
            return Ok("not built");
        }
    };
    for _ in 0..50 {
        let seen = simulation.step().and_then(|()| simulation.observe().map(drop));
        prop_assert!(finite(simulation.observation()), "{:?}", simulation.observation());
        prop_assert!(finite(&simulation.ledger()), "{:?}", simulation.ledger());
        if let Err(diverged) = seen {
            prop_assert!(finite(&diverged) && !diverged.to_string().contains("NaN"), "{diverged:?}");
            return Ok("diverged");
        }
    }
    Ok("ran")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn prop_a_random_mechanism_runs_or_reports_why_not(text in mechanism()) {
        fifty_steps(&text)?;
    }

    #[test]
    fn prop_a_random_oscillator_runs_or_reports_why_not(text in oscillator()) {
        fifty_steps(&text)?;
    }
}

/// The generators above reach every kind of end.
#[test]
fn prop_random_mechanisms_are_of_every_kind() {
    use proptest::strategy::ValueTree as _;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut ends = std::collections::BTreeMap::new();
    for _ in 0..200 {
        let text = mechanism().new_tree(&mut runner).unwrap().current();
        *ends.entry(fifty_steps(&text).unwrap()).or_insert(0) += 1;
    }
    println!("{ends:?}");
    assert!(ends.contains_key("ran") && ends.contains_key("refused") && ends.contains_key("diverged"), "{ends:?}");
}
