//! `check` measures the error of the step, and warns where that loses the motion.

use std::error::Error;
use std::process::Command;

use flexcrank::scene::SceneSource;
use flexcrank::simulation::Simulation;

type Tried<T = ()> = Result<T, Box<dyn Error>>;

/// A chain of two links that hangs, is struck, and tumbles. With these thin links and a second pulse, its error was once given as a
/// thousandth of its size.
const TUMBLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/tumbles.toml");
const THIN: [&str; 4] = [
    "crank.section.height_m=0.003",
    "rod.section.outer_m=0.006",
    "rod.section.inner_m=0.004",
    "pulse=[{start_s=0.2, torque_nm=2.0, duration_s=0.1, shape=\"raised-cosine\"}, \
     {start_s=1.5, torque_nm=-1.5, duration_s=0.15, shape=\"raised-cosine\"}]",
];

/// Runs `check` with an option more; returns standard output and standard error.
fn checked(scene: &str, overrides: &[String], option: Option<&str>) -> Tried<(String, String)> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["check", scene]).args(overrides.iter().flat_map(|given| ["--set", given.as_str()])).args(option);
    let ended = command.output()?;
    let said = String::from_utf8(ended.stderr)?;
    assert_eq!(ended.status.code(), Some(0), "{said}");
    Ok((String::from_utf8(ended.stdout)?, said))
}

/// The first link's angle after every hundredth of a second, rad.
fn angles_rad(scene: &str, overrides: &[String], step_s: f64, until_s: f64) -> Tried<Vec<f64>> {
    let overrides = [overrides, &[format!("solver.step_s={step_s}")]].concat();
    let mut simulation = Simulation::new(&SceneSource::open(scene, &overrides)?.scene)?;
    let mut angles = Vec::new();
    for step in 1..=(until_s / step_s).round() as u32 {
        simulation.step()?;
        if step.is_multiple_of((0.01 / step_s).round() as u32) {
            angles.push(simulation.observe()?.links[0].chord_rad);
        }
    }
    Ok(angles)
}

/// Weight and a second pulse bring the crank slowly past its dead centres, where an error grows. The energy balance does not show that,
/// nor that a tumbling chain loses its motion.
#[test]
fn val_the_error_of_the_step_is_the_true_one_and_warned_of_beyond_a_radian() -> Tried {
    let pulses = "pulse=[{start_s=0.0, torque_nm=-19.0, duration_s=0.1}, {start_s=3.0, torque_nm=34.0, duration_s=0.1}]";
    let slow = ["gravity.y_m_per_s2=-9.81", pulses, "solver.integrator=two-point"].map(str::to_owned);
    let thin = THIN.map(str::to_owned);
    let by_esdirk = [&thin[..], &["solver.integrator=esdirk".to_owned()]].concat();
    let cases = [
        ("crank-slider", &[][..], 2e-3, 2.0, false),
        ("crank-slider", &slow, 5e-3, 4.1, true),
        (TUMBLES, &by_esdirk, 2e-3, 2.65, false),
        (TUMBLES, &thin, 2e-3, 2.65, false),
    ];
    for (scene, overrides, step_s, until_s, is_lost) in cases {
        let given = [overrides, &[format!("solver.step_s={step_s}")]].concat();
        let (out, said) = checked(scene, &given, Some("--json"))?;
        let found: serde_json::Value = serde_json::from_str(&out)?;
        let found_rad = found["step_error_rad"].as_f64().ok_or("no error")?;
        let (out, _) = checked(scene, &given, None)?;
        let (_, compared) = out.split_once(" rad in the first link's angle, until ").ok_or("no line")?;
        // A busy machine comes less far.
        let until_s = compared.split_once(" s\n").ok_or("no time")?.0.parse::<f64>()?.min(until_s);
        let [own, fine] = [step_s, 1e-4].map(|step_s| angles_rad(scene, overrides, step_s, until_s));
        let error_rad = own?.iter().zip(&fine?).map(|(own, fine)| (own - fine).abs()).fold(0.0, f64::max);
        assert!((0.5..1.5).contains(&(found_rad / error_rad)), "{scene}: {found_rad:e} rad for {error_rad:e} rad");
        let warning =
            format!("warning: with half the step, the first link's angle differs by up to {found_rad:.1e} rad in this run");
        assert_eq!((found_rad > 1.0, said.contains(&warning)), (is_lost, is_lost), "{found_rad:e} rad: {said}");
        let line = format!("\n  step error   {found_rad:.1e} rad in the first link's angle, until ");
        assert!(out.contains("sound\n") && out.contains(&line), "{out}");
    }
    Ok(())
}
