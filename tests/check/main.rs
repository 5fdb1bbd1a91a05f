//! `check` measures the error of the step, and warns where that loses the motion.

mod half_step;
mod pendulum;
mod range;
mod short_load;
mod sudden_start;

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

/// A springboard that is struck by pulses that begin at once.
const BOARD: &str = r#"
[beam]
length_m = 2.4
section = { shape = "rectangle", width_m = 0.3, height_m = 0.03 }
density_kg_per_m3 = 650.0
youngs_modulus_pa = 1.2e10
damping_s = 2e-3
elements = 6
[tip]
mass_kg = 20.0
[base]
torsion_spring_nm_per_rad = 1e6
damper_nm_s_per_rad = 200.0
[gravity]
y_m_per_s2 = -9.81
[start]
static_equilibrium = true
[[pulse]]
start_s = 0.5
torque_nm = 2000.0
duration_s = 0.1
[[pulse]]
start_s = 2.0
torque_nm = -3000.0
duration_s = 0.05
"#;

/// A press that turns once in 25 s. Its slider meets a resistance of up to 400 kN between 16.8 s and 25 s.
const SLOW_PRESS: &str = r#"
[crank]
length_m = 0.08
section = { shape = "round", diameter_m = 0.09 }
density_kg_per_m3 = 7850
youngs_modulus_pa = 2.1e11
elements = 2
[rod]
length_m = 0.5
section = { shape = "rectangle", width_m = 0.06, height_m = 0.08 }
density_kg_per_m3 = 7850
youngs_modulus_pa = 2.1e11
elements = 4
[slider]
mass_kg = 120
resistance_table = [[0, 0], [4.2, 0], [5.5, 150000], [6.1, 400000], [6.25, 0]]
[gravity]
x_m_per_s2 = 9.81
[drive]
speed_rad_per_s = 0.25
[solver]
step_s = 0.01
"#;

/// Runs `check` with these options more; returns standard output and standard error.
fn checked(scene: &str, overrides: &[String], options: &[&str]) -> Tried<(String, String)> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
    command.args(["check", scene]).args(overrides.iter().flat_map(|given| ["--set", given.as_str()])).args(options);
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

/// Only 10 s were run, before the resistance acts, and nothing said so. The rod carries the resistance over the cosine of its
/// angle, less the slider's weight. Where turns are too slow for a second of computing, a line says how far they were looked at.
#[test]
fn regress_two_turns_of_a_slow_drive_are_looked_at_or_a_line_says_how_far() -> Tried {
    let folder = tempfile::tempdir()?;
    let press = folder.path().join("press.toml");
    std::fs::write(&press, SLOW_PRESS)?;
    let press = press.to_str().ok_or("no path")?;
    let found: serde_json::Value = serde_json::from_str(&checked(press, &[], &["--json"])?.0)?;
    let rod = found["shortening"].as_array().and_then(|links| links.iter().find(|link| link["link"] == "rod")).ok_or("no rod")?;
    let force_n = 4e5 / (1.0 - (0.16 * 6.1_f64.sin()).powi(2)).sqrt() - 120.0 * 9.81;
    let compression_n = -rod["force_n"].as_f64().ok_or("no force")?;
    assert!((compression_n / force_n - 1.0).abs() < 5e-3, "{compression_n} N for {force_n} N");
    assert!(rod["recommends_axial"] == true && found["looked_at"].is_null(), "{found}");

    let slower = ["drive.speed_rad_per_s=1e-5".to_owned()];
    let (out, _) = checked(press, &slower, &[])?;
    let line = out.lines().find_map(|line| line.strip_prefix("  looked at    ")).ok_or("no line")?;
    let (looked, rest) = line.split_once(" s; two turns are done at 1256637 s: ").ok_or_else(|| line.to_owned())?;
    assert!((10.0..1e6).contains(&looked.parse::<f64>()?), "{line}");
    assert_eq!(rest, "--until 1256637 looks further, for at most 30 s of computing");
    let (out, _) = checked(press, &slower, &["--until", "0.5"])?;
    assert!(!out.contains("  looked at "), "{out}");
    Ok(())
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
        let (out, said) = checked(scene, &given, &["--json"])?;
        let found: serde_json::Value = serde_json::from_str(&out)?;
        let found_rad = found["step_error_rad"].as_f64().ok_or("no error")?;
        let (out, _) = checked(scene, &given, &[])?;
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
        let finding = if is_lost { ": valid, but its result depends on the step\n" } else { ": sound\n" };
        assert!(out.contains(finding) && out.contains(&line), "{out}");
    }
    Ok(())
}

/// A drive prescribes the crank's angle. The truth is a run with a twentieth of the step.
#[test]
fn val_the_error_of_the_step_of_a_driven_chain_is_that_of_its_deflection() -> Tried {
    let driven = ["pulse=[]", "drive.speed_rad_per_s=20.0", "start.rate_rad_per_s=20.0", "crank.rigid=true"].map(str::to_owned);
    let deflections_m = |step_s: f64| -> Tried<Vec<f64>> {
        let overrides = [&driven[..], &[format!("solver.step_s={step_s}")]].concat();
        let mut simulation = Simulation::new(&SceneSource::open("crank-slider", &overrides)?.scene)?;
        let mut found = Vec::new();
        for step in 1..=(0.62 / step_s) as u32 {
            simulation.step()?;
            if step.is_multiple_of((5e-3 / step_s).round() as u32) {
                found.push(simulation.observe()?.links[1].nodes[2].deflection_m.ok_or("no deflection")?);
            }
        }
        Ok(found)
    };
    let (own_m, fine_m) = (deflections_m(5e-3)?, deflections_m(2.5e-4)?);
    let peak_m = fine_m.iter().fold(0.0_f64, |most, fine_m| most.max(fine_m.abs()));
    let true_error = own_m.iter().zip(&fine_m).map(|(own_m, fine_m)| (own_m - fine_m).abs()).fold(0.0, f64::max) / peak_m;
    let given = [&driven[..], &["solver.step_s=5e-3".to_owned()]].concat();
    let (out, _) = checked("crank-slider", &given, &["--json"])?;
    let found: serde_json::Value = serde_json::from_str(&out)?;
    let error = found["step_error_of_deflection"].as_f64().ok_or("no error")?;
    assert!((0.5..1.5).contains(&(error / true_error)) && true_error > 1e-4, "{error:e} for {true_error:e}");
    assert!(found["step_error_rad"].is_null(), "{out}");
    let (out, _) = checked("crank-slider", &given, &[])?;
    assert!(out.contains(&format!(" m in the rod's deflection, {error:.1e} of its peak, until ")), "{out}");
    let without_nodes = [&given[..], &["rod.elements=1".to_owned()]].concat();
    let (out, _) = checked("crank-slider", &without_nodes, &[])?;
    assert!(out.contains("\n  step error   not known: the angle is prescribed, and no link has a node in its middle"), "{out}");
    Ok(())
}

/// Without damping, energy that the step takes out adds up: the usual two seconds keep the balance with a step that twenty do not.
#[test]
fn regress_the_suggested_step_keeps_the_balance_until_the_time_asked_for() -> Tried {
    let undamped = ["check", "--json", "--set", "crank.damping_s=0", "--set", "rod.damping_s=0"];
    let checked = |more: &[&str]| -> Tried<(Option<i32>, f64)> {
        let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(undamped).args(more).output()?;
        let found: serde_json::Value = serde_json::from_slice(&ended.stdout)?;
        Ok((ended.status.code(), found["suggested_step_s"].as_f64().ok_or("no step")?))
    };
    let (_, usual_s) = checked(&[])?;
    let with = |step_s: f64| format!("solver.step_s={step_s}");
    assert_eq!(checked(&["--until", "20", "--set", &with(usual_s)])?.0, Some(6), "{usual_s}");
    let (_, longer_s) = checked(&["--until", "20"])?;
    assert_eq!(checked(&["--until", "20", "--set", &with(longer_s)])?.0, Some(0), "{longer_s}");
    Ok(())
}

/// The steps that resolve the undamped vibration keep the balance, but the vibration drifts in phase, and the crank with it.
#[test]
fn regress_the_suggested_step_has_a_small_step_error() -> Tried {
    let undamped = ["crank.damping_s=0", "rod.damping_s=0"].map(str::to_owned);
    let driven = [
        "crank.rigid=true",
        "rod.damping_s=0",
        "pulse=[]",
        "drive.speed_rad_per_s=20.0",
        "start.rate_rad_per_s=20.0",
        "solver.integrator=generalized-alpha",
    ];
    let driven = driven.map(str::to_owned);
    for (overrides, until, error, longer_s, unit) in [
        (&undamped[..], "10", "step_error_rad", "0.005", "rad"),
        (&driven[..], "5", "step_error_of_deflection", "0.001", "of the rod's peak deflection"),
    ] {
        let judged = |overrides: &[String]| -> Tried<serde_json::Value> {
            let (out, _) = checked("crank-slider", overrides, &["--until", until, "--json"])?;
            Ok(serde_json::from_str(&out)?)
        };
        let with = |step_s: &str| [overrides, &[format!("solver.step_s={step_s}")]].concat();
        let longer_error = judged(&with(longer_s))?[error].as_f64().ok_or("no error")?;
        let reason = format!("; {longer_s} s would suffice for that, but has a step error of {longer_error:.1e} {unit}");
        let found = judged(overrides)?;
        assert!(longer_error > 1e-2 && found["reason"].as_str().is_some_and(|text| text.ends_with(&reason)), "{reason}: {found}");
        let again = judged(&with(&found["suggested_step_s"].to_string()))?;
        assert!(again[error].as_f64().is_some_and(|error| error <= 1e-2), "{found}: {again}");
        assert_eq!(again["suggested_step_s"], found["suggested_step_s"]);
    }
    Ok(())
}

/// A uniform beam on a spring: its weight turns it, and bends it by w L⁴/8EJ from its tangent at the pivot.
#[test]
fn regress_check_names_the_position_in_which_a_scene_rests() -> Tried {
    let sprung = ["base.torsion_spring_nm_per_rad=2000", "beam.second_moment_m4=1e-8", "pulse=[]"];
    let solved = ["solver.model=modal", "solver.integrator=generalized-alpha"];
    let resting = ["gravity.y_m_per_s2=-9.81", "start.static_equilibrium=true"];
    let given = [&sprung[..], &solved, &resting].concat().into_iter().map(str::to_owned).collect::<Vec<_>>();
    let (out, _) = checked("thesis-beam", &given, &[])?;
    let line = out.lines().find_map(|line| line.strip_prefix("  start        ")).ok_or("no start")?;
    assert!(line.starts_with("beam at -2.70") && line.ends_with(" m to the right at its end"), "{line}");
    let json: serde_json::Value = serde_json::from_str(&checked("thesis-beam", &given, &["--json"])?.0)?;
    let start = |name: &str| json["start"][name].as_f64().ok_or("no number");
    let weight_n = 7700.0 * 0.01 * 0.5 * 9.81;
    let moment_nm = weight_n * 0.25 * start("angle_rad")?.cos();
    assert!((2000.0 * start("angle_rad")? / moment_nm + 1.0).abs() < 1e-3, "{json}");
    let bent_m = weight_n * 0.5_f64.powi(3) / (8.0 * 2.1e11 * 1e-8);
    assert!((start("bent_m")? / bent_m + 1.0).abs() < 0.01, "{json}");
    let (out, _) = checked("thesis-beam", &given[..given.len() - 1], &[])?;
    assert!(!out.contains("  start "), "{out}");
    Ok(())
}

/// A pulse that begins at once excites a fast vibration of this board. Steps that resolve its slow swing do not keep the energy balance,
/// nor do ten halves of them, some of which are beyond the stability limit of `runge-kutta`.
#[test]
fn regress_a_step_is_suggested_however_far_it_is_below_that_of_the_slowest_motion() -> Tried {
    let folder = tempfile::tempdir()?;
    let board = folder.path().join("board.toml");
    std::fs::write(&board, BOARD)?;
    let board = board.to_str().ok_or("no path")?;
    for own in [&["solver.step_s=2e-5"][..], &["solver.integrator=runge-kutta", "solver.step_s=5e-5"]] {
        let own: Vec<String> = own.iter().map(|given| (*given).to_owned()).collect();
        let json: serde_json::Value = serde_json::from_str(&checked(board, &own, &["--until", "4", "--json"])?.0)?;
        let step_s = json["suggested_step_s"].as_f64().ok_or_else(|| json.to_string())?;
        assert!((1e-5..=1e-4).contains(&step_s), "{json}");
        let with_it = [&own[..], &[format!("solver.step_s={step_s}")]].concat();
        let (out, _) = checked(board, &with_it, &["--until", "4"])?;
        assert!(out.contains("board.toml: sound\n"), "{out}");
    }
    // The usual run reaches both pulses, at steps so short, too.
    let (out, _) = checked(board, &["solver.step_s=2e-5".to_owned()], &[])?;
    assert!(!out.contains("alone"), "{out}");
    Ok(())
}

/// Links that nothing bends have nodes enough. The incremental model, one element a link, is refused: it stood still under any drive.
#[test]
fn regress_the_links_that_lack_a_node_in_the_middle_are_named_where_that_can_be_mended() -> Tried {
    let unknown = "not known: the angle is prescribed, and no link";
    for (scene, more, said) in [
        (
            "crank-slider",
            ["drive.speed_rad_per_s=3.0", "crank.elements=1", "rod.elements=1"],
            "has a node in its middle: set crank.elements and rod.elements to 4\n",
        ),
        (
            "crank-slider",
            ["drive.speed_rad_per_s=3.0", "crank.rigid=true", "rod.elements=1"],
            "has a node in its middle: set rod.elements to 4\n",
        ),
    ] {
        let given: Vec<String> = ["pulse=[]"].into_iter().chain(more).map(str::to_owned).collect();
        let (out, _) = checked(scene, &given, &[])?;
        assert!(out.contains(&format!("\n  step error   {unknown} {said}")), "{out}");
    }
    let driven = ["check", "thesis-crank-slider", "--set", "pulse=[]", "--set", "drive.speed_rad_per_s=3.0"];
    let refused = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(driven).output()?;
    let why = "a torque drives it, and [drive] prescribes a motion: use modal, finite-element or rigid";
    assert!(refused.status.code() == Some(2) && String::from_utf8(refused.stderr)?.contains(why));
    let still = ["pulse=[]", "drive.speed_rad_per_s=0.0"].map(str::to_owned);
    let (out, _) = checked("crank-slider", &still, &[])?;
    assert!(out.contains("\n  step error   none: the motion is prescribed, and no link bends\n"), "{out}");
    Ok(())
}

/// A scene whose torque comes from the bus was "sound", with a step suggested that lost the first pulse.
#[test]
fn regress_a_scene_in_which_nothing_moves_is_not_called_sound() -> Tried {
    let still = ["pulse=[]", "rod.axial=false", "crank.axial=false", "gravity.x_m_per_s2=9.81"].map(str::to_owned);
    let warning =
        "warning: nothing moves in this run: its balance, step error and suggested step say nothing of the scene under a load; ";
    let (out, said) = checked("crank-slider", &still, &[])?;
    assert!(out.starts_with("crank-slider: valid; nothing moves in it\n") && said.contains(warning), "{out}{said}");
    assert!(!out.contains("axial"), "{out}");
    let hangs = ["start.angle_rad=-1.5707963", "gravity.y_m_per_s2=-9.81"].map(str::to_owned);
    for moving in [&["pulse=[{start_s=1.9,torque_nm=1e-6,duration_s=0.05}]".to_owned()][..], &[&still[..], &hangs].concat()] {
        let (out, said) = checked("crank-slider", moving, &["--until", "2"])?;
        assert!(out.starts_with("crank-slider: sound\n") && !said.contains("nothing moves"), "{out}{said}");
    }
    let folder = tempfile::tempdir()?;
    let falls = "[crank]\nlength_m = 0.4\nmass_kg = 1\nrigid = true\n[rod]\nlength_m = 0.4\nmass_kg = 1\nrigid = true\n[tip]\nmass_kg = 0.5\n\
                 [gravity]\ny_m_per_s2 = -9.81\n[drive]\nspeed_rad_per_s = 0\n[solver]\nmodel = \"rigid\"\nstep_s = 1e-3\n";
    let masses = "[oscillator]\nmasses_kg = [1.0, 1.0]\nsprings = [[0, 1, 300.0], [0, 2, 200.0]]\nstart_m = [0.0, 1.0]\n[solver]\nstep_s = 1e-3\n";
    for scene in [falls, masses] {
        let path = folder.path().join("moves.toml");
        std::fs::write(&path, scene)?;
        let (out, said) = checked(path.to_str().ok_or("no path")?, &[], &[])?;
        assert!(out.contains("moves.toml: sound\n") && !said.contains("nothing moves"), "{out}{said}");
    }
    Ok(())
}

/// A run that a pulse ended in its first step was told to be given a pulse.
#[test]
fn regress_a_run_that_diverges_with_its_pulse_is_not_one_in_which_nothing_moves() -> Tried {
    let arm = "[beam]\nlength_m = 0.6\nsection = { shape = \"rectangle\", width_m = 0.025, height_m = 0.004 }\ndensity_kg_per_m3 = 2700\n\
               youngs_modulus_pa = 7e10\nelements = 8\nmodes = 4\ndamping_s = 1e-4\n[tip]\nmass_kg = 0.2\n[base]\n\
               torsion_spring_nm_per_rad = 4\ndamper_nm_s_per_rad = 0.05\n[[pulse]]\nstart_s = 0.1\ntorque_nm = 1e7\nduration_s = 0.05\n\
               [solver]\nmodel = \"modal\"\nintegrator = \"esdirk\"\nstep_s = 0.001\n";
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("arm.toml"), arm)?;
    let done = Command::new(env!("CARGO_BIN_EXE_flexcrank")).current_dir(folder.path()).args(["check", "arm.toml"]).output()?;
    let said = String::from_utf8(done.stderr)?;
    assert_eq!(done.status.code(), Some(4), "{said}");
    assert!(said.contains("diverged in step 101 at t = 0.1 s") && !said.contains("nothing moves"), "{said}");
    Ok(())
}

/// Maps of a scene whose load comes later than a run of a map ends had "0 wrong" in all cells.
#[test]
fn regress_maps_in_which_nothing_moves_are_warned_of() -> Tried {
    let swept = |map: &str, set: &str| -> Tried<String> {
        let given = ["stability", "crank-slider", "--quick", "--only", map, "--set", set];
        let done = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(given).output()?;
        assert_eq!(done.status.code(), Some(0));
        Ok(String::from_utf8(done.stderr)?)
    };
    let warning = |until: &str| format!("warning: nothing moves in crank-slider before {until} s: a run that ends ");
    for (start, until) in [("pulse.0.start_s=5", "0.05"), ("pulse.0.start_s=0.012", "0.012")] {
        assert!(swept("weight-modal", start)?.contains(&warning(until)));
    }
    assert_eq!(swept("weight-modal", "pulse.0.start_s=0")? + &swept("crank-speed-modal-esdirk", "pulse.0.start_s=5")?, "");
    Ok(())
}
