use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::time::{Duration, Instant};

use super::*;
use crate::runtime::missed_deadlines::{StepTimings, WakeUp};
use crate::runtime::stepper::{Ports, SteppingOptions};
use crate::runtime::{Command, Ladder, Outbox, Output, Overrun, inbox};
use crate::scene::{PulseShape, SceneAtLevel, SceneSource};
use crate::simulation::{PulseRequest, SetpointRequest};

const LEVELS: &str = r#"
[[level]]
name = "good"
[[level]]
name = "fair"
changes = ["crank.rigid=true", "rod.modes=1", "rod.axial=false"]
[[level]]
name = "rough"
changes = ["solver.model=rigid", "solver.integrator=runge-kutta"]
"#;

const PULSE: PulseRequest = PulseRequest { torque_nm: 0.5, duration_s: 0.1, delay_s: 0.0, shape: PulseShape::RaisedCosine };
const SETPOINT: SetpointRequest = SetpointRequest { torque_nm: 0.7, hold_s: 0.1 };

/// Wall time of a step is 0.2 s, so that a busy machine misses no deadline.
const PACE: f64 = 0.01;

fn source() -> SceneSource {
    let text = crate::scene::builtin::find("crank-slider").unwrap().text;
    SceneSource::parse("levels.toml", &format!("{text}{LEVELS}"), &[]).unwrap()
}

/// A simulation at its best level, and its ladder.
fn at_best() -> (Simulation, Ladder) {
    let scene = SceneAtLevel { base: source(), level: 0, source: source().at_level(0).unwrap() };
    let simulation = Simulation::new(&scene.source.scene).unwrap();
    let ladder = Ladder::of_running(&scene, &simulation).unwrap();
    (simulation, ladder)
}

/// A stepper whose worker takes steps by `take`.
fn stepper(take: TakeStep) -> (Stepper, Receiver<(usize, Output)>) {
    let (simulation, ladder) = at_best();
    let (sender, outputs) = channel();
    let (inbox, commands) = inbox();
    let ports = Ports { commands, output: Outbox::new(sender, 0), pool: sync_channel(1).1, shared: inbox.shared() };
    let stepping =
        SteppingOptions { pace: crate::runtime::Pace::Factor(PACE), overrun: Overrun::Degrade, ..SteppingOptions::default() };
    let mut stepper = Stepper::new(simulation, None, stepping, ports).unwrap().with_ladder(ladder);
    let clock = Instant::now();
    stepper.begin(clock, (0, 1));
    stepper.start(Duration::ZERO);
    stepper.levels.spare = Some(Spare::start(take).unwrap());
    (stepper, outputs)
}

/// A stepper each of whose steps waits for a permit, until the sender of permits is gone.
fn gated() -> (Stepper, Receiver<(usize, Output)>, Sender<()>) {
    let (permit, permits) = channel();
    let take = move |simulation: &mut Simulation, _: Instant| {
        let _ = permits.recv();
        simulation.step()
    };
    let (stepper, outputs) = stepper(Box::new(take));
    (stepper, outputs, permit)
}

fn wake(stepper: &mut Stepper) {
    stepper.step(WakeUp { woke: stepper.clock.elapsed(), ..WakeUp::default() });
}

fn command(stepper: &mut Stepper, request: Request) {
    stepper.handle_command(Command { id: String::new(), request, reply: Box::new(|_| {}), change: None });
}

fn level(stepper: &Stepper) -> usize {
    stepper.levels.ladder.as_ref().unwrap().present()
}

#[test]
fn regress_a_step_that_takes_too_long_is_taken_by_the_spare() {
    let (mut stepper, outputs, permit) = gated();
    for _ in 0..5 {
        permit.send(()).unwrap();
        wake(&mut stepper);
    }
    assert_eq!((level(&stepper), stepper.simulation.step_count()), (0, 5));
    assert!(outputs.try_iter().count() > 0);
    // The spare is prepared already when these come.
    command(&mut stepper, Request::Torque(PULSE));
    command(&mut stepper, Request::Setpoint(SETPOINT));
    wake(&mut stepper);
    assert_eq!((level(&stepper), stepper.simulation.step_count()), (1, 6), "the worker still waits for its permit");
    assert_eq!(stepper.deadlines.overruns.missed, 0);

    let (mut reference, mut ladder) = at_best();
    (0..5).for_each(|_| reference.step().unwrap());
    reference.add_pulse(&PULSE).unwrap();
    reference.set_torque(&SETPOINT).unwrap();
    let changed_j = ladder.switch(&mut reference, 1).unwrap();
    let changed = reference.checkpoint();
    let messages: Vec<Output> = outputs.try_iter().map(|(_, message)| message).collect();
    let is_change = |message: &Output| matches!(message, Output::Answer(answer) if answer.reply.changed_j.is_some());
    let place = messages.iter().position(is_change).unwrap();
    assert!(matches!(&messages[place - 1], Output::Scene(scene) if scene.scene.level == 1));
    let Output::Answer(answer) = &messages[place] else { unreachable!() };
    let reply = &answer.reply;
    assert_eq!((reply.effective.step, reply.changed_j, answer.stamp.step), (6, Some(changed_j), 5));
    assert_eq!(reply.reason, "a step took more than 160.00ms");
    assert!(matches!(&messages[place + 1], Output::Checkpoint(state, stamp) if **state == changed && stamp.step == 5));
    reference.step().unwrap();
    assert_eq!(stepper.simulation.checkpoint(), reference.checkpoint());

    // The run goes on while the worker is busy, and without the level that the worker holds.
    wake(&mut stepper);
    stepper.levels.wanted = Some((0, Duration::ZERO));
    wake(&mut stepper);
    assert_eq!((level(&stepper), stepper.simulation.step_count()), (1, 8));
    (0..2).for_each(|_| permit.send(()).unwrap());
    stepper.await_given_up();
    wake(&mut stepper);
    assert_eq!((level(&stepper), stepper.levels.wanted), (0, None), "the level is free again");
    (0..3).for_each(|_| reference.step().unwrap());
    ladder.switch(&mut reference, 0).unwrap();
    assert_eq!(stepper.simulation.checkpoint(), reference.checkpoint());
}

/// Neither a load for the governor nor a cause of missed deadlines.
#[test]
#[cfg(target_os = "linux")]
fn regress_a_worker_that_is_kept_from_its_processor_is_no_time_of_the_solver() {
    let away = Duration::from_millis(20);
    let take = move |simulation: &mut Simulation, _: Instant| {
        std::thread::sleep(away);
        simulation.step()
    };
    let (mut stepper, _outputs) = stepper(Box::new(take));
    wake(&mut stepper);
    wake(&mut stepper);
    assert_eq!(level(&stepper), 0, "both steps were done in time");
    let StepTimings { solving, elsewhere, .. } = stepper.deadlines.timings;
    assert!(solving >= away && elsewhere < away, "{solving:?}, {elsewhere:?} of it on the worker's processor");
}

/// Commands come between steps, after the spare was prepared.
#[test]
fn prop_a_spare_that_is_not_needed_changes_nothing() {
    let (mut stepper, _outputs) = stepper(prolonged_by(None));
    let (mut reference, _) = at_best();
    for step in 0..300_u32 {
        if step % 7 == 3 {
            command(&mut stepper, Request::Torque(PULSE));
            command(&mut stepper, Request::Setpoint(SETPOINT));
            reference.add_pulse(&PULSE).unwrap();
            reference.set_torque(&SETPOINT).unwrap();
        }
        wake(&mut stepper);
        reference.step().unwrap();
        assert_eq!(stepper.simulation.checkpoint(), reference.checkpoint(), "step {step}");
    }
    // A busy machine misses deadlines without a spare, too.
    assert_eq!(level(&stepper), 0);
}

#[test]
fn regress_a_step_beside_the_spare_allocates_nothing() {
    let by_worker = Arc::new(AtomicU64::new(0));
    let count = Arc::clone(&by_worker);
    let take = move |simulation: &mut Simulation, _: Instant| {
        let mut taken = Ok(());
        let counted = allocation_counter::measure(|| taken = simulation.step());
        count.fetch_add(counted.count_total, Ordering::Relaxed);
        taken
    };
    let (mut stepper, _outputs) = stepper(Box::new(take));
    (0..3).for_each(|_| wake(&mut stepper));
    let mut beside = 0;
    let counted = allocation_counter::measure(|| {
        for _ in 0..200 {
            beside += u32::from(stepper.step_beside_spare(Instant::now()).is_some());
            stepper.prepare_spare_ahead();
        }
    });
    assert_eq!((counted.count_total, by_worker.load(Ordering::Relaxed)), (0, 0));
    assert!(beside > 190, "{beside} of 200 steps were taken at two levels");
}

#[test]
fn regress_the_governor_goes_on_to_a_cheaper_level_while_a_step_given_up_is_computed() {
    let (mut stepper, _outputs, permit) = gated();
    wake(&mut stepper);
    assert_eq!(level(&stepper), 1);
    // The step of the next level took too long, too.
    stepper.levels.wanted = Some((2, Duration::ZERO));
    wake(&mut stepper);
    assert_eq!((level(&stepper), stepper.levels.wanted), (2, None));
    drop(permit);
    stepper.await_given_up();
    assert_eq!(level(&stepper), 2);
}

/// A wish of the governor from before the command would undo it.
#[test]
fn regress_a_commanded_level_ends_the_wish_of_the_governor() {
    let (mut stepper, _outputs) = stepper(prolonged_by(None));
    stepper.levels.wanted = Some((1, Duration::ZERO));
    command(&mut stepper, Request::Control(Action::Level { name: "rough".to_owned() }));
    wake(&mut stepper);
    assert_eq!((level(&stepper), stepper.levels.wanted), (2, None));
}

#[test]
fn regress_changes_wait_for_the_step_that_was_given_up() {
    let (mut stepper, _outputs, permit) = gated();
    wake(&mut stepper);
    assert_eq!(level(&stepper), 1);
    // Any other level is free.
    command(&mut stepper, Request::Control(Action::Level { name: "rough".to_owned() }));
    assert_eq!((level(&stepper), stepper.levels.waiting.len()), (2, 0));
    command(&mut stepper, Request::Control(Action::Level { name: "good".to_owned() }));
    wake(&mut stepper);
    assert_eq!((level(&stepper), stepper.levels.waiting.len()), (2, 1));
    permit.send(()).unwrap();
    while stepper.spare_is_busy() {
        std::thread::yield_now();
    }
    stepper.take_waiting_changes();
    assert_eq!((level(&stepper), stepper.levels.waiting.len()), (0, 0));
}
