//! Changes of a running scene: booked, recorded, and computed again to the bit.

mod common;

use std::collections::HashSet;
use std::path::Path;

use common::{Outcome, Service};
use flexcrank::bus::client;
use flexcrank::resimulation::{AddedPulse, Change, RecordedSession, Resumed, resume, verify, what_if};
use flexcrank::runtime::{Pace, Successor};
use flexcrank::scene::SceneSource;
use flexcrank::simulation::{PublishRate, Simulation};
use flexcrank::wire::control::Action;
use flexcrank::wire::{self, AppliedCommand, CommandReply, Control, TorquePulse};

/// Numbers that look random (Knuth's linear congruence).
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % count
    }

    fn of<'a>(&mut self, words: &[&'a str]) -> &'a str {
        words[self.below(words.len())]
    }

    /// Between two numbers, with three digits.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.below(1001) as f64 / 1000.0
    }

    /// A change of one key or a few that belong together.
    fn change(&mut self) -> Vec<String> {
        let link = self.of(&["crank", "rod"]);
        let one = |key: String, value: String| vec![format!("{key}={value}")];
        match self.below(21) {
            0 => one("slider.mass_kg".into(), self.between(0.05, 0.6).to_string()),
            1 => one(format!("{link}.youngs_modulus_pa"), format!("{:e}", self.between(1.0e11, 3.0e11))),
            2 => one(format!("{link}.density_kg_per_m3"), self.between(5000.0, 9000.0).to_string()),
            3 => one(format!("{link}.damping_s"), format!("{:e}", self.between(0.5e-4, 3e-4))),
            4 => one("slider.friction_n_s_per_m".into(), self.between(0.0, 0.5).to_string()),
            5 => one("slider.resistance_n".into(), self.between(-0.5, 0.5).to_string()),
            6 => one("gravity.y_m_per_s2".into(), self.between(-9.81, 0.0).to_string()),
            7 => one("gravity.x_m_per_s2".into(), self.between(-1.0, 1.0).to_string()),
            8 => one("torque.constant_nm".into(), self.between(-0.3, 0.3).to_string()),
            9 => one("base.damper_nm_s_per_rad".into(), self.between(0.0, 0.02).to_string()),
            10 => one("commands.torque_limit_nm".into(), self.between(5.0, 50.0).to_string()),
            11 => one(format!("{link}.modes"), (1 + self.below(8)).to_string()),
            12 => one(format!("{link}.axial"), self.of(&["true", "false"]).into()),
            13 => one(format!("{link}.elements"), self.of(&["2", "3", "4", "8", "16", "32"]).into()),
            14 => one(format!("{link}.rigid"), self.of(&["true", "false"]).into()),
            15 => one("solver.step_s".into(), self.of(&["5e-4", "1e-3", "2e-3"]).into()),
            16 => one("solver.tolerance".into(), self.of(&["1e-9", "1e-10", "1e-8"]).into()),
            17 => one("start.angle_rad".into(), self.between(0.0, 3.0).to_string()),
            18 => one("solver.balance_tolerance".into(), self.of(&["1e-2", "5e-2"]).into()),
            _ => {
                let [model, integrator] = [
                    ["rigid", "esdirk"],
                    ["rigid", "runge-kutta"],
                    ["modal", "esdirk"],
                    ["finite-element", "esdirk"],
                    ["modal", "esdirk"],
                ][self.below(5)];
                vec![format!("solver.model={model}"), format!("solver.integrator={integrator}")]
            }
        }
    }
}

/// The default scene, pushed, after half a second.
fn lively() -> Result<(SceneSource, Simulation), Box<dyn std::error::Error>> {
    let source = SceneSource::open("crank-slider", &[])?;
    let mut simulation = Simulation::new(&source.scene)?;
    while simulation.time_s() < 0.5 {
        simulation.step()?;
    }
    Ok((source, simulation))
}

fn changed(source: &mut SceneSource, simulation: &mut Simulation, changes: &[&str]) -> Result<f64, Box<dyn std::error::Error>> {
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    let after = source.changed(&changes)?;
    let changed_j = Successor::new(source, &after)?.replace(simulation)?;
    *source = after;
    Ok(changed_j)
}

#[test]
fn regress_a_change_that_changes_no_equation_changes_no_bit() -> Outcome {
    let (mut source, mut simulation) = lively()?;
    let (_, mut straight) = lively()?;
    let same = ["commands.torque_limit_nm=3.0", "solver.balance_tolerance=5e-2", "start.angle_rad=1.0"];
    assert_eq!(changed(&mut source, &mut simulation, &same)?, 0.0);
    for _ in 0..100 {
        simulation.step()?;
        straight.step()?;
    }
    assert_eq!(simulation.checkpoint().state, straight.checkpoint().state);
    assert_eq!(simulation.observe()?, straight.observe()?);
    Ok(())
}

/// A mass that joins the slider at its speed v brings in ½ Δm v².
#[test]
fn val_a_mass_that_joins_brings_its_energy_along() -> Outcome {
    let (mut source, mut simulation) = lively()?;
    let speed = simulation.observe()?.links[1].nodes.last().ok_or("no nodes")?.velocity_m_per_s[0];
    let before = simulation.ledger();
    let changed_j = changed(&mut source, &mut simulation, &["slider.mass_kg=0.5"])?;
    assert!((changed_j - 0.5 * 0.3 * speed * speed).abs() < 1e-12 * before.in_play_j, "{changed_j}");
    let after = simulation.ledger();
    assert!((after.energy.kinetic_j - before.energy.kinetic_j - changed_j).abs() < 1e-12 * before.in_play_j);
    assert!((after.balance_error_j - before.balance_error_j).abs() < 1e-13 * before.in_play_j);
    Ok(())
}

#[test]
fn prop_a_longer_step_waits_for_a_common_instant() -> Outcome {
    let (mut source, mut simulation) = lively()?;
    simulation.step()?;
    let refused = changed(&mut source, &mut simulation, &["solver.step_s=4e-3"]).err().map(|error| error.to_string());
    assert_eq!(refused.as_deref(), Some("the new step begins at a common instant of both, 1 steps from here"));
    simulation.step()?;
    changed(&mut source, &mut simulation, &["solver.step_s=4e-3"])?;
    let (step, time_s) = (simulation.step_count(), simulation.time_s());
    simulation.step()?;
    assert_eq!((simulation.step_count(), simulation.time_s()), (step + 1, time_s + 4e-3));
    Ok(())
}

/// The crank goes on from its angle when its prescribed speed changes.
#[test]
fn prop_a_prescribed_speed_changes_without_a_jump() -> Outcome {
    let mut source = SceneSource::open("crank-slider", &["pulse=[]".to_owned(), "drive.speed_rad_per_s=10.0".to_owned()])
        .or_else(|_| SceneSource::open("ref-r4m", &[]))?;
    if source.scene.chain().is_none_or(|chain| chain.links.len() < 2) {
        return Err("no driven crank-slider".into());
    }
    let mut simulation = Simulation::new(&source.scene)?;
    for _ in 0..100 {
        simulation.step()?;
    }
    let tangent = |simulation: &mut Simulation| -> Result<f64, Box<dyn std::error::Error>> {
        Ok(simulation.observe()?.links[0].nodes[0].rotation_rad.ok_or("no rotation")?)
    };
    let before = tangent(&mut simulation)?;
    changed(&mut source, &mut simulation, &["drive.speed_rad_per_s=-4.0"])?;
    assert!((tangent(&mut simulation)? - before).abs() < 1e-12);
    let at = simulation.checkpoint();
    for _ in 0..100 {
        simulation.step()?;
    }
    assert!((tangent(&mut simulation)? - (before - 0.8)).abs() < 1e-12);
    let end = simulation.checkpoint();
    let mut again = Simulation::new(&source.scene)?;
    assert!(again.restore(&at));
    for _ in 0..100 {
        again.step()?;
    }
    assert_eq!(again.checkpoint(), end);
    Ok(())
}

/// Switches where the mechanism is fast, strongly bent or next to a dead centre: no step fails at first, no number is not finite.
#[test]
fn prop_switches_at_extreme_states_leave_finite_states() -> Outcome {
    let models = [
        vec!["solver.model=rigid", "solver.integrator=runge-kutta"],
        vec!["solver.model=modal", "solver.integrator=esdirk"],
        vec!["solver.model=modal", "solver.integrator=esdirk", "rod.modes=1", "crank.rigid=true"],
        vec!["solver.model=modal", "solver.integrator=generalized-alpha", "rod.modes=6"],
        vec!["solver.model=finite-element", "solver.integrator=esdirk", "rod.elements=16", "crank.elements=8"],
        vec!["solver.model=finite-element", "solver.integrator=generalized-alpha", "rod.elements=3", "crank.elements=2"],
    ];
    let (mut switches, mut refused) = (0, 0);
    for torque_nm in [1.0, 20.0, 60.0, 120.0] {
        // After the pulse; strongly bent; at the dead centres.
        for from in &models {
            let mut keys: Vec<String> = from.iter().map(|key| (*key).to_owned()).collect();
            keys.push(format!("pulse.0.torque_nm={torque_nm}"));
            let source = SceneSource::open("crank-slider", &keys)?;
            let mut simulation = Simulation::new(&source.scene)?;
            for step in 1..=120_u32 {
                if simulation.step().is_err() {
                    break;
                }
                let chord = simulation.observe()?.links[0].chord_rad;
                let near_dead_centre = (chord / std::f64::consts::PI - (chord / std::f64::consts::PI).round()).abs() < 0.02;
                if step % 20 != 0 && !near_dead_centre {
                    continue;
                }
                for to in &models {
                    let changes: Vec<String> = to.iter().map(|key| (*key).to_owned()).collect();
                    let after = source.changed(&changes)?;
                    let mut other = Simulation::new(&source.scene)?;
                    assert!(other.restore(&simulation.checkpoint()));
                    switches += 1;
                    if Successor::new(&source, &after)?.replace(&mut other).is_err() {
                        refused += 1;
                        continue;
                    }
                    assert!(
                        other.checkpoint().state.iter().all(|number| number.is_finite()),
                        "{from:?} to {to:?} in step {step}"
                    );
                    for _ in 0..5 {
                        if other.step().is_err() {
                            refused += 1;
                            break;
                        }
                        assert!(other.observe()?.is_finite() && other.ledger().energy.total_j().is_finite());
                    }
                }
            }
        }
    }
    assert!(switches > 1000 && 50 * refused < switches, "{refused} of {switches} are refused or diverge");
    Ok(())
}

/// Whatever is changed, the balance of energy stays as closed as it was, and a checkpoint goes on to the bit.
#[test]
fn prop_random_changes_keep_the_balance_and_go_on_from_their_checkpoints() -> Outcome {
    let (mut source, mut simulation) = lively()?;
    let mut random = Random(7);
    let (mut done, mut refused) = (0, 0);
    while done < 150 {
        let changes = random.change();
        let after = source.changed(&changes).ok();
        let successor = after.and_then(|after| Some((Successor::new(&source, &after).ok()?, after)));
        let Some((mut successor, after)) = successor else {
            refused += 1;
            continue;
        };
        let before = simulation.ledger();
        match successor.replace(&mut simulation) {
            Ok(_) => {}
            Err(flexcrank::simulation::NotChanged::Later(_)) => {
                simulation.step()?;
                continue;
            }
            Err(other) => return Err(format!("{changes:?}: {other}").into()),
        }
        source = after;
        let after = simulation.ledger();
        let moved_j = after.balance_error_j - before.balance_error_j;
        assert!(moved_j.abs() <= 1e-12 * after.in_play_j, "{changes:?}: {moved_j} J");
        let checkpoint = simulation.checkpoint();
        let mut again = Simulation::new(&source.scene)?;
        assert!(again.restore(&checkpoint), "{changes:?}");
        for _ in 0..10 {
            simulation.step().map_err(|diverged| format!("after {changes:?}: {diverged}\n{}", source.text))?;
            again.step()?;
        }
        assert!(again.checkpoint() == simulation.checkpoint(), "{changes:?} differ in\n{}", source.text);
        assert!(again.observe()? == simulation.observe()?, "{changes:?} differ in\n{}", source.text);
        done += 1;
    }
    assert!(refused < done, "{refused} refused");
    Ok(())
}

fn set(service: &Service, id: &str, changes: Vec<String>) -> Result<CommandReply, Box<dyn std::error::Error>> {
    let control = Control { id: id.to_owned(), action: Some(Action::Set(wire::Set { changes })) };
    Ok(client::control(&service.client, &service.name, &control)?)
}

/// The default scene with three levels.
fn leveled() -> Result<SceneSource, flexcrank::scene::SceneError> {
    let text = flexcrank::scene::builtin::find("crank-slider").map(|scene| scene.text).unwrap_or_default();
    let levels = r#"
[[level]]
name = "good"
error_rad = 1e-3
[[level]]
name = "fair"
error_rad = 1e-2
changes = ["crank.rigid=true", "rod.modes=1", "rod.axial=false", "solver.step_s=4e-3"]
[[level]]
name = "rough"
error_rad = 1e-1
changes = ["solver.model=rigid", "solver.integrator=runge-kutta"]
"#;
    SceneSource::parse("leveled.toml", &format!("{text}{levels}"), &[])
}

#[test]
fn prop_levels_are_switched_by_command_recorded_and_computed_again() -> Outcome {
    let service = Service::start(leveled()?, Pace::Factor(20.0), None, PublishRate::Hz(100.0))?;
    let listener = common::Listener::new(&service.client, &service.name)?;
    let level = |name: &str| -> Result<CommandReply, Box<dyn std::error::Error>> {
        let control = Control { id: String::new(), action: Some(Action::Level(wire::Level { name: name.to_owned() })) };
        Ok(client::control(&service.client, &service.name, &control)?)
    };
    let mut heard = 0;
    for name in ["fair", "rough", "good", "rough", "fair"] {
        let reply = level(name)?;
        assert!(reply.accepted && reply.changed_j.is_some(), "{name}: {reply:?}");
        heard += 100;
        listener.wait_for(flexcrank::bus::Topic::Angles, heard, std::time::Duration::from_secs(60))?;
        assert!(set(&service, "", vec![format!("slider.mass_kg={}", 0.2 + 1e-4 * f64::from(heard as u16))])?.accepted);
    }
    let refused = level("fairr")?;
    assert_eq!((refused.accepted, refused.reason.contains("did you mean `fair`?")), (false, true), "{}", refused.reason);
    assert!(set(&service, "", vec!["level.1.name=other".into()])?.reason.contains("keeps its levels"));
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    let source = RecordedSession::open(&file)?;
    let found = verify(&source, &|_, _| {})?;
    assert_eq!(found.findings, []);
    let angles: Vec<wire::Angles> = common::decoded(&file, "angles")?;
    let stated = |name: &str, error: f64| angles.iter().filter(|a| a.level == name && a.level_error_rad == Some(error)).count();
    assert!(stated("good", 1e-3) > 50 && stated("fair", 1e-2) > 100 && stated("rough", 1e-1) > 100);
    // A session resumes at its level.
    let end = resume(&source, None, &|_| {})?;
    assert_eq!((end.scene.level, end.scene.in_force().map(|level| level.name.as_str())), (1, Some("fair")));
    let outcome = what_if(
        &source,
        &Change { overrides: vec!["slider.mass_kg=0.21".into()], ..Change::default() },
        &file.with_file_name("other.mcap"),
        &|_| {},
    )?;
    assert!(outcome.deviation.first.is_some());
    let found = verify(&RecordedSession::open(&file.with_file_name("other.mcap"))?, &|_, _| {})?;
    assert_eq!(found.findings, []);
    Ok(())
}

/// Changes that wait for a common instant keep their order; a pause refuses them, since the run comes to no other step.
#[test]
fn prop_changes_that_wait_are_applied_in_order_or_refused() -> Outcome {
    let service = Service::start(leveled()?, Pace::Factor(1.0), None, PublishRate::Hz(100.0))?;
    let say = |action: Action| -> Result<CommandReply, Box<dyn std::error::Error>> {
        Ok(client::control(&service.client, &service.name, &Control { id: String::new(), action: Some(action) })?)
    };
    for k in 0..10 {
        let (name, other) = if k % 2 == 0 { ("fair", "good") } else { ("good", "fair") };
        let first = say(Action::Level(wire::Level { name: name.into() }))?;
        let second = set(&service, "", vec![format!("slider.mass_kg={}", 0.2 + 0.01 * f64::from(k))])?;
        assert!(first.accepted && second.accepted && second.effective_step >= first.effective_step, "{name} {other}");
    }
    say(Action::Pause(wire::Pause {}))?;
    // A step of 4 ms can begin at every other step of 2 ms.
    let refused = (0..2).map(|_| {
        say(Action::Level(wire::Level { name: "good".into() }))?;
        say(Action::Step(wire::Steps { count: 1 }))?;
        say(Action::Level(wire::Level { name: "fair".into() })).map(|reply| (reply.accepted, reply.reason))
    });
    let refused: Vec<(bool, String)> = refused.collect::<Result<_, _>>()?;
    assert!(refused.iter().any(|(accepted, reason)| !accepted && reason.contains("1 steps from here")), "{refused:?}");
    let (_, folder) = service.stop()?;
    let found = verify(&RecordedSession::open(&folder.path().join("run.mcap"))?, &|_, _| {})?;
    assert_eq!(found.findings, []);
    Ok(())
}

/// Number of changes in a run; the variable asks for more than CI makes.
fn count() -> usize {
    std::env::var("FLEXCRANK_CHANGES").ok().and_then(|count| count.parse().ok()).unwrap_or(60)
}

#[test]
fn prop_changes_of_a_running_service_are_recorded_and_computed_again() -> Outcome {
    let scene = SceneSource::open("crank-slider", &[])?;
    let service = Service::start(scene, Pace::Max, None, PublishRate::Hz(50.0))?;
    let mut random = Random(11);
    let mut accepted = HashSet::new();
    for k in 0..count() {
        let (id, changes) = (format!("set-{k}"), random.change());
        let reply = set(&service, &id, changes.clone())?;
        if reply.accepted {
            assert!(reply.changed_j.is_some() && accepted.insert(id.clone()), "{reply:?}");
            // A retry is answered, and changes nothing.
            let again = set(&service, &id, changes)?;
            assert_eq!((again.effective_step, again.changed_j), (reply.effective_step, reply.changed_j));
        } else {
            assert!(!reply.reason.is_empty() && reply.changed_j.is_none(), "{changes:?}: {reply:?}");
        }
        if k % 10 == 3 {
            let pulse = TorquePulse { id: format!("pulse-{k}"), torque_nm: 1.0, duration_s: 0.1, ..TorquePulse::default() };
            client::pulse(&service.client, &service.name, &pulse)?;
        }
        if k % 20 == 13 {
            let reset = Control { id: format!("reset-{k}"), action: Some(Action::Reset(wire::Reset {})) };
            assert!(client::control(&service.client, &service.name, &reset)?.accepted);
        }
    }
    assert!(2 * accepted.len() > count(), "{} of {}", accepted.len(), count());
    let (report, folder) = service.stop()?;
    assert_eq!(report.dropped, 0);
    let file = folder.path().join("run.mcap");
    let recorded: Vec<AppliedCommand> = common::decoded(&file, "commands")?;
    let sets: Vec<String> =
        recorded.iter().filter(|c| !c.scene.is_empty()).filter_map(|c| Some(c.reply.as_ref()?.id.clone())).collect();
    assert_eq!((sets.len(), sets.into_iter().collect::<HashSet<_>>()), (accepted.len(), accepted));
    let source = RecordedSession::open(&file)?;
    let found = verify(&source, &|_, _| {})?;
    assert_eq!(found.findings, []);
    goes_on_from_anywhere(&source, &file, &mut random, found.span_s)
}

/// Resuming at an instant, and a what-if from there, give what was recorded.
fn goes_on_from_anywhere(source: &RecordedSession, file: &Path, random: &mut Random, span_s: f64) -> Outcome {
    let angles: Vec<wire::Angles> = common::decoded(file, "angles")?;
    for _ in 0..5 {
        let at_s = random.between(0.05, 0.95) * span_s;
        let Resumed { mut simulation, scene, epoch_start_s, .. } = resume(source, Some(at_s), &|_| {})?;
        // The first sample from there on, unless another command comes before it.
        let now = (simulation.epoch(), simulation.step_count());
        let next = angles.iter().find(|angles| angles.stamp.is_some_and(|stamp| (stamp.epoch, stamp.step) >= now));
        let next = next.ok_or("nothing recorded after it")?;
        let stamp = next.stamp.unwrap_or_default();
        let commands: Vec<AppliedCommand> = common::decoded(file, "commands")?;
        let is_between = |command: &AppliedCommand| {
            let at = command.stamp.map_or((0, 0), |stamp| (stamp.epoch, stamp.step));
            at >= now && at < (stamp.epoch, stamp.step)
        };
        if !commands.iter().any(is_between) && stamp.epoch == now.0 {
            while simulation.step_count() < stamp.step {
                simulation.step()?;
            }
            let seen = simulation.observe()?;
            assert_eq!(seen.links[1].chord_rad.to_bits(), next.links[1].chord_rad.to_bits(), "{at_s} s of {}", scene.source.text);
        }
        let pulse = AddedPulse { start_s: at_s, torque_nm: 0.5, duration_s: 0.05 };
        let change = Change { pulses: vec![pulse], ..Change::default() };
        let path = file.with_file_name(format!("what-if-{at_s}.mcap"));
        let outcome = what_if(source, &change, &path, &|_| {})?;
        let first = outcome.deviation.first.ok_or("the pulse does nothing")?;
        assert!(first.sim_time_s + epoch_start_s >= at_s - 0.03, "it differs at {} s, before {at_s} s", first.sim_time_s);
        let found = verify(&RecordedSession::open(&path)?, &|_, _| {})?;
        assert_eq!(found.findings, [], "{}", path.display());
    }
    Ok(())
}
