//! Chapter 4 of the thesis: one turn of the rigid crank-slider, against figures computed from its closed forms
//! (`tests/data/README.md`) and against mechanics.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

mod program;
mod published;

use std::f64::consts::TAU;
use std::path::Path;

use flexcrank::scene::SceneSource;
use flexcrank::study::Table;
use flexcrank::study::cycle::{Arms, CycleError, ExtremeValue, Options, balance, cycle, extremes, ratios_between, sweep, words};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn reference(file: &str) -> Result<Table, Box<dyn std::error::Error>> {
    Ok(Table::read_csv(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/thesis").join(file))?)
}

fn compressor(overrides: &[&str]) -> SceneSource {
    let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
    SceneSource::open("thesis-compressor", &overrides).unwrap()
}

fn column<'a>(table: &'a Table, name: &str) -> &'a [f64] {
    table.column(name).unwrap_or_else(|| panic!("no column {name}"))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| value.abs().max(most))
}

/// Columns of the reference and what they are called here; 4.14 as printed is the misprint and stays out.
const COLUMNS: [(&str, &str); 16] = [
    ("theta_rad", "crank_angle_rad"),
    ("phi_rad(4.3)", "rod_angle_rad"),
    ("omega2a_1(4.6)", "rod_rate_over_omega"),
    ("alpha2a_1(4.9)", "rod_acceleration_over_omega2"),
    ("xEa_1(4.11)", "piston_position_over_l2"),
    ("vEa_1(4.14_sign-corrected)", "piston_velocity_over_l2_omega"),
    ("aEa_1(4.17)", "piston_acceleration_over_l2_omega2"),
    ("xga_1(4.30)", "centre_of_mass_x_over_l2"),
    ("yga_1(4.31)", "centre_of_mass_y_over_l2"),
    ("vxga_1(4.36)", "centre_of_mass_velocity_x_over_l2_omega"),
    ("vyga_1(4.37)", "centre_of_mass_velocity_y_over_l2_omega"),
    ("axga_1(4.42)", "centre_of_mass_acceleration_x_over_l2_omega2"),
    ("ayga_1(4.43)", "centre_of_mass_acceleration_y_over_l2_omega2"),
    ("Ox_over_m3l2w2(4.52_fe=0)", "force_o_x_over_m3_l2_omega2"),
    ("Ax_over_m3l2w2(4.53_fe=0)", "force_a_x_over_m3_l2_omega2"),
    ("Ex_over_m3l2w2(4.54_fe=0)", "force_e_x_over_m3_l2_omega2"),
];

#[test]
fn val_columns_are_the_closed_forms_within_1e_12() -> Outcome {
    for (ratio, file) in
        [(0.1, "ch4_closed_forms_l0.10.csv"), (0.25, "ch4_closed_forms_l0.25.csv"), (0.5, "ch4_closed_forms_l0.50.csv")]
    {
        let expected = reference(file)?;
        let options = Options { ratios: vec![ratio], dimensionless: true, points: 121, ..Options::default() };
        let table = cycle(&compressor(&[]), &options)?;
        assert_eq!(expected.rows(), 120);
        for (theirs, ours) in COLUMNS {
            // The thesis counts the rod's angle clockwise.
            let sign = if ours.starts_with("rod_") { -1.0 } else { 1.0 };
            for (expected, value) in column(&expected, theirs).iter().zip(column(&table, ours)) {
                let expected = sign * expected;
                assert!((expected - value).abs() < 1e-12, "{ours}: {value}, expected {expected}, ratio {ratio}");
            }
        }
    }
    Ok(())
}

#[test]
fn regress_the_printed_sign_of_the_piston_velocity_is_wrong() -> Outcome {
    let expected = reference("ch4_closed_forms_l0.25.csv")?;
    let table = cycle(&compressor(&[]), &Options { dimensionless: true, points: 121, ..Options::default() })?;
    let printed = column(&expected, "vEa_1(4.14_as_printed)");
    let apart = printed.iter().zip(column(&table, "piston_velocity_over_l2_omega")).map(|(a, b)| (a - b).abs());
    assert!((apart.fold(0.0, f64::max) - 2.0 * 0.25).abs() < 1e-12, "2 λ sin θ at θ = π/2");
    Ok(())
}

/// The scenes of the laws below: a resistance by table, constant acceleration, bodies from sections, friction.
fn turns() -> Vec<(SceneSource, Options)> {
    let table = "slider.resistance_table=[[0.0, 100.0], [1.0, 2000.0], [3.0, -50.0], [5.5, 700.0]]";
    let spun = Options { ratios: vec![0.1, 0.25, 0.5], acceleration_rad_per_s2: 300.0, ..Options::default() };
    let backwards = Options { speed_rad_per_s: Some(-20.0), acceleration_rad_per_s2: 10.0, ..Options::default() };
    let bars = SceneSource::open("crank-slider", &["slider.friction_n_s_per_m=3.0".to_owned()]).unwrap();
    vec![
        (compressor(&[]), Options { ratios: vec![0.1, 0.25, 0.5], ..Options::default() }),
        (compressor(&[table]), spun.clone()),
        (compressor(&["crank.centre_of_mass_m=0.01"]), Options { resistance_n: Some(500.0), ..backwards.clone() }),
        (bars, Options { speed_rad_per_s: Some(30.0), ..Options::default() }),
    ]
}

/// Digest 4.46: `I_O θ̈ = M_O + A_x l₁ sin θ − A_y l₁ cos θ − m₁ …`, by moments of the crank about O with its weight left out.
#[test]
fn prop_driving_torque_is_the_cranks_moments_within_1e_12() -> Outcome {
    for (source, options) in turns() {
        let table = cycle(&source, &options)?;
        let crank = &source.scene.chain().unwrap().links[0];
        let rod_m = source.scene.chain().unwrap().links[1].length_m;
        let torque = column(&table, "driving_torque_nm");
        let scale = largest(torque);
        let of = |name| column(&table, name);
        let (ratio, theta, ax, ay) = (of("ratio"), of("crank_angle_rad"), of("force_a_x_n"), of("force_a_y_n"));
        assert!(crank.bar.is_none() || options.ratios.is_empty(), "inertia would change with the ratio");
        let inertia = crank.inertia_kg_m2 + crank.mass_kg * crank.centre_of_mass_m.powi(2);
        for row in 0..table.rows() {
            let l1 = ratio[row] * rod_m;
            let (sin, cos) = theta[row].sin_cos();
            let moment = inertia * options.acceleration_rad_per_s2 - l1 * (ax[row] * sin - ay[row] * cos);
            assert!((moment - torque[row]).abs() < 1e-12 * scale, "{moment} and {} N·m in row {row}", torque[row]);
        }
    }
    Ok(())
}

/// d/dθ of a function given at an odd number of equally spaced angles of a full turn, exact for a trigonometric polynomial
/// through them: `f′ᵢ = Σⱼ ½ (−1)^(i−j) / sin((θᵢ − θⱼ)/2) fⱼ` (Trefethen, Spectral Methods in MATLAB, chapter 3).
fn by_angle(values: &[f64]) -> Vec<f64> {
    let count = values.len();
    assert!(count % 2 == 1);
    let weight = |i: usize, j: usize| {
        let sign = if (i + j).is_multiple_of(2) { 0.5 } else { -0.5 };
        sign / (TAU / 2.0 * (i as f64 - j as f64) / count as f64).sin()
    };
    let slope = |i: usize| (0..count).filter(|&j| j != i).map(|j| weight(i, j) * values[j]).sum();
    (0..count).map(slope).collect()
}

/// Driving torque × speed − resistance power − d/dt kinetic energy. The last is differentiated numerically from its column, so
/// that an error made in torque and forces alike would show: `T = f(θ) θ̇²`, `dT/dt = (f′ θ̇² + 2 f θ̈) θ̇`.
#[test]
fn prop_power_balance_closes_within_1e_12() -> Outcome {
    for (resistance_n, acceleration) in [(0.0, 0.0), (800.0, 0.0), (800.0, 700.0), (0.0, -100.0)] {
        for ratio in [0.1, 0.25, 0.5] {
            let points = 92;
            let options = Options {
                ratios: vec![ratio],
                resistance_n: Some(resistance_n),
                acceleration_rad_per_s2: acceleration,
                points,
                ..Options::default()
            };
            let table = cycle(&compressor(&[]), &options)?;
            let of = |name| &column(&table, name)[..points - 1];
            let (rate, torque) = (of("crank_rate_rad_per_s"), of("driving_torque_nm"));
            let (resistance, velocity) = (of("resistance_n"), of("piston_velocity_m_per_s"));
            let half: Vec<f64> = of("kinetic_energy_j").iter().zip(rate).map(|(kinetic, rate)| kinetic / (rate * rate)).collect();
            let slope = by_angle(&half);
            let scale = (0..points - 1).map(|i| (torque[i] * rate[i]).abs()).fold(0.0, f64::max);
            for i in 0..points - 1 {
                let kinetic_w = (slope[i] * rate[i] * rate[i] + 2.0 * half[i] * acceleration) * rate[i];
                let left = torque[i] * rate[i] - resistance[i] * velocity[i] - kinetic_w;
                assert!(left.abs() < 1e-12 * scale, "{left} W of {scale} W left at row {i}, ratio {ratio}");
            }
        }
    }
    Ok(())
}

#[test]
fn prop_joint_forces_and_shaking_force_agree_on_what_the_frame_feels() -> Outcome {
    for (source, options) in turns() {
        let table = cycle(&source, &options)?;
        let of = |name| column(&table, name);
        let friction = match &source.scene.chain().unwrap().end {
            flexcrank::scene::End::Slider(slider) => slider.friction_n_s_per_m,
            flexcrank::scene::End::Free { .. } => 0.0,
        };
        let scale = largest(of("force_o_x_n")).max(largest(of("shaking_force_x_n")));
        for row in 0..table.rows() {
            let head = of("resistance_n")[row] + friction * of("piston_velocity_m_per_s")[row];
            let x = -of("force_o_x_n")[row] + head - of("shaking_force_x_n")[row];
            let y = -of("force_o_y_n")[row] - of("guide_force_n")[row] - of("shaking_force_y_n")[row];
            assert!(x.abs().max(y.abs()) < 1e-12 * scale, "{x}, {y} N of {scale} N in row {row}");
        }
    }
    Ok(())
}

#[test]
fn prop_centre_of_mass_and_piston_move_as_their_rates_say() -> Outcome {
    let table = cycle(&compressor(&[]), &Options { points: 92, ..Options::default() })?;
    let omega = column(&table, "crank_rate_rad_per_s")[0];
    for [place, rate] in [
        ["centre_of_mass_x_m", "centre_of_mass_velocity_x_m_per_s"],
        ["centre_of_mass_velocity_y_m_per_s", "centre_of_mass_acceleration_y_m_per_s2"],
        ["piston_velocity_m_per_s", "piston_acceleration_m_per_s2"],
        ["rod_rate_rad_per_s", "rod_acceleration_rad_per_s2"],
    ] {
        let rates = column(&table, rate);
        for (slope, expected) in by_angle(&column(&table, place)[..91]).iter().zip(rates) {
            assert!((slope * omega - expected).abs() < 1e-11 * largest(rates), "{place}");
        }
    }
    Ok(())
}

#[test]
fn regress_a_scene_without_a_full_turn_is_refused() {
    let beam = SceneSource::open("ref-r5", &[]).unwrap();
    let says = |source: &SceneSource, options: Options| cycle(source, &options).unwrap_err().to_string();
    assert!(says(&beam, Options::default()).contains("ref-r5 is not a crank-slider"));
    let source = compressor(&[]);
    for ratio in [0.0, 1.0, -0.5, f64::NAN, f64::INFINITY] {
        assert!(says(&source, Options { ratios: vec![ratio], ..Options::default() }).contains("above 0 and below 1"));
    }
    let slowing = Options { speed_rad_per_s: Some(10.0), acceleration_rad_per_s2: -10.0, ..Options::default() };
    assert!(says(&source, slowing).contains("needs more than 11.210 rad/s"));
    assert!(says(&source, Options { points: 2, ..Options::default() }).contains("not 2"));
    assert!(says(&source, Options { speed_rad_per_s: Some(f64::NAN), ..Options::default() }).contains("speed"));
    let still = Options { speed_rad_per_s: Some(0.0), dimensionless: true, ..Options::default() };
    assert!(matches!(cycle(&source, &still), Err(CycleError::DividesByZero(_))));
}

#[test]
fn val_counterweights_are_the_reference_and_hold_the_centre_of_mass_still() -> Outcome {
    let expected = reference("ch4_balancing_masses.csv")?;
    let of = |name| column(&expected, name);
    for row in 0..expected.rows() {
        let options = Options { ratios: vec![of("l_1")[row]], ..Options::default() };
        let arms = Arms { r4_m: of("r4_mm")[row] / 1e3, r5_m: of("r5_mm")[row] / 1e3 };
        let table = balance(&compressor(&[]), &options, arms)?;
        let seen = |name: &str| column(&table, name)[0];
        for (ours, theirs) in [("m4_kg", "m4_kg"), ("m5_kg", "m5_kg")] {
            assert!((seen(ours) / of(theirs)[row] - 1.0).abs() < 1e-12, "{ours} {} in row {row}", seen(ours));
        }
        let travel_m = seen("centre_of_mass_travel_after_m");
        assert!(travel_m < 1e-12, "{travel_m} m");
        let [before, after] = ["before", "after"].map(|when| seen(&format!("peak_shaking_force_{when}_n")));
        assert!(after < 1e-12 * before, "{after} N of {before} N left");
        let added = seen("mass_after_kg") - seen("mass_before_kg") - seen("m4_kg") - seen("m5_kg");
        assert!(added.abs() < 1e-12);
        let rod = seen("rod_inertia_about_a_after_kg_m2") - seen("rod_inertia_about_a_before_kg_m2");
        assert!((rod - seen("m5_kg") * arms.r5_m.powi(2)).abs() < 1e-15);
    }
    Ok(())
}

/// Counterweights written into the scene as the composite bodies they make: joint forces, not only the centre's acceleration,
/// leave the frame alone – also with a crank out of balance, an acceleration and a resistance.
#[test]
fn prop_balanced_scene_leaves_the_frame_alone() -> Outcome {
    let (m1, r1, l1, m2, r2, l2, m3) = (0.3, 0.01, 0.03625, 0.59, 0.048, 0.145, 0.74);
    let arms = Arms { r4_m: 0.03, r5_m: 0.06 };
    let table = balance(&compressor(&["crank.centre_of_mass_m=0.01"]), &Options::default(), arms)?;
    let [m4, m5] = ["m4_kg", "m5_kg"].map(|name| column(&table, name)[0]);
    let key = |name: &str, value: f64| format!("{name}={value:?}");
    let overrides = [
        key("crank.mass_kg", m1 + m4),
        key("crank.centre_of_mass_m", (m1 * r1 - m4 * arms.r4_m) / (m1 + m4)),
        key("rod.mass_kg", m2 + m5),
        key("rod.centre_of_mass_m", (m2 * r2 - m5 * arms.r5_m) / (m2 + m5)),
    ];
    let source = SceneSource::open("thesis-compressor", &overrides)?;
    let options = Options { acceleration_rad_per_s2: 1000.0, resistance_n: Some(300.0), ..Options::default() };
    let turned = cycle(&source, &options)?;
    let of = |name| column(&turned, name);
    let scale = m3 * (l1 + l2) * 157f64.powi(2);
    for row in 0..turned.rows() {
        assert!((of("force_o_x_n")[row] - 300.0).abs() < 1e-12 * scale, "only the gas's force goes through the frame");
        assert!((of("force_o_y_n")[row] + of("guide_force_n")[row]).abs() < 1e-12 * scale);
        assert!(of("centre_of_mass_x_m")[row].hypot(of("centre_of_mass_y_m")[row]) < 1e-12);
    }
    Ok(())
}

#[test]
fn regress_counterweights_that_cannot_be_are_refused() {
    let says = |overrides: &[&str], r4_m, r5_m| {
        balance(&compressor(overrides), &Options::default(), Arms { r4_m, r5_m }).unwrap_err().to_string()
    };
    assert!(says(&[], 0.0, 0.06).contains("r4 must be a positive length"));
    assert!(says(&[], 0.03, f64::NAN).contains("r5 must be a positive length"));
    assert!(says(&["crank.centre_of_mass_m=-1"], 0.03, 0.06).contains("m4 would be -"));
}

#[test]
fn prop_sweep_peaks_are_the_closed_forms_and_rise_with_the_ratio() -> Outcome {
    let options = Options { ratios: ratios_between(0.05, 0.65, 25), dimensionless: true, ..Options::default() };
    let table = sweep(&compressor(&[]), &options)?;
    let of = |name| column(&table, name);
    for (row, ratio) in of("ratio").iter().enumerate() {
        let acceleration = of("peak_piston_acceleration_over_l2_omega2")[row];
        assert!((acceleration - ratio * (1.0 + ratio)).abs() < 1e-12, "largest at θ = 0: λ (1 + λ)");
        assert!((of("swept_volume_per_size")[row] - 2.0 * ratio / (1.0 + 2.0 * ratio)).abs() < 1e-15);
        assert!((of("stroke_over_l2")[row] - 2.0 * ratio).abs() < 1e-15);
    }
    for (name, values) in table.columns() {
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]), "{name} rises");
    }
    Ok(())
}

#[test]
fn prop_sections_give_mass_centre_and_inertia_to_every_ratio() -> Outcome {
    let bars = SceneSource::open("crank-slider", &[])?;
    let options = Options { ratios: vec![0.25, 0.5], ..Options::default() };
    let long = SceneSource::open("crank-slider", &["crank.length_m=0.75".to_owned()])?;
    let alone = cycle(&long, &Options::default())?;
    let both = cycle(&bars, &options)?;
    for ((name, alone), (_, both)) in alone.columns().zip(both.columns()) {
        assert!(alone == &both[options.points..], "{name}: a ratio is a crank of that length");
    }
    Ok(())
}

#[test]
fn val_extremes_have_value_and_crank_angle() -> Outcome {
    let options = Options { ratios: vec![0.1, 0.25], dimensionless: true, ..Options::default() };
    let all = extremes(&cycle(&compressor(&[]), &options)?);
    assert_eq!(all.iter().map(|one| one.ratio).collect::<Vec<_>>(), [0.1, 0.25]);
    let find = |name| all[1].of.iter().find(|extreme| extreme.column.starts_with(name)).unwrap();
    assert_eq!(find("piston_acceleration").least, ExtremeValue { value: -0.3125, crank_angle_rad: 0.0 });
    assert_eq!(find("piston_position").greatest, ExtremeValue { value: 1.25, crank_angle_rad: 0.0 });
    let rod = find("rod_angle");
    assert!((rod.least.value + 0.25f64.asin()).abs() < 1e-15 && (rod.least.crank_angle_rad - TAU / 4.0).abs() < 1e-15);
    assert_eq!((rod.quantity.as_str(), rod.unit), ("rod angle", "rad"));
    assert_eq!(words("piston_acceleration_over_l2_omega2"), ("piston acceleration".to_owned(), "/ l2 ω²"));
    assert_eq!(words("rod_inertia_about_a_before_kg_m2"), ("rod inertia about A before".to_owned(), "kg·m²"));
    assert_eq!(words("swept_volume_per_size"), ("swept volume per size".to_owned(), ""));
    Ok(())
}
