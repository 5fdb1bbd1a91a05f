//! The command's warnings.

use std::process::Command;

/// Standard error of a small study in which nothing is fast enough to be chosen.
fn said(options: &[&str]) -> String {
    let few = ["trade", "ref-r1", "--models", "rigid", "--integrators", "runge-kutta", "--until", "0.2", "--outputs", "energy"];
    let demands = ["--budget", "4", "--real-time-factor", "1e8"];
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(few).args(demands).args(options).output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{said}");
    said
}

/// Steps in seconds that were meant in milliseconds.
#[test]
fn regress_a_reference_that_fails_at_steps_from_the_given_ones_asks_for_shorter_ones() {
    let words = ["trade", "crank-slider", "--steps", "10,5", "--until", "100", "--budget", "4s"];
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    let why = "error: no reference: the finite-element model, refined from a step of 4e-1 s that follows from --steps, still fails \
               at 5e-2 s; try shorter --steps, which are in seconds without a unit: diverged in step ";
    assert!(ended.status.code() == Some(1) && said.contains(why), "{said}");
}

#[test]
fn regress_steps_tolerances_and_angles_in_another_unit_are_warned_of() {
    let instants =
        "warning: with these --steps, runs are compared at only 10 instants, 0.02 s apart: errors between them are not seen; ";
    let tolerance = "warning: --tolerance 10 is 1000 %: errors are relative, and 10 % is 0.1\n";
    let angle = "warning: start.angle_rad = 180 is 28.6 turns: angles are in radians\n";
    let refusal = "error: the real-time factor fails: the fastest, rigid, runge-kutta, step 2e-2 s, is ";
    let warned = said(&["--steps", "20ms", "--tolerance", "10", "--set", "start.angle_rad=180"]);
    for line in [instants, tolerance, angle, refusal] {
        assert_eq!(warned.matches(line).count(), 1, "{line}: {warned}");
    }
    let unwarned = said(&["--steps", "1ms", "--tolerance", "1"]);
    assert!(!unwarned.contains("instant") && !unwarned.contains('%') && !unwarned.contains("radians"), "{unwarned}");
}

/// The place of a free end was called `slider`.
#[test]
fn regress_the_end_of_a_chain_without_slider_is_called_its_tip() {
    let few = ["trade", "ref-r5", "--models", "rigid", "--integrators", "runge-kutta", "--until", "0.2", "--steps", "1ms"];
    let flexible = ["--set", "beam.second_moment_m4=1e-8"];
    let words = ["--outputs", "angle,slider,tip", "--tolerance", "1e-9", "--budget", "1s", "--wide"];
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(few).args(flexible).args(words).output().unwrap();
    let [printed, said] = [ended.stdout, ended.stderr].map(|text| String::from_utf8(text).unwrap());
    let printed = printed.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(ended.status.code() == Some(1) && said.contains(" times over it in "), "{said}");
    for part in ["uncertain by angle ", ", tip ", " error angle tip deflection forces energy ", "front, by angle, tip: "] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    assert!(!printed.contains("slider") && !said.contains("slider"), "{printed} {said}");
}

/// The written scene had the command alone, where the terminal had errors and speed.
#[test]
fn regress_a_written_scene_has_the_errors_of_its_settings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("chosen.toml");
    let few = ["trade", "ref-r1", "--models", "rigid", "--until", "0.2", "--outputs", "angle"];
    let words = ["--tolerance", "1e-2", "--budget", "4s", "--write"];
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(few).args(words).arg(&path).output().unwrap();
    let [printed, said] = [ended.stdout, ended.stderr].map(|text| String::from_utf8(text).unwrap());
    assert_eq!(ended.status.code(), Some(0), "{said}");
    let written = std::fs::read_to_string(path).unwrap();
    let (_, comments) = written.split_once("# Chosen by `").unwrap();
    let error = comments.lines().find(|line| line.starts_with("# error ")).unwrap();
    assert!(printed.contains(error) && comments.contains("[solver]"), "{written}");
}

/// The refusal named no way on.
#[test]
fn regress_models_and_integrators_that_do_not_suit_are_refused_with_those_that_do() {
    let shorter = "modal takes generalized-alpha, two-point, esdirk; runge-kutta needs shorter --steps\n";
    for (model, integrator, way) in
        [("modal", "runge-kutta", shorter), ("incremental", "esdirk", "incremental takes two-point\n")]
    {
        let words = ["trade", "crank-slider", "--models", model, "--integrators", integrator];
        let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).output().unwrap();
        let said = String::from_utf8(ended.stderr).unwrap();
        let why = format!("error: none of the models and integrators asked for suits this scene: {way}");
        assert!(ended.status.code() == Some(2) && said.ends_with(&why), "{said}");
    }
}

/// The configurations were called finer ones, and not to have run to their end: none was begun.
#[test]
fn regress_a_budget_that_allows_no_configuration_is_what_is_blamed() {
    let few = ["trade", "ref-r1", "--models", "rigid", "--until", "0.2", "--outputs", "angle"];
    let demands = ["--budget", "1ms", "--tolerance", "1e-2"];
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(few).args(demands).output().unwrap();
    let [printed, said] = [ended.stdout, ended.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(printed.contains("\n40 configurations were skipped: --budget allows none\n"), "{printed}");
    let why = "error: the budget of 0.001 s allows no configuration to be measured (40 skipped): choose a larger --budget\n";
    assert!(ended.status.code() == Some(1) && said.ends_with(why), "{said}");
}

/// By the help, a rigid link of a flexible chain had an error of 1.
#[test]
fn regress_the_help_and_the_guide_say_what_the_deflection_of_a_straight_link_is_divided_by() {
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(["trade", "--help"]).output().unwrap();
    let help = String::from_utf8(ended.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(help.contains("(a deflection whose peak is below 1e-6 of its link's length, over that length)"), "{help}");
    let guide = include_str!("../../src/guide/analysis.md");
    assert!(guide.contains("; where a peak is below 1e-6 of its link's length, over that length |"));
}

/// A strip of spring steel that hangs, struck by a rectangular pulse.
const STRIP: &str = "
[beam]
length_m = 0.5
section = { shape = \"rectangle\", width_m = 0.025, height_m = 0.0015 }
density_kg_per_m3 = 7850.0
youngs_modulus_pa = 2.05e11
elements = 8
modes = 3
damping_s = 2e-5
[tip]
mass_kg = 0.08
[base]
damper_nm_s_per_rad = 0.005
[gravity]
y_m_per_s2 = -9.81
[start]
angle_rad = -1.5707963267948966
[[pulse]]
start_s = 0.2
torque_nm = 0.5
duration_s = 0.05
[solver]
model = \"modal\"
integrator = \"esdirk\"
step_s = 0.001
";

/// All settings agreed where the torque comes from the bus alone: `trade` made links rigid, "verified" with an error of 0.
#[test]
fn regress_a_scene_in_which_nothing_moves_is_refused() {
    let words = ["trade", "crank-slider", "--set", "pulse=[]", "--until", "0.5", "--budget", "2s", "--tolerance", "1e-2"];
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    let why =
        "error: nothing moves in this scene within 0.5 s, and settings that compute nothing are all alike: give it a pulse, ";
    assert!(ended.status.code() == Some(2) && said.contains(why) && ended.stdout.is_empty(), "{said}");
}

/// Steps of fixed cost do not cut the edges of pulses. `trade --fixed-cost` chose a setting that `run --fixed-cost` called untrusted.
#[test]
fn regress_the_balance_of_steps_of_fixed_cost_counts() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("strip.toml"), STRIP).unwrap();
    let kept = |more: &[&str]| {
        let words = ["trade", "strip.toml", "--steps", "1e-3,5e-4", "--models", "modal", "--integrators", "esdirk", "--json"];
        let mut trade = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        let ended = trade.args(words).args(["--modes", "3"]).args(more).current_dir(folder.path()).output().unwrap();
        let rows = String::from_utf8(ended.stdout).unwrap();
        assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
        let rows = rows.lines().map(|row| serde_json::from_str::<serde_json::Value>(row).unwrap());
        rows.map(|row| (row["step_s"].as_f64(), row["balance_kept"].as_f64())).collect::<Vec<_>>()
    };
    let [long, short] = [1e-3, 5e-4].map(Some);
    assert_eq!(kept(&[]), [(long, Some(1.0)), (short, Some(1.0))]);
    assert_eq!(kept(&["--fixed-cost"]), [(long, Some(0.0)), (short, Some(1.0))]);
}

/// After an untrusted `run --fixed-cost`, `trade` refused the option that `run` printed for it.
#[test]
fn regress_the_remedy_of_steps_of_fixed_cost_is_taken_by_each_command() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("strip.toml"), STRIP).unwrap();
    let words = ["run", "strip.toml", "--fixed-cost", "--until", "2", "--no-bus", "--pace", "max", "--no-record"];
    let ended = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(words).current_dir(folder.path()).output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    let remedy = "to judge steps of fixed cost, `check` takes `--set solver.corrections=N`, N being the number that --fixed-cost found, \
                  and `trade` takes `--fixed-cost`\n";
    assert!(ended.status.code() == Some(6) && said.ends_with(remedy), "{said}");
}
