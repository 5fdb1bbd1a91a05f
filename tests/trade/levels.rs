//! Levels of detail: chosen, verified and written into a scene.

use std::process::Command;

use flexcrank::scene::{IntegratorKind, ModelKind, Scene};
use flexcrank::study::trade::{
    Configuration, Demands, NoLevels, OutputGroup, Question, Refusal, Selection, Study, choose_levels,
};

use super::{answer, ask, open};

#[test]
fn val_levels_are_verified_settings_between_which_a_run_switches() {
    let source = open("crank-slider", &[]);
    let selection = Selection {
        models: vec![ModelKind::Incremental, ModelKind::Modal, ModelKind::FiniteElement],
        integrators: vec![IntegratorKind::TwoPoint, IntegratorKind::Esdirk],
        modes: vec![1, 2, 4],
        elements: vec![4, 8],
        steps_s: vec![5e-3, 2e-3, 1e-3],
        ..Selection::default()
    };
    let told = answer(&source, &Question { until_s: Some(0.5), ..ask(selection, &OutputGroup::DEFAULT, 20.0) });
    let choose = |tolerance, real_time_factor| {
        choose_levels(&source, &told, &Demands { tolerance, real_time_factor }, 3, 20.0, &mut |_| {})
    };
    let chosen = choose(f64::INFINITY, 0.1).unwrap();
    let [first, .., last] = &chosen.levels[..] else { panic!("{chosen:?}") };
    let measured = |of: usize| chosen.levels[of].row.outcome.as_ref().unwrap();
    let cost = |of: usize| measured(of).timing.quickest_per_s;
    assert!(chosen.levels.len() == 3 && first.error_rad < 0.1 * last.error_rad, "{:?}", chosen.tables);
    for of in 1..3 {
        assert!(cost(of) <= 0.7 * cost(of - 1) && measured(of).error > measured(0).error);
    }
    for (of, level) in chosen.levels.iter().enumerate() {
        let [run, other] = [measured(of).errors.max[0], level.trial.errors.max[0]];
        assert!(level.error_rad >= run.max(other) && level.error_rad <= 1e-4_f64.max(run.max(other)), "{level:?}");
        let (written, meant) = (chosen.source.at_level(of).unwrap().scene, level.row.configuration.scene(&source.scene));
        let modes = |scene: &Scene| scene.chain().unwrap().links.iter().map(|link| (link.rigid, link.modes)).collect::<Vec<_>>();
        assert_eq!((written.solver, modes(&written)), (meant.solver, modes(&meant)));
    }
    let refused = choose(f64::INFINITY, 1e9).unwrap_err();
    assert!(matches!(refused, NoLevels::First(Refusal::Speed { .. })), "{refused}");
    let refused = choose(1e-9, 0.1).unwrap_err();
    assert!(matches!(refused, NoLevels::First(Refusal::Tolerance { .. })), "{refused}");
}

/// A level that did not keep the energy balance ended the run.
#[test]
fn regress_levels_keep_the_energy_balance_if_any_setting_does() {
    let source = open("crank-slider", &[]);
    let selection = Selection {
        models: vec![ModelKind::Modal],
        integrators: vec![IntegratorKind::TwoPoint],
        modes: vec![1, 2],
        steps_s: vec![2e-3, 1e-3, 5e-4],
        ..Selection::default()
    };
    let mut told = answer(&source, &Question { until_s: Some(0.2), ..ask(selection, &OutputGroup::DEFAULT, 12.0) });
    let demands = Demands { tolerance: f64::INFINITY, real_time_factor: 0.1 };
    let choose = |told: &Study| -> Vec<Configuration> {
        let levels = choose_levels(&source, told, &demands, 2, 12.0, &mut |_| {}).unwrap().levels;
        levels.into_iter().map(|level| level.row.configuration).collect()
    };
    let cheapest = choose(&told).pop().unwrap();
    for row in told.rows.iter_mut().filter(|row| row.configuration == cheapest) {
        row.outcome.as_mut().unwrap().balance_kept = false;
    }
    assert!(!choose(&told).contains(&cheapest));
    for measured in told.rows.iter_mut().filter_map(|row| row.outcome.as_mut().ok()) {
        measured.balance_kept = false;
    }
    assert_eq!(choose(&told).len(), 2);
}

#[test]
fn val_levels_are_written_into_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["a.toml", "b.toml"].map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(arguments).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let few = [
        "--models",
        "modal",
        "--integrators",
        "two-point",
        "--modes",
        "1,2,4",
        "--steps",
        "4e-3,1e-3,1e-4",
        "--until",
        "0.2",
        "--budget",
        "12",
    ];
    let trade = |scene: &str, options: &[&str]| run(&[&["trade", scene], &few[..], options].concat());
    let (code, said) = trade("crank-slider", &["--levels", "6", "--real-time-factor", "0.1", "--write", &paths[0]]);
    assert!(code == Some(0) && said.contains("levels instead of 6"), "{said}");
    assert_eq!(run(&["check", &paths[0]]).0, Some(0));
    // Levels are replaced, and a scene with levels is measured as it is.
    assert_eq!(trade(&paths[0], &["--levels", "2", "--real-time-factor", "0.1", "--write", &paths[1]]).0, Some(0));
    let [first, second] = paths.each_ref().map(|path| open(path, &[]));
    assert!(first.scene.levels.len() > 2 && second.scene.levels.len() == 2);
    assert!(second.text.contains("# Damping as of bolted steel") && second.text.matches("# Levels of detail").count() == 1);
    assert_eq!(trade(&paths[0], &["--levels", "2", "--write", &paths[1]]).0, Some(1), "never overwritten");
    let (code, said) = trade("crank-slider", &["--levels", "2", "--real-time-factor", "1e8"]);
    assert!(code == Some(1) && said.contains("real-time factor fails"), "{said}");
    for wrong in
        [&["--levels", "1"][..], &["--levels", "9"], &["--levels", "few"], &["--write", "x.toml"], &["--real-time-factor", "2"]]
    {
        assert_eq!(trade("crank-slider", wrong).0, Some(2), "{wrong:?}");
    }
    assert_eq!(run(&["trade", "thesis-oscillator", "--levels", "2"]).0, Some(2));
    assert_eq!(run(&["trade", "ref-r2s", "--levels", "2", "--models", "incremental"]).0, Some(2));
}
