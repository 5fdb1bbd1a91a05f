//! The extremes: whatever a scene asks for, a run goes on with finite numbers or ends by saying why it cannot.

use std::num::NonZero;
use std::time::Duration;

use flexcrank::integrate::RungeKutta;
use flexcrank::scene::{ModelKind, SceneSource};
use flexcrank::simulation::{EnergyVerdict, Simulation};
use flexcrank::study::stability::{
    Axis, BaseScene, Category, Cell, Extent, Map, MapPlan, Measure, Outcome, Point, ROUNDING, Scheme, Spacing, Swept, counts,
    fails_finer, fails_finer_table, order_table, radius_table, sweep, table,
};
use proptest::prelude::*;
use proptest::sample::select;

type Tried = Result<(), Box<dyn std::error::Error>>;

#[test]
fn val_spectral_radius_as_run_is_that_of_theory() -> Tried {
    let mut schemes = vec![Scheme::RungeKutta, Scheme::Esdirk];
    for tenth in 0..=10 {
        let parameter = f64::from(tenth) / 10.0;
        schemes.extend([Scheme::TwoPoint(parameter), Scheme::GeneralizedAlpha(parameter)]);
    }
    let omegas_h: Vec<f64> = (-30..=30).map(|n| 10.0_f64.powf(f64::from(n) / 10.0)).collect();
    let radii = radius_table(&schemes, &omegas_h)?;
    let [theory, run] = ["radius_in_theory", "radius_as_run"].map(|name| radii.column(name).unwrap());
    assert_eq!(theory.len(), schemes.len() * omegas_h.len());
    for (theory, run) in theory.iter().zip(run) {
        assert!((run - theory).abs() <= 1e-9 * theory.max(1.0), "{run} {theory}");
    }
    Ok(())
}

/// Every scheme that a scene can name, ϑ and ρ∞ in tenths.
fn every_scheme() -> Vec<Scheme> {
    let tenths = || (0..=10).map(|n| f64::from(n) / 10.0);
    let weights = tenths().chain([0.49, 0.51, 0.55]).map(Scheme::TwoPoint);
    weights.chain(tenths().map(Scheme::GeneralizedAlpha)).chain([Scheme::RungeKutta, Scheme::Esdirk]).collect()
}

#[test]
fn prop_every_scheme_is_stable_on_the_left_half_plane() -> Tried {
    let points = [Point::axes(1000), Point::grid(20, 1)].concat();
    for scheme in every_scheme() {
        let mut grows = 0;
        for &at in &points {
            let [theory, run] = scheme.radii_at(at)?;
            if scheme.is_within(at) {
                assert!(run <= 1.0 + ROUNDING, "{scheme:?} at {at:?}: {run}, in theory {theory}");
            } else if run > 1.0 + ROUNDING {
                grows += 1;
            }
            // Far out the eigenvalues of a step come together, and rounding moves them by its square root.
            let near = if at.magnitude < 1e3 { 1e-9 } else { 1e-4 };
            assert!((run - theory).abs() <= near * theory.max(1.0), "{scheme:?} at {at:?}: {run}, in theory {theory}");
        }
        assert_eq!(grows > 0, !scheme.is_stable_everywhere(), "{scheme:?} grows at {grows} points");
    }
    Ok(())
}

#[test]
fn prop_runge_kutta_is_stable_within_its_region_and_not_beyond() -> Tried {
    for degree in 90..=180 {
        let angle_deg = f64::from(degree);
        let limit = RungeKutta::stable_to(angle_deg.to_radians());
        assert!((2.61..2.97).contains(&limit), "{limit} at {degree}°");
        for part in [0.1, 0.5, 0.9, 0.999] {
            let at = Point { magnitude: part * limit, angle_deg };
            assert!(Scheme::RungeKutta.is_within(at) && Scheme::RungeKutta.radii_at(at)?[1] <= 1.0, "{at:?}");
        }
        for part in [1.001, 1.1, 2.0, 1e3] {
            let at = Point { magnitude: part * limit, angle_deg };
            assert!(!Scheme::RungeKutta.is_within(at) && Scheme::RungeKutta.radii_at(at)?[1] > 1.0, "{at:?}");
        }
    }
    assert!((RungeKutta::stable_to(std::f64::consts::FRAC_PI_2) - 8.0_f64.sqrt()).abs() < 1e-9);
    Ok(())
}

/// The simulation of a scene with the explicit scheme.
fn explicit(scene: &str, step_s: f64, given: &[&str]) -> Result<Simulation, Box<dyn std::error::Error>> {
    let mut overrides: Vec<String> = given.iter().map(|&given| given.to_owned()).collect();
    overrides.extend(["solver.integrator=runge-kutta".to_owned(), format!("solver.step_s={step_s:?}")]);
    Ok(Simulation::new(&SceneSource::open(scene, &overrides)?.scene)?)
}

/// The step up to which the explicit scheme takes a scene, s.
fn limit_s(scene: &str, given: &[&str]) -> f64 {
    let (mut taken_s, mut refused_s) = (1e-9, 10.0_f64);
    while refused_s / taken_s > 1.0 + 1e-6 {
        let step_s = (taken_s * refused_s).sqrt();
        *(if explicit(scene, step_s, given).is_ok() { &mut taken_s } else { &mut refused_s }) = step_s;
    }
    taken_s
}

#[test]
fn val_the_explicit_step_limit_is_that_of_the_fastest_motion() -> Tried {
    let runs = |step_s: f64| -> Result<bool, Box<dyn std::error::Error>> {
        let text = format!(
            "[oscillator]\nmasses_kg = [2.0, 1e-3]\nsprings = [[0, 1, 300.0], [1, 2, 4e5]]\nstart_m = [1.0, -2e3]\n\
             [solver]\nintegrator = \"runge-kutta\"\nstep_s = {step_s:?}\n"
        );
        Ok(Simulation::new(&SceneSource::parse("oscillator", &text, &[])?.scene).is_ok())
    };
    // det(K − ω² M) = 0.
    let (a, b, c): (f64, f64, f64) = (2.0 * 1e-3, -(2.0 * 4e5 + 1e-3 * 400_300.0), 300.0 * 4e5);
    let omega = ((-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)).sqrt();
    let limit_s = 8.0_f64.sqrt() / omega;
    assert!(runs(0.999 * limit_s)? && !runs(1.001 * limit_s)?, "{limit_s}");
    Ok(())
}

#[test]
fn val_the_explicit_step_limit_of_a_damper_is_that_of_its_decay() -> Tried {
    // A rigid bar of m and L about its end, with damper c: exp(−3ct/mL²); −2.785 is where the region ends.
    let given = ["solver.model=rigid", "base.torsion_spring_nm_per_rad=0.0", "base.damper_nm_s_per_rad=7000.0"];
    let source = SceneSource::open("thesis-beam-tip", &given.map(str::to_owned))?;
    let chain = source.scene.chain().ok_or("a chain")?;
    let tip_kg = match chain.end {
        flexcrank::scene::End::Free { tip_mass_kg } => tip_mass_kg,
        flexcrank::scene::End::Slider(_) => 0.0,
    };
    let beam = &chain.links[0];
    let inertia = beam.inertia_kg_m2 + beam.mass_kg * beam.centre_of_mass_m.powi(2) + tip_kg * beam.length_m.powi(2);
    let expected_s = 2.785_293_563 * inertia / 7000.0;
    let found_s = limit_s("thesis-beam-tip", &given);
    assert!((found_s / expected_s - 1.0).abs() < 1e-4, "{found_s} {expected_s}");
    Ok(())
}

#[test]
fn prop_a_scene_below_the_explicit_step_limit_runs_and_one_beyond_is_refused() -> Tried {
    for (scene, given) in [
        ("crank-slider", &[][..]),
        ("crank-slider", &["crank.damping_s=0.0", "rod.damping_s=0.0", "rod.axial=false", "crank.axial=false"]),
        ("thesis-two-masses-stiff", &[]),
        ("ref-r2s", &["solver.model=modal"]),
    ] {
        let limit_s = limit_s(scene, given);
        let mut simulation = explicit(scene, 0.9 * limit_s, given)?;
        for _ in 0..5_000 {
            simulation.step().map_err(|diverged| format!("{scene} {given:?} at {limit_s}: {diverged}"))?;
        }
        assert_eq!(simulation.energy_verdict(), EnergyVerdict::Balanced, "{scene} {given:?}");
        let refused = explicit(scene, 1.2 * limit_s, given).err().ok_or("beyond the limit")?.to_string();
        for part in ["solver.step_s = ", "beyond the stability limit of runge-kutta", "would do"] {
            assert!(refused.contains(part), "{refused}");
        }
        let suggested = refused.split("solver.step_s=").nth(1).and_then(|rest| rest.split(' ').next()).ok_or("no suggestion")?;
        explicit(scene, suggested.parse()?, given)?;
    }
    Ok(())
}

#[test]
fn order_of_every_scheme() -> Tried {
    let schemes = [
        Scheme::TwoPoint(0.5),
        Scheme::TwoPoint(0.0),
        Scheme::TwoPoint(0.55),
        Scheme::TwoPoint(1.0),
        Scheme::GeneralizedAlpha(0.0),
        Scheme::GeneralizedAlpha(0.8),
        Scheme::GeneralizedAlpha(1.0),
        Scheme::RungeKutta,
        Scheme::Esdirk,
    ];
    let orders = order_table(&schemes)?;
    for (expected, observed) in orders.column("order_in_theory").unwrap().iter().zip(orders.column("order_as_run").unwrap()) {
        assert!((observed - expected).abs() < if *expected == 4.0 { 0.15 } else { 0.1 }, "{observed} for {expected}");
    }
    Ok(())
}

#[test]
fn prop_every_extreme_ends_cleanly() -> Tried {
    let base = BaseScene::new(&SceneSource::open("crank-slider", &[])?)?;
    let plan = MapPlan::extremes(&base, Extent::Quick);
    let cells = plan.len();
    let swept = sweep(&base, plan, NonZero::new(2).unwrap(), Duration::from_secs(60), |_| ());
    for map in &swept {
        for (end, cell) in map.outcomes.iter().zip(&map.map.cells) {
            assert!(end.category.is_clean(), "{}: {end:?} {:?}", map.map.name, cell.overrides);
            if end.category == Category::Diverged {
                assert!(end.step > 0 && end.message.contains("diverged in step"), "{end:?}");
            }
        }
        let category = table(map).column("category").unwrap().to_vec();
        assert!(category.iter().all(|number| (0.0..4.0).contains(number)), "{category:?}");
    }
    let counts = counts(&swept);
    assert_eq!(counts.iter().sum::<usize>(), cells);
    assert!(counts[..4].iter().all(|count| *count > 0), "the extremes show every kind of end: {counts:?}");
    Ok(())
}

/// Two rows of four steps that ended so.
fn ended(categories: [Category; 8]) -> Swept {
    let axis = |name, values: &[f64]| Axis::new(name, Spacing::Listed, values.to_vec());
    let cell = Cell { overrides: Vec::new(), steps: 1, reference: None, measure: Measure::Travel };
    let (x, y) = (axis("step_s", &[1e-6, 1e-5, 1e-4, 1e-3]), axis("damping_s", &[0.0, 1.0]));
    let map = Map { name: "damping".into(), title: "damping".into(), x, y, cells: vec![cell; 8] };
    let outcome = |category| Outcome {
        category,
        error: None,
        step: 1,
        sim_time_s: 0.0,
        energy_j: None,
        verdict: None,
        cause: None,
        message: String::new(),
    };
    Swept { map, outcomes: categories.map(outcome).to_vec() }
}

#[test]
fn prop_a_scene_that_fails_at_a_finer_step_is_named() {
    use Category::{Diverged, Refused, Stable, Wrong};
    let swept = [ended([Diverged, Stable, Wrong, Stable, Refused, Stable, Stable, Diverged])];
    let named = fails_finer(&swept);
    let found: Vec<_> = named.iter().map(|one| (one.value, one.step_s, one.finer_step_s, one.finer.category)).collect();
    assert_eq!(found, [(0.0, 1e-5, 1e-6, Diverged), (0.0, 1e-3, 1e-4, Wrong)]);
    assert_eq!(fails_finer_table(&named).words("varied").unwrap(), ["damping_s", "damping_s"]);
    assert_eq!(fails_finer(&[ended([Stable; 8])]), []);
}

#[test]
fn prop_the_sweep_names_every_model_with_every_integrator_against_another() -> Tried {
    let plan = MapPlan::extremes(&BaseScene::new(&SceneSource::open("crank-slider", &[])?)?, Extent::Whole);
    let word = |overrides: &[String], key: &str| -> String {
        overrides.iter().rev().find_map(|given| given.strip_prefix(key)).unwrap_or_default().to_owned()
    };
    for model in [ModelKind::Rigid, ModelKind::Incremental, ModelKind::Modal, ModelKind::FiniteElement] {
        for integrator in model.integrators() {
            let end = format!("-{}-{}", model.as_str(), integrator.as_str());
            let maps: Vec<&Map> = plan.maps.iter().filter(|map| map.name.ends_with(&end)).collect();
            assert!(maps.len() >= if model == ModelKind::Rigid { 2 } else { 3 }, "{end}");
            assert!(maps.iter().all(|map| map.title.ends_with(integrator.as_str())), "{end}");
        }
    }
    for cell in plan.maps.iter().flat_map(|map| &map.cells) {
        let Some(reference) = cell.reference.map(|place| &plan.references[place]) else { continue };
        for key in ["solver.integrator=", "solver.step_s="] {
            let [of_cell, of_reference] = [&cell.overrides, &reference.overrides].map(|overrides| word(overrides, key));
            assert_ne!(of_cell, of_reference, "{key} {:?}", cell.overrides);
        }
        if cell.measure == Measure::Travel {
            assert_eq!(word(&cell.overrides, "solver.model="), word(&reference.overrides, "solver.model="));
        }
    }
    Ok(())
}

#[test]
fn prop_the_whole_sweep_is_thousands_of_cells() -> Tried {
    let base = BaseScene::new(&SceneSource::open("crank-slider", &[])?)?;
    let plan = MapPlan::extremes(&base, Extent::Whole);
    assert!(plan.len() >= 2000, "{}", plan.len());
    assert!(plan.maps.iter().all(|map| map.cells.len() == map.x.values.len() * map.y.values.len()));
    Ok(())
}

#[test]
fn regress_a_scheme_whose_way_lags_behind_its_rates_has_not_diverged() -> Tried {
    for model in ["rigid", "modal"] {
        let given = ["solver.integrator=two-point", "solver.weight=0.0", "solver.step_s=1e-5"].map(str::to_owned);
        let scene = SceneSource::open("crank-slider", &[&given[..], &[format!("solver.model={model}")]].concat())?.scene;
        let mut simulation = Simulation::new(&scene)?;
        for _ in 0..200 {
            simulation.step()?;
            simulation.observe()?;
        }
    }
    Ok(())
}

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
