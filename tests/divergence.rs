//! Divergence: a typed error, never a number that is not finite.

mod common;

use std::io::{BufRead as _, BufReader};
use std::net::TcpListener;
use std::process::{Command, Stdio};

use common::Outcome;
use flexcrank::scene::SceneSource;
use flexcrank::simulation::{Cause, Diverged, Simulation};
use flexcrank::wire::Status;

/// Steps until the end of time or until it diverges; every observation on the way must be finite.
fn run(scene: &str, overrides: &[&str], steps: u64) -> Result<Result<Simulation, Diverged>, Box<dyn std::error::Error>> {
    let overrides: Vec<String> = overrides.iter().map(|&o| o.to_owned()).collect();
    let mut simulation = Simulation::new(&SceneSource::open(scene, &overrides)?.scene)?;
    for _ in 0..steps {
        let seen = simulation.step().and_then(|()| simulation.observe().cloned());
        match seen {
            Err(diverged) => {
                let ledger = simulation.ledger();
                let numbers = [ledger.energy.kinetic_j, ledger.work_in_j, ledger.dissipated_j, ledger.balance_error_j];
                assert!(numbers.iter().all(|number| number.is_finite()), "the last good state stays: {ledger:?}");
                return Ok(Err(diverged));
            }
            Ok(seen) => {
                let nodes = seen.links.iter().flat_map(|link| &link.nodes);
                assert!(nodes.flat_map(|node| node.position_m).all(f64::is_finite));
            }
        }
    }
    Ok(Ok(simulation))
}

#[test]
fn prop_an_unstable_weight_is_declared_diverged_by_its_energy() -> Result<(), Box<dyn std::error::Error>> {
    let outcome = run("thesis-two-masses-stiff", &["solver.weight=0.3"], 10_000)?;
    let diverged = outcome.err().ok_or("ϑ = 0.3 must not be stable at ωh = 7")?;
    assert!(matches!(diverged.cause, Cause::EnergyGrew { .. }), "{diverged}");
    assert!(diverged.to_string().contains("over 2 times"), "{diverged}");
    Ok(())
}

/// A pendulum that falls from beside the vertical, with a scheme that blows up slowly: both energies of the message are kinetic and
/// strain energy, of states one step apart. What is in play fell in gravity: `(m/2 + M) g L (1 − cos 1)`.
#[test]
fn regress_a_divergence_compares_energies_of_one_kind() -> Result<(), Box<dyn std::error::Error>> {
    let scene = r#"
        [beam]
        length_m = 0.8
        section = { shape = "rectangle", width_m = 0.03, height_m = 0.003 }
        density_kg_per_m3 = 2700.0
        youngs_modulus_pa = 7.0e10
        elements = 8
        [tip]
        mass_kg = 0.25
        [gravity]
        y_m_per_s2 = -9.81
        [start]
        angle_rad = -0.570796326794897
        [solver]
        model = "finite-element"
        integrator = "two-point"
        step_s = 0.005
    "#;
    let mut simulation = Simulation::new(&SceneSource::parse("pendulum.toml", scene, &[])?.scene)?;
    let diverged = (0..4_000).find_map(|_| simulation.step().err()).ok_or("this scheme blows up at this step")?;
    let before_j = simulation.ledger().energy.moving_j();
    let Cause::EnergyGrew { energy_j, accounted_j, .. } = diverged.cause else { return Err(diverged.to_string().into()) };
    assert_eq!(diverged.energy_j, before_j);
    assert!(energy_j > before_j && energy_j < 1.1 * before_j, "slowly: from {before_j} to {energy_j} J");
    let mass_kg = 0.8 * 0.03 * 0.003 * 2700.0;
    let fallen_j = (mass_kg / 2.0 + 0.25) * 9.81 * 0.8 * (1.0 - f64::cos(1.0));
    assert!((accounted_j / fallen_j - 1.0).abs() < 1e-3, "{accounted_j} J for {fallen_j} J");
    let says = "J in play (there at the start, fallen in gravity, or put in)";
    assert!(diverged.to_string().ends_with(says), "{diverged}");
    Ok(())
}

#[test]
fn prop_an_explicit_scheme_beyond_its_limit_is_refused() {
    let given = ["solver.model=modal", "solver.integrator=runge-kutta", "solver.step_s=0.01"];
    let refused = run("ref-r2s", &given, 2_000).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(refused.contains("beyond the stability limit"), "Runge–Kutta at a hundred times its limit: {refused}");
}

#[test]
fn prop_an_explicit_scheme_that_meets_its_limit_on_the_way_is_declared_diverged() -> Result<(), Box<dyn std::error::Error>> {
    // At the dead centre, where it starts, the slider stands still and its friction is not felt.
    let given =
        ["solver.model=rigid", "solver.integrator=runge-kutta", "slider.friction_n_s_per_m=1e4", "torque.constant_nm=2000.0"];
    assert!(run("crank-slider", &given, 2_000)?.is_err(), "friction far too strong for the step");
    Ok(())
}

/// An arm that rests until a pulse begins, stepped near the limit of the explicit scheme: the first step of the pulse errs by far more
/// than its energy of a microjoule, and the motion is right. The energies that a message names can be compared.
#[test]
fn regress_a_load_that_begins_from_rest_is_no_divergence() -> Result<(), Box<dyn std::error::Error>> {
    let scene = r#"
        [beam]
        length_m = 0.8
        section = { shape = "rectangle", width_m = 0.03, height_m = 0.004 }
        density_kg_per_m3 = 2700.0
        youngs_modulus_pa = 7.0e10
        elements = 8
        modes = 1
        damping_s = 2e-4
        [tip]
        mass_kg = 0.15
        [base]
        torsion_spring_nm_per_rad = 4.0
        damper_nm_s_per_rad = 0.3
        [[pulse]]
        start_s = 0.2
        torque_nm = 3.0
        duration_s = 0.3
        shape = "raised-cosine"
        [solver]
        model = "modal"
        integrator = "runge-kutta"
        step_s = 0.004
    "#;
    let angle = |overrides: &[String]| -> Result<f64, Box<dyn std::error::Error>> {
        let mut simulation = Simulation::new(&SceneSource::parse("arm.toml", scene, overrides)?.scene)?;
        while simulation.time_s() < 2.0 - 1e-9 {
            simulation.step()?;
        }
        Ok(simulation.observe()?.links[0].chord_rad)
    };
    let fine = angle(&["solver.integrator=esdirk".to_owned(), "solver.step_s=0.001".to_owned()])?;
    for step_s in ["0.004", "0.002"] {
        let coarse = angle(&[format!("solver.step_s={step_s}")])?;
        assert!((coarse - fine).abs() < 1e-3 * fine.abs(), "{step_s} s: {coarse} for {fine}");
    }
    let tiny = Diverged {
        step: 1,
        sim_time_s: 0.0,
        energy_j: 0.0,
        cause: Cause::Dissipated { dissipated_j: 2.7e-6, accounted_j: 4e-7 },
    };
    assert!(
        tiny.to_string().ends_with(
            "this step dissipated 2.70e-6 J, with 4.00e-7 J in play (there at the start, fallen in gravity, or put in)"
        ),
        "{tiny}"
    );
    Ok(())
}

/// A rigid chain whose motion is prescribed has no unknowns, so that nothing can diverge.
#[test]
fn regress_a_prescribed_motion_that_begins_from_rest_is_no_divergence() -> Result<(), Box<dyn std::error::Error>> {
    let ramp =
        ["pulse=[]", "drive={ramp={to_rad_per_s=60,over_s=0.4}}", "slider.resistance_n=400", "slider.friction_n_s_per_m=15"];
    let rigid = [&ramp[..], &["solver.model=rigid", "solver.integrator=two-point", "solver.step_s=0.005"]].concat();
    assert!(run("crank-slider", &rigid, 200)?.is_ok(), "no unknowns");
    Ok(())
}

#[test]
fn prop_a_dissipative_scheme_is_not_diverged() -> Result<(), Box<dyn std::error::Error>> {
    for (scene, overrides) in [
        ("thesis-crank-slider", &[][..]),
        ("thesis-two-masses-stiff", &["solver.weight=1.0"]),
        ("crank-slider", &["solver.rho_infinity=0.0"]),
        ("crank-slider", &["gravity.y_m_per_s2=-9.81", "slider.friction_n_s_per_m=5.0", "rod.damping_s=1e-4"]),
    ] {
        if let Err(diverged) = run(scene, overrides, 3_000)? {
            return Err(format!("{scene} {overrides:?}: {diverged}").into());
        }
    }
    Ok(())
}

#[test]
fn prop_a_failing_step_is_taken_in_halves_and_counted() -> Result<(), Box<dyn std::error::Error>> {
    let hard = ["solver.integrator=two-point", "solver.weight=0.5", "solver.step_s=0.002", "solver.max_iterations=6"];
    let simulation = run("ref-r2", &hard, 200)??;
    assert!(simulation.retried() > 0, "some step fails at first with six iterations");
    assert_eq!(simulation.step_count(), 200);
    Ok(())
}

/// Runs that diverge by their energy, by a step that fails, and one that ends with its energy off: what they end with does not depend on
/// how often a sample is taken.
#[test]
fn prop_the_verdict_is_the_same_at_every_publishing_rate() -> Result<(), Box<dyn std::error::Error>> {
    let cases: [(i32, &str, &str, &[&str]); 3] = [
        (4, "thesis-crank-slider", "22.8", &["solver.weight=0.48"]),
        (4, "crank-slider", "5", &["pulse.0.torque_nm=1e9"]),
        (6, "crank-slider", "100", &["solver.step_s=0.1"]),
    ];
    for (expected, scene, until_s, overrides) in cases {
        let ended = |rate: &str| -> Result<_, Box<dyn std::error::Error>> {
            let (folder, run) = (tempfile::tempdir()?, ["run", scene, "--no-bus", "--no-realtime", "--pace", "max"]);
            let given = overrides.iter().flat_map(|&given| ["--set", given]);
            let ran = Command::new(env!("CARGO_BIN_EXE_flexcrank"))
                .args(run)
                .args(["--until", until_s, "--publish-hz", rate, "--record", "run.mcap"])
                .args(given)
                .current_dir(folder.path())
                .output()?;
            let said = String::from_utf8(ran.stderr)?;
            // A warning on the way depends on when its status was due.
            let verdict = said.lines().rfind(|line| line.starts_with("error") || line.starts_with("warning"));
            let verdict = verdict.ok_or_else(|| said.clone())?.to_owned();
            let last = common::decoded::<Status>(&folder.path().join("run.mcap"), "status")?.pop().ok_or("no status")?;
            assert_eq!(ran.status.code(), Some(expected), "{scene} at {rate}: {said}");
            assert!(verdict.contains(&last.message), "{scene} at {rate}: {} and {verdict}", last.message);
            let step = last.stamp.map(|stamp| stamp.step);
            let energies = [last.kinetic_j, last.work_in_j, last.dissipated_j, last.worst_balance_j];
            Ok((verdict, last.message, last.state, step, energies.map(|energy| energy.map(f64::to_bits))))
        };
        assert_eq!(ended("0.5")?, ended("all")?, "{scene} {overrides:?}");
    }
    Ok(())
}

/// `check` and `trade` know nothing of what came over the bus.
#[test]
fn regress_a_divergence_after_commands_says_that_the_remedy_is_for_the_scene_without_them() -> Outcome {
    let endpoint = format!("tcp/{}", TcpListener::bind("127.0.0.1:0")?.local_addr()?);
    let flexcrank = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        command.args(words).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let run =
        ["run", "--name", "softened", "--listen", &endpoint, "--no-record", "--until", "100", "--set", "solver.step_s=0.002"];
    let mut child = flexcrank(&run).spawn()?;
    let mut lines = BufReader::new(child.stderr.take().ok_or("no standard error")?).lines().map_while(Result::ok);
    lines.find(|line| line.contains(&endpoint)).ok_or("no start line")?;
    let pulse = ["pulse", "softened", "--torque", "50", "--duration", "90s", "--connect", &endpoint];
    assert!(flexcrank(&pulse).output()?.status.success());
    let said: Vec<String> = lines.collect();
    let ended = child.wait()?;
    assert_eq!(ended.code(), Some(4), "{said:?}");
    let last = "that holds for the scene as it began, without the commands that this session accepted";
    assert_eq!(said.last().map(String::as_str), Some(last), "{said:?}");
    Ok(())
}

/// An arm that hangs at rest, but for its weight, which begins to stretch it. `check` called it sound, and `run` said until the pulse that
/// it is not to be trusted.
#[test]
fn regress_check_tells_of_a_run_that_is_not_to_be_trusted_at_first() -> Outcome {
    const ARM: &str = "[crank]\nlength_m = 0.35\nsection = { shape = \"tube\", outer_m = 0.025, inner_m = 0.021 }\n\
                       density_kg_per_m3 = 2700.0\nyoungs_modulus_pa = 7.0e10\nelements = 4\ndamping_s = 2e-5\n\
                       [rod]\nlength_m = 0.3\nsection = { shape = \"tube\", outer_m = 0.018, inner_m = 0.015 }\naxial = true\n\
                       density_kg_per_m3 = 2700.0\nyoungs_modulus_pa = 7.0e10\nelements = 4\ndamping_s = 2e-5\n\
                       [tip]\nmass_kg = 0.25\n[base]\ntorsion_spring_nm_per_rad = 40.0\ndamper_nm_s_per_rad = 0.05\n\
                       [gravity]\nx_m_per_s2 = 9.81\n[solver]\nstep_s = 5e-4\n\
                       [[pulse]]\nstart_s = 0.5\ntorque_nm = 4.0\nduration_s = 0.05\nshape = \"raised-cosine\"\n";
    let folder = tempfile::tempdir()?;
    let scene = folder.path().join("arm.toml");
    std::fs::write(&scene, ARM)?;
    let of = |command: &[&str], more: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_flexcrank")).args(command).arg(&scene).args(more).output()
    };
    let fine = "solver.step_s=2e-5";
    for (set, is_told) in [("solver.step_s=5e-4", true), (fine, false)] {
        let checked = of(&["check"], &["--set", set])?;
        let said = String::from_utf8(checked.stderr)?;
        assert_eq!(checked.status.code(), Some(0), "{set}: {said}");
        assert_eq!(said.contains("not to be trusted") && said.contains("by t = 0.5 s"), is_told, "{set}: {said}");
        let run = of(&["run", "--no-bus", "--pace", "max", "--no-record", "--until", "0.5"], &["--set", set])?;
        assert_eq!(run.status.code(), Some(if is_told { 6 } else { 0 }), "{set}");
    }
    Ok(())
}
