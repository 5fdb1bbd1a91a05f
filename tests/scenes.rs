//! Scenes: allowed keys and values, and the messages of refusals.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may fail")]

use std::collections::BTreeSet;

use flexcrank::guide;
use flexcrank::scene::{self, ModelKind, SceneSource, builtin};
use flexcrank::simulation::{EnergyVerdict, Simulation};

fn refused(text: &str) -> String {
    match SceneSource::parse("scene.toml", text, &[]) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.in_full(),
    }
}

/// The default scene with one line replaced.
fn with(line: &str, instead: &str) -> String {
    let text = builtin::find("crank-slider").unwrap().text;
    assert!(text.contains(line), "{line}");
    text.replacen(line, instead, 1)
}

#[test]
fn val_every_builtin_scene_is_valid_and_runs() {
    for scene in builtin::BUILTIN {
        let source = SceneSource::open(scene.name, &[]).unwrap();
        let mut simulation = Simulation::new(&source.scene).unwrap();
        for _ in 0..10 {
            simulation.step().unwrap();
        }
        assert!(simulation.observe().unwrap().energy.kinetic_j.is_finite(), "{}", scene.name);
        assert!(!scene.summary().is_empty());
    }
}

#[test]
fn regress_refusals_name_file_line_key_value_and_allowed_range() {
    let cases = [
        (with("length_m = 0.5", "lenght_m = 0.5"), "scene.toml:5: crank.lenght_m = 0.5: unknown key; did you mean `length_m`?"),
        (with("length_m = 0.5", "length_m = -1"), "scene.toml:5: crank.length_m = -1: must be a number from 1e-9 to 1e6"),
        (with("length_m = 0.5", "length_m = nan"), "scene.toml:5: crank.length_m = nan: must be a number"),
        (
            with("length_m = 0.5", "length_m = \"long\""),
            "scene.toml:5: crank.length_m = \"long\": must be a number without its unit",
        ),
        (with("length_m = 1.5", "length_m = 0.5"), "scene.toml:15: rod.length_m = 0.5: must be longer than crank.length_m = 0.5"),
        (with("[slider]", "[silder]"), "scene.toml:24: silder: unknown key; did you mean `slider`?"),
        (with("length_m = 0.5\n", ""), "scene.toml:4: crank: missing key `length_m`"),
        (with("density_kg_per_m3 = 7700.0\n", ""), "scene.toml:4: crank: missing key `density_kg_per_m3`"),
        (with("\"modal\"", "\"modla\""), "scene.toml:35: solver.model = \"modla\": must be one of"),
        (with("\"modal\"", "\"modla\""), "did you mean \"modal\"?"),
        (with("shape = \"rectangle\"", "shape = \"square\""), "unknown value"),
        (with("torque_nm = 20.0", "torque_nm = inf"), "scene.toml:29: pulse.0.torque_nm = inf: must be a number"),
        (with("step_s = 0.002", "step_s = 0"), "solver.step_s = 0: must be a number from 1e-9 to 10"),
        (with("mass_kg = 0.2", "mass_kg = 0.2\nresistance_n = 1e300"), "slider.resistance_n = 1e300: must be a number"),
        (with("[crank]", "[crank"), "scene.toml:4: not TOML"),
        (String::new(), "scene.toml: no links"),
    ];
    for (text, expected) in cases {
        let said = refused(&text);
        assert!(said.contains(expected), "expected {expected}\nbut it says {said}");
    }
}

#[test]
fn regress_conflicting_keys_are_refused_never_ignored() {
    const SOLVER: &str = "model = \"modal\"\nintegrator = \"esdirk\"";
    let cases = [
        (
            with("[slider]", "[oscillator]\nmasses_kg = [1.0]\n\n[slider]").replace("\"modal\"", "\"mass-spring\""),
            "does not go with an [oscillator]",
        ),
        (with("[slider]", "[tip]\nmass_kg = 1.0\n\n[slider]"), "not both"),
        (with("[slider]", "[beam]\nlength_m = 1.0\n\n[slider]"), "a [beam] stands alone"),
        (with("[[pulse]]", "[drive]\nspeed_rad_per_s = 3.0\n\n[[pulse]]"), "prescribed motion leaves no room for torque"),
        (with("mass_kg = 0.2", "resistance_n = 1.0\nresistance_table = [[0.0, 1.0], [1.0, 2.0]]"), "not both"),
        (
            with("mass_kg = 0.2", "resistance_table = [[1.0, 1.0], [0.0, 2.0]]"),
            "row 2 is [0.0, 2.0]: its first number must be greater",
        ),
        (
            with("mass_kg = 0.2", "resistance_table = [[0.0, 1.0], [3, 14, 2.0]]"),
            "row 2 is [3.0, 14.0, 2.0]: must be two numbers",
        ),
        (with("mass_kg = 0.2", "resistance_table = [[0.0], [1.0]]"), "row 1 is [0.0]: must be two numbers"),
        (with("mass_kg = 0.2", "resistance_table = [[0.0, 1.0], [7.0, 2.0]]"), "row 2 is [7.0, 2.0]: angles must be in"),
        (with("mass_kg = 0.2", "resistance_table = [[0.0, 1.0], [1.0, nan]]"), "row 2 is [1.0, NaN]: must be finite"),
        (with(SOLVER, "model = \"incremental\""), "one element each"),
        (
            with("[slider]", "[start]\nstatic_equilibrium = true\n\n[slider]").replace(SOLVER, "model = \"incremental\""),
            "start.static_equilibrium = true: the incremental model starts with straight links",
        ),
        (with(SOLVER, "model = \"finite-element\"\nintegrator = \"runge-kutta\""), "finite-element goes with"),
        (with(SOLVER, "model = \"mass-spring\""), "goes with an [oscillator]"),
        (
            with(SOLVER, "corrections = 0"),
            "solver.corrections = 0: generalized-alpha solves its steps by iteration: must be a whole",
        ),
        (
            with(SOLVER, "integrator = \"runge-kutta\"\ncorrections = 2"),
            "solver.corrections = 2: runge-kutta does not iterate: must be 0",
        ),
        (with(SOLVER, "corrections = 1000"), "solver.corrections = 1000: must be a whole number from 0 to 20"),
        (with(SOLVER, "corrections = -1"), "solver.corrections = -1: must be a whole number from 0 to 20"),
        (with(SOLVER, "corrections = 2.5"), "solver.corrections = 2.5"),
    ];
    for (text, expected) in cases {
        assert!(refused(&text).contains(expected), "expected {expected}\nbut it says {}", refused(&text));
    }
}

#[test]
fn val_overrides_are_toml_and_bare_words_are_strings() {
    let set = |overrides: &[&str]| {
        let overrides: Vec<String> = overrides.iter().map(|&o| o.to_owned()).collect();
        SceneSource::open("crank-slider", &overrides)
    };
    let source =
        set(&["rod.length_m=1.2", "pulse.0.torque_nm = -3", "solver.model=rigid", "commands.torque_limit_nm=7"]).unwrap();
    assert_eq!(source.scene.chain().unwrap().links[1].length_m, 1.2);
    assert_eq!(source.scene.commands.torque_limit_nm, 7.0);
    assert_eq!(source.scene.solver.model, ModelKind::Rigid);
    assert!(source.text.contains("length_m = 1.2"), "the scene in force has the override in it");
    let again = SceneSource::parse("again", &source.text, &[]).unwrap();
    assert_eq!(again.scene, source.scene);
    for bad in ["rod.length_m", "=3", "pulse.7.torque_nm=1", "rod.length_m.x=1"] {
        assert!(set(&[bad]).is_err_and(|error| error.to_string().contains("--set")), "{bad}");
    }
}

#[test]
fn val_sections_have_their_areas_and_moments() {
    use std::f64::consts::PI;
    let cases = [
        ("{ shape = \"rectangle\", width_m = 0.02, height_m = 0.01 }", 2e-4, 0.02 * 1e-6 / 12.0),
        ("{ shape = \"round\", diameter_m = 0.006 }", PI * 9e-6, PI * 0.006_f64.powi(4) / 64.0),
        ("{ shape = \"tube\", outer_m = 0.02, inner_m = 0.01 }", PI * 7.5e-5, PI * (0.02_f64.powi(4) - 1e-8) / 64.0),
    ];
    for (section, area, moment) in cases {
        let text = with("section = { shape = \"rectangle\", width_m = 0.01, height_m = 0.01 }", &format!("section = {section}"));
        let bar = SceneSource::parse("scene", &text, &[]).unwrap().scene.chain().unwrap().links[0].bar.unwrap();
        assert!((bar.area_m2 / area - 1.0).abs() < 1e-12 && (bar.second_moment_m4 / moment - 1.0).abs() < 1e-12, "{section}");
    }
}

#[test]
fn val_a_rigid_link_may_give_its_mass() {
    let text = "[crank]\nlength_m = 0.1\nmass_kg = 2.0\ncentre_of_mass_m = 0.0\ninertia_kg_m2 = 0.5\n[rod]\nlength_m = 0.3\nmass_kg = 1.0\n[slider]\n";
    let scene = SceneSource::parse("scene", &format!("{text}[solver]\nmodel = \"rigid\"\n"), &[]).unwrap().scene;
    let [crank, rod] = scene.chain().unwrap().links.as_slice() else { panic!("two links") };
    assert_eq!((crank.centre_of_mass_m, crank.inertia_kg_m2), (0.0, 0.5));
    assert!((rod.inertia_kg_m2 - 0.09 / 12.0).abs() < 1e-15, "a uniform bar unless said otherwise");
    assert!(refused(text).contains("only for a rigid link"), "a flexible link needs a section");
    let both = text.replace("mass_kg = 1.0", "mass_kg = 1.0\nrigid = true\narea_m2 = 1.0");
    assert!(refused(&both.replace("mass_kg = 2.0", "mass_kg = 2.0\nrigid = true")).contains("not both"));
}

/// The keys that a refusal names as known, after an unknown key was set in a table.
fn known(given: &str) -> BTreeSet<String> {
    let refused = SceneSource::open("crank-slider", &[given.to_owned()]).unwrap_err().to_string();
    let (_, names) = refused.split_once("(known here: ").expect(&refused);
    names.trim_end_matches(')').split(", ").map(str::to_owned).collect()
}

#[test]
fn prop_the_reference_has_every_key_that_the_parser_knows_and_no_other() {
    const TABLES: [(&str, &str); 15] = [
        ("[crank], [rod] or [beam]", "rod.nosuch=1"),
        ("section", "rod.section.nosuch=1"),
        ("[slider]", "slider.nosuch=1"),
        ("[tip]", "tip.nosuch=1"),
        ("[base]", "base.nosuch=1"),
        ("[gravity]", "gravity.nosuch=1"),
        ("[start]", "start.nosuch=1"),
        ("[drive]", "drive.nosuch=1"),
        ("ramp", "drive.ramp.nosuch=1"),
        ("[[pulse]]", "pulse.0.nosuch=1"),
        ("[torque]", "torque.nosuch=1"),
        ("[commands]", "commands.nosuch=1"),
        ("[oscillator]", "oscillator.nosuch=1"),
        ("[solver]", "solver.nosuch=1"),
        ("[[level]]", "level=[{name='good', nosuch=1}]"),
    ];
    let rows = scene::reference();
    for (table, given) in TABLES {
        let listed: BTreeSet<String> = rows.iter().filter(|row| row.table == table).map(|row| row.key.to_owned()).collect();
        assert_eq!(listed, known(given), "{table}");
    }
    let tables: BTreeSet<&str> = rows.iter().map(|row| row.table).collect();
    assert_eq!(tables, TABLES.iter().map(|(table, _)| *table).collect());
}

#[test]
fn prop_the_guide_has_the_reference_as_the_validation_has_it() {
    let chapter = guide::find("scenes").unwrap().text;
    let (_, rest) = chapter.split_once("<!-- keys: begin").and_then(|(_, rest)| rest.split_once("-->\n")).unwrap();
    let (table, _) = rest.split_once("<!-- keys: end").unwrap();
    assert_eq!(
        table.trim(),
        scene::reference_markdown().trim(),
        "src/guide/scenes.md: put `flexcrank scenes --keys --markdown` there"
    );
}

#[test]
fn val_the_scene_in_the_guide_runs() {
    let chapter = guide::find("scenes").unwrap().text;
    let text = chapter.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let mut simulation = Simulation::new(&SceneSource::parse("guide", text, &[]).unwrap().scene).unwrap();
    (0..4000).for_each(|_| simulation.step().unwrap());
    assert_eq!(simulation.energy_verdict(), EnergyVerdict::Balanced);
    assert!(simulation.observe().unwrap().links.iter().all(|link| link.nodes.len() > 2), "pictures show bending");
}

fn changed(overrides: &[&str]) -> String {
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    match SceneSource::open("crank-slider", &overrides) {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn regress_overrides_of_lists_are_refused_in_words() {
    for (given, expected) in [
        ("pulse.0=1", "pulse.0 is a table: set one of its keys"),
        ("pulse.3.torque_nm=5", "`pulse` has entries 0 to 0, and none numbered 3"),
        ("nosuch.0.key=1", "--set nosuch.0.key=1: nosuch: unknown key (known here: crank, "),
        ("pulses.0.torque_nm=5", "pulses: unknown key; did you mean `pulse`?"),
        ("levels.0.name=x", "levels: unknown key; did you mean `level`?"),
        ("level.0.name=x", "`level` has no entries; give all of them, as in 'level=[{ … }]'"),
        ("crank.0=5", "crank: must be a table"),
        ("crank=1", "crank = 1: must be a table"),
        ("rod.elements=\"four\"", "must be a whole number"),
        ("rod.axial=1", "must be true or false"),
        ("rod.elements=1.5", "must be a whole number"),
        (&format!("{}=1", vec!["a"; 20_000].join(".")), "no key has more than 16 parts"),
    ] {
        let said = changed(&[given]);
        assert!(said.contains(expected) && said.len() < 600, "{}: {said}", &given[..given.len().min(50)]);
    }
    assert_eq!(changed(&["pulse.0.torque_nm=5"]), "accepted");
}

#[test]
fn regress_refusals_escape_control_characters_and_cut_long_values() {
    let said = refused(&with("length_m = 0.5", "\"\\u001b[31mred\" = 1\nlength_m = 0.5"));
    assert!(said.contains("\\u{1b}[31mred") && !said.contains('\u{1b}'), "{said}");
    let said = refused(&with("length_m = 0.5", &format!("length_m = \"{}\"", "x".repeat(1_000_000))));
    assert!(said.len() < 1000 && said.contains("… (1000002 characters)"), "{} characters", said.len());
}

#[test]
fn regress_start_and_drive_that_contradict_each_other_are_refused() {
    let drive = |more: &[&str]| changed(&[&["pulse=[]"], more].concat());
    let said = drive(&["drive.speed_rad_per_s=5", "start.rate_rad_per_s=4"]);
    assert!(said.contains("start.rate_rad_per_s = 4: contradicts drive.speed_rad_per_s = 5.0"), "{said}");
    assert_eq!(drive(&["drive.speed_rad_per_s=5", "start.rate_rad_per_s=5", "start.angle_rad=1"]), "accepted");
    assert_eq!(drive(&["drive.ramp={to_rad_per_s=5.0, over_s=1.0}", "start.rate_rad_per_s=4"]), "accepted");
    let said = drive(&["drive.table=[[0.0, 0.0], [1.0, 2.0]]", "start.angle_rad=1"]);
    assert!(said.contains("start.angle_rad = 1: drive.table prescribes angle and rate"), "{said}");
}

#[test]
fn regress_files_that_are_no_scenes_are_refused_with_a_remedy() {
    let open = |file: &str| SceneSource::open(file, &[]).err().map(|error| error.to_string()).unwrap_or_default();
    let said = open("recordings/sample-three-pulses.mcap");
    assert!(said.contains("is a recording, not a scene") && said.contains("flexcrank replay"), "{said}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, b"[crank]\nlength_m = \xff\n").unwrap();
    let said = open(file.to_str().unwrap());
    assert!(said.contains("scene.toml:2: not text in UTF-8; a scene is a TOML file"), "{said}");
}

/// All refusals of the default scene with some lines replaced, a line each.
fn all_refused(lines: &[(&str, &str)]) -> Vec<String> {
    let text = builtin::find("crank-slider").unwrap().text.to_owned();
    let text = lines.iter().fold(text, |text, &(line, instead)| text.replacen(line, instead, 1));
    let refused = SceneSource::parse("scene.toml", &text, &[]).unwrap_err();
    refused.in_full().lines().map(str::to_owned).collect()
}

fn assert_lines(said: &[String], expected: &[&str]) {
    assert_eq!(said.len(), expected.len(), "{said:?}");
    said.iter().zip(expected).for_each(|(said, expected)| assert!(said.contains(expected), "{expected} in {said}"));
}

#[test]
fn regress_every_independent_mistake_is_refused_in_one_call() {
    let names = all_refused(&[
        ("length_m = 0.5", "lenght_m = 0.5"),
        ("length_m = 1.5", "lenght_m = 1.5"),
        ("mass_kg = 0.2", "mass_kg = \"heavy\""),
        ("[solver]", "[silder]\nmas_kg = 1.0\n[solver]"),
    ]);
    let expected = [
        "scene.toml:5: crank.lenght_m = 0.5: unknown key; did you mean `length_m`?",
        "scene.toml:15: rod.lenght_m = 1.5: unknown key; did you mean `length_m`?",
        "scene.toml:25: slider.mass_kg = \"heavy\": must be a number",
        "scene.toml:34: silder: unknown key; did you mean `slider`?",
    ];
    assert_lines(&names, &expected);
    let values = all_refused(&[
        (
            "length_m = 0.5\nsection = { shape = \"rectangle\", width_m = 0.01",
            "section = { shape = \"rectangle\", width_m = -1.0",
        ),
        ("length_m = 1.5", "length_m = 1e7"),
        ("mass_kg = 0.2", "mass_kg = -1"),
        ("torque_nm = 20.0\n", ""),
        ("\"raised-cosine\"", "\"cosine\""),
        ("\"esdirk\"", "\"euler\""),
    ]);
    let expected = [
        "scene.toml:4: crank: missing key `length_m`",
        "scene.toml:5: crank.section.width_m = -1.0: must be a number from 1e-9 to 1000",
        "scene.toml:14: rod.length_m = 1e7: must be a number from 1e-9 to 1e6",
        "scene.toml:24: slider.mass_kg = -1: must be a number from 0 to 1e9",
        "scene.toml:26: pulse.0: missing key `torque_nm`",
        "scene.toml:29: pulse.0.shape = \"cosine\": must be one of rectangular, raised-cosine",
        "scene.toml:34: solver.integrator = \"euler\": must be one of",
    ];
    assert_lines(&values, &expected);
    let many: String = (0..100).map(|key| format!("key{key} = 1\n")).collect();
    assert_eq!(all_refused(&[("[slider]\n", format!("[slider]\n{many}").as_str())]).len(), 10, "the longest list");
}

/// A refused mass is not refused again as the moment of inertia that would follow from it.
#[test]
fn regress_what_follows_from_a_refused_value_is_not_refused_too() {
    let link = "[crank]\nlength_m = 1.0\nmass_kg = -2.0\n[rod]\nlength_m = 1.5\nmass_kg = 1.0\n";
    let text = format!("{link}[slider]\n[solver]\nmodel = \"rigid\"\n");
    let refused = SceneSource::parse("scene.toml", &text, &[]).unwrap_err();
    assert_eq!(refused.in_full(), "scene.toml:3: crank.mass_kg = -2.0: must be a number from 0 to 1e9");
}

#[test]
fn regress_a_refused_override_names_the_option_and_a_remedy() {
    for (given, expected) in [
        ("foo.bar=1", "--set foo.bar=1: foo: unknown key"),
        ("drive.ramp.over_s=1", "--set drive.ramp.over_s=1: "),
        ("pulse=[{start_s=0.0, torque_nm=inf, duration_s=1.0}]", "duration_s=1.0}]: pulse.0.torque_nm = inf: must be a number"),
        ("gravity.y=-9.81", "gravity.y = -9.81: unknown key; did you mean `y_m_per_s2`?"),
        ("gravity=-9.81", "gravity = -9.81: must be a table (known here: x_m_per_s2, y_m_per_s2)"),
        ("pulse.torque_nm=1", "`pulse` is a list: number the entry, as in pulse.0.torque_nm"),
        ("crank.length_m=0,15", "not TOML: a number has a decimal point, not a comma: 0.15"),
    ] {
        let said = changed(&[given]);
        assert!(said.contains(expected), "{given}: {said}");
    }
    for (line, instead, expected) in [
        ("mass_kg = 0.2", "mass_kg = 0,2", "scene.toml:25: not TOML: a number has a decimal point, not a comma: 0.2"),
        ("width_m = 0.01", "width_m = 0,01", "scene.toml:6: not TOML: a number has a decimal point, not a comma: 0.01"),
        ("[[pulse]]", "[pulse]", "scene.toml:27: pulse: must be a list, each entry in a table [[pulse]]"),
        ("[[pulse]]", "[pulse]\n[pulse]", "scene.toml:28: not TOML: [pulse] is there twice: each entry of a list is a table"),
    ] {
        assert!(refused(&with(line, instead)).starts_with(expected), "{}", refused(&with(line, instead)));
    }
}

#[test]
fn regress_a_number_with_its_unit_is_refused_in_files_as_in_overrides() {
    for value in ["0.42 m  # measured", "0.42m", "210 GPa", "210GPa", "2.1e11 Pa", "{ shape = 'round', diameter_m = 8 mm }"] {
        let number =
            value.split_once("m = ").map_or(value, |(_, number)| number).trim_end_matches("  # measured").trim_end_matches(" }");
        let problem = format!("not TOML: `{number}`: write the number alone, as its key names the unit");
        assert_eq!(refused(&with("length_m = 0.5", &format!("length_m = {value}"))), format!("scene.toml:5: {problem}"));
        assert_eq!(changed(&[&format!("rod.length_m={value}")]), format!("--set rod.length_m={value}: {problem}"));
    }
    assert!(refused(&with("= \"modal\"", "= modal")).contains("must be quoted"));
}

#[test]
fn regress_a_misspelt_shape_or_required_key_hides_no_other_mistake() {
    let level = ("[solver]", "[[level]]\nnam = 1\n[solver]");
    let said = all_refused(&[("\"rectangle", "\"rectangel"), ("mass_kg", "mas_kg"), ("start_s", "begin_s"), level]);
    let expected = [
        "scene.toml:6: crank.section.shape = \"rectangel\": unknown value; did you mean `rectangle`?",
        "scene.toml:25: slider.mas_kg = 0.2: unknown key",
        "scene.toml:28: pulse.0.begin_s = 0.0: unknown key",
        "scene.toml:35: level.0.nam = 1: unknown key",
    ];
    assert_lines(&said, &expected);
}

#[test]
fn regress_a_refused_key_of_a_section_is_named() {
    for (given, expected) in [
        ("width_mm=12", "width_mm = 12: unknown key; did you mean `width_m`? (known here: shape, width_m, "),
        ("inner_m=0.01", "inner_m = 0.01: this shape has only width_m and height_m"),
        ("width_m=\"12 mm\"", "width_m = \"12 mm\": must be a number without its unit"),
        ("shape=3", "shape = 3: must be a word in quotes"),
    ] {
        let said = changed(&[&format!("rod.section.{given}")]);
        assert!(said.starts_with(&format!("--set rod.section.{given}: rod.section.{expected}")), "{said}");
    }
}
