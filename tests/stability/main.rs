//! The extremes: whatever a scene asks for, a run goes on with finite numbers or ends by saying why it cannot.

use std::num::NonZero;
use std::ops::ControlFlow;
use std::time::Duration;

use flexcrank::integrate::RungeKutta;
use flexcrank::scene::{ModelKind, SceneSource};
use flexcrank::simulation::Simulation;
use flexcrank::study::stability::{
    Axis, BaseScene, Category, Cell, Extent, Map, MapPlan, Measure, Outcome, Point, Quantity, ROUNDING, Scheme, Spacing, Swept,
    counts, fails_finer, fails_finer_table, order_table, radius_table, sweep, table,
};

mod labels;
mod random;
mod step_limit;

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
    let swept = sweep(&base, plan, NonZero::new(2).unwrap(), Duration::from_secs(60), |_| std::ops::ControlFlow::Continue(()));
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
    let quantity = |name| Quantity { name, words: "", unit: "s" };
    let axis = |name, values: &[f64]| Axis::new(quantity(name), Spacing::Listed, values.to_vec());
    let cell = Cell { overrides: Vec::new(), steps: 1, reference: None, measure: Measure::Travel, switch: None };
    let (x, y) = (axis("step_s", &[1e-6, 1e-5, 1e-4, 1e-3]), axis("damping_s", &[0.0, 1.0]));
    let map = Map { name: "damping".into(), title: "damping".into(), x, y, cells: vec![cell; 8] };
    let outcome = |category| Outcome { step: 1, ..Outcome::without_run(category, String::new()) };
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

/// From rest, the first steps of the reference erred by 4 % of the way of a cell of 0.2 ms: a step right to ten digits was "wrong".
#[test]
fn regress_a_short_cell_has_a_reference_of_short_steps() -> Tried {
    let keys = [
        "crank.length_m=0.013",
        "crank.rigid=true",
        "rod.length_m=0.045",
        "rod.section.width_m=0.008",
        "rod.section.height_m=0.004",
        "pulse=[]",
        "torque.constant_nm=1.5",
    ];
    let source = SceneSource::open("crank-slider", &keys.map(str::to_owned))?;
    let base = BaseScene::new(&source)?;
    let mut plan = MapPlan::extremes(&base, Extent::Quick);
    plan.only("damping-modal-esdirk")?;
    let swept = sweep(&base, plan, NonZero::<usize>::MIN, Duration::from_secs(600), |_| ControlFlow::Continue(()));
    let map = swept.first().ok_or("no map")?;
    let columns = map.map.x.values.len();
    for (step_s, ends) in map.map.x.values.iter().zip((0..columns).map(|x| map.outcomes.iter().skip(x).step_by(columns))) {
        let categories: Vec<Category> = ends.map(|end| end.category).collect();
        assert!(*step_s > 1e-5 || categories.iter().all(|end| *end == Category::Stable), "{step_s}: {categories:?}");
    }
    Ok(())
}

/// The maps of speed set one themselves, in place of a ramp, a table or a torque: all of their cells were refused, as a scene has one of the three.
#[test]
fn regress_maps_of_speed_replace_the_drive_of_the_scene() -> Tried {
    let folder = tempfile::tempdir()?;
    let links = "[crank]\nlength_m = 0.08\nsection = { shape = \"rectangle\", width_m = 0.02, height_m = 0.01 }\n\
                 density_kg_per_m3 = 7850.0\nyoungs_modulus_pa = 2.0e11\n\
                 [rod]\nlength_m = 0.32\nsection = { shape = \"rectangle\", width_m = 0.015, height_m = 0.003 }\n\
                 density_kg_per_m3 = 2700.0\nyoungs_modulus_pa = 7.0e10\ndamping_s = 1e-5\n[slider]\nmass_kg = 0.15\n";
    for drive in [
        "[drive]\nramp = { to_rad_per_s = 60.0, over_s = 0.5 }\n",
        "[drive]\ntable = [[0.0, 0.0], [0.5, 1.0], [1.0, 3.0]]\n",
        "[torque]\nconstant_nm = 2.0\n",
    ] {
        std::fs::write(folder.path().join("driven.toml"), [links, drive].concat())?;
        let words = ["stability", "driven.toml", "--quick", "--only", "crank-speed-modal"];
        let ended =
            std::process::Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).current_dir(folder.path()).output()?;
        let printed = String::from_utf8(ended.stdout)?;
        assert!(printed.contains("       0  refused\n") && printed.contains("32 cells in 2 maps"), "{drive}{printed}");
    }
    Ok(())
}
