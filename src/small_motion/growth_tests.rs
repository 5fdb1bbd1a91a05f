//! Growth of small differences beside closed forms.

use super::growth::*;
use crate::scene::SceneSource;

type Tested = Result<(), Box<dyn std::error::Error>>;

fn growth(overrides: &[&str], over_s: f64) -> Result<Judged, Box<dyn std::error::Error>> {
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    let scene = SceneSource::open("crank-slider", &overrides)?.scene;
    Ok(Growth::along(&scene, over_s).ok_or("no growth")?.at(over_s))
}

/// A rod without damping, whose vibration the turning crank excites.
const ROD: [&str; 7] = [
    "pulse=[]",
    "crank.rigid=true",
    "rod.axial=false",
    "rod.damping_s=0",
    "rod.modes=1",
    "slider.mass_kg=2.0",
    "rod.section={shape=\"rectangle\",width_m=0.01,height_m=0.03}",
];

#[test]
fn val_a_rod_grows_in_parametric_resonance_and_not_outside() -> Tested {
    let turning = |speed: &str, over_s| {
        let given = [format!("drive.speed_rad_per_s={speed}"), format!("start.rate_rad_per_s={speed}")];
        growth(&[&ROD[..], &[given[0].as_str(), given[1].as_str()]].concat(), over_s)
    };
    assert!(matches!(turning("112", 0.5)?, Judged::Grows(_)));
    assert!(matches!(turning("60", 0.5)?, Judged::Stays(growth) if growth < 2.0));
    Ok(())
}

/// Nothing acts: `δθ = δθ₀ + t δω₀`. With `|δ|² = J (δω² + δθ²/T²)`, the map over T is `[1, 1; 0, 1]`, whose norm is the golden ratio.
#[test]
fn val_free_turning_grows_by_the_golden_ratio() -> Tested {
    let Judged::Stays(growth) = growth(&["solver.model=rigid", "pulse=[]"], 0.25)? else { return Err("unknown".into()) };
    assert!((growth - 0.5 * (1.0 + 5.0_f64.sqrt())).abs() < 1e-9, "{growth}");
    Ok(())
}

#[test]
fn prop_growth_is_that_of_the_mechanism_and_not_of_its_mesh() -> Tested {
    let mut found = Vec::new();
    for count in ["2", "4"] {
        let mesh = ["crank", "rod"].map(|link| format!("{link}.elements={count}"));
        let given = ["solver.model=finite-element", mesh[0].as_str(), mesh[1].as_str()];
        let Judged::Stays(growth) = growth(&given, 0.05)? else { return Err("unknown".into()) };
        found.push(growth);
    }
    assert!((found[0] / found[1] - 1.0).abs() < 0.05, "{found:?}");
    Ok(())
}

/// A motion that cannot be followed is never judged.
#[test]
fn regress_an_impossible_motion_is_unknown() -> Tested {
    assert_eq!(growth(&["pulse=[{start_s=0.0,torque_nm=1e9,duration_s=10.0}]"], 0.05)?, Judged::Unknown);
    Ok(())
}

/// A plate that is shaken by links that creep. The stiffness at rest was that of links whose driven end turned, which so strong a damping
/// makes another one: a growth of 2e5.
#[test]
fn regress_links_that_creep_do_not_grow() -> Tested {
    const SHAKER: &str = r#"
        [crank]
        length_m = 0.02
        section = { shape = "rectangle", width_m = 0.01, height_m = 0.006 }
        density_kg_per_m3 = 7800.0
        youngs_modulus_pa = 2.1e11
        damping_s = 1.0
        elements = 2
        [rod]
        length_m = 0.15
        section = { shape = "rectangle", width_m = 0.01, height_m = 0.004 }
        density_kg_per_m3 = 2700.0
        youngs_modulus_pa = 7e10
        damping_s = 1.0
        elements = 4
        [slider]
        mass_kg = 0.5
        [drive]
        table = [[0, 0], [0.05, 0.3], [0.1, 0], [0.15, -0.3], [0.2, 0]]
        [solver]
        integrator = "esdirk"
        step_s = 1e-4
    "#;
    for model in ["finite-element", "modal"] {
        let scene = SceneSource::parse("shaker.toml", SHAKER, &[format!("solver.model={model}")])?.scene;
        let judged = Growth::along(&scene, 0.2).ok_or("no growth")?.at(0.2);
        assert!(matches!(judged, Judged::Stays(growth) if growth < 100.0), "{model}: {judged:?}");
    }
    Ok(())
}
