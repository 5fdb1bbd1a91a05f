//! Many clients at once, many services at once; late joiners. Real sessions on loopback.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use std::collections::BTreeSet;
use std::process::Command;
use std::thread;
use std::time::Duration;

use common::{Listener, Outcome, Service, linked_sessions, scene};
use flexcrank::bus::{self, About, BusOptions, Name, ServiceEndpoint, Topic, client};
use flexcrank::runtime::{Ending, Pace, Spin, SteppingOptions, ThreadOptions};
use flexcrank::service::{self, LiveSimulation};
use flexcrank::simulation::{PublishRate, Simulation};
use flexcrank::wire::{Angles, AppliedCommand, Energies, Loads, Status, TorquePulse};
use prost::Message as _;

/// Time for a message or reply on a busy machine.
const PATIENCE: Duration = Duration::from_secs(10);

/// Pulses of four clients at once, every third sent twice.
const CLIENTS: u32 = 4;
const PULSES: u32 = 100;
const TORQUE_NM: f64 = 0.01;
const DURATION_S: f64 = 1e-3;

/// The impulse is a sum over the pulses, without the integrator: exact but for rounding. That the mechanism felt it shows in its kinetic
/// energy, from velocities that the integrator computed: it equals torque times travel, summed over the steps, as far as the scheme
/// keeps energy. Runge–Kutta's fourth order keeps it to 1e-11 here, and its torque of a step acts within that step; with
/// generalized-alpha some of it acts in the steps after.
#[test]
fn prop_no_pulse_of_four_clients_is_lost_or_doubled() -> Outcome {
    let scene = scene(&["pulse=[]", "commands.pending_limit=4096"])?;
    let service = Service::start(scene, Pace::Factor(1.0), None, PublishRate::All)?;
    thread::scope(|scope| {
        let send = |who: u32| {
            for number in 0..PULSES {
                let id = format!("{who}-{number}");
                let pulse = TorquePulse { id, torque_nm: TORQUE_NM, duration_s: DURATION_S, ..TorquePulse::default() };
                for _ in 0..if number % 3 == 0 { 2 } else { 1 } {
                    let reply = client::pulse(&service.client, &service.name, &pulse).unwrap();
                    assert!(reply.accepted, "{}", reply.reason);
                }
            }
        };
        (0..CLIENTS).for_each(|who| drop(scope.spawn(move || send(who))));
    });
    let listener = Listener::new(&service.client, &service.name)?;
    let ended = |bytes: &Vec<u8>| Status::decode(bytes.as_slice()).is_ok_and(|status| status.pulses_pending == 0);
    wait_until("the last pulse ends", || listener.payloads(Topic::Status).last().is_some_and(ended))?;
    let (_, folder) = service.stop()?;
    let file = folder.path().join("run.mcap");
    let applied = common::decoded::<AppliedCommand>(&file, "commands")?;
    let ids: BTreeSet<_> = applied.iter().filter_map(|command| command.reply.as_ref()).map(|reply| reply.id.clone()).collect();
    let sent = u64::from(CLIENTS * PULSES);
    assert_eq!((ids.len() as u64, applied.len() as u64), (sent + 1, sent + 1), "every pulse once, and the stop");
    let loads = common::decoded::<Loads>(&file, "loads")?;
    let over_s = |pair: &[Loads]| common::time_s(&pair[1].stamp) - common::time_s(&pair[0].stamp);
    let impulse: f64 = loads.windows(2).map(|pair| pair[1].driving_torque_nm * over_s(pair)).sum();
    let exact = sent as f64 * TORQUE_NM * DURATION_S;
    println!("impulse {:e} from exact", impulse / exact - 1.0);
    assert!((impulse / exact - 1.0).abs() < 1e-12, "{impulse} of {exact}");
    let chord = |angles: &Angles| angles.links[0].chord_rad;
    let angles = common::decoded::<Angles>(&file, "angles")?;
    let work_j: f64 = loads[1..]
        .iter()
        .zip(angles.windows(2))
        .map(|(load, pair)| load.driving_torque_nm * (chord(&pair[1]) - chord(&pair[0])))
        .sum();
    let last = common::decoded::<Energies>(&file, "energies")?.pop().ok_or("no energies")?;
    let kinetic_j = last.kinetic_j.ok_or("no kinetic energy")?;
    println!("{work_j} J and {kinetic_j} J: {:e}", kinetic_j / work_j - 1.0);
    assert!((kinetic_j / work_j - 1.0).abs() < 1e-11, "{work_j} J in, {kinetic_j} J there");
    let status = common::decoded::<Status>(&file, "status")?.pop().ok_or("no status")?;
    assert_eq!(status.commands_accepted, sent + 1);
    Ok(())
}

#[test]
fn prop_late_joiners_miss_nothing_after_their_snapshot() -> Outcome {
    const JOINS: u64 = 200;
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::All)?;
    // A cheap generator is random enough to meet the service at any moment.
    let mut dice = 0x2545_f491_4f6c_dd1d_u64;
    for join in 0..JOINS {
        dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let moment = Duration::from_micros((dice >> 33) % 3000);
        let begun = std::time::Instant::now();
        while begun.elapsed() < moment {
            thread::yield_now();
        }
        let mut joined = client::join(&service.client, &service.name, Topic::Angles)?;
        let snapshot = joined.snapshot.angles.as_ref().and_then(|angles| angles.stamp).ok_or("no snapshot")?;
        for n in 1..=5 {
            let (payload, missing) = joined.next(PATIENCE).ok_or("nothing comes")?;
            let angles = Angles::decode(payload.as_slice())?;
            let step = angles.stamp.ok_or("no stamp")?.step;
            assert_eq!((missing, step), (0, snapshot.step + n), "join {join}: step {step} after {}", snapshot.step);
        }
    }
    service.stop()?;
    Ok(())
}

fn wait_until(what: &str, holds: impl Fn() -> bool) -> Outcome {
    let begun = std::time::Instant::now();
    while !holds() {
        if begun.elapsed() > PATIENCE {
            return Err(format!("not within {PATIENCE:?}: {what}").into());
        }
        thread::yield_now();
    }
    Ok(())
}

#[test]
fn prop_a_topic_has_subscribers_while_a_client_subscribes() -> Outcome {
    let (session, client) = linked_sessions()?;
    let name: Name = "test".parse()?;
    let endpoint = ServiceEndpoint::declare(&session, &name, ("", &About::default()), Vec::new())?;
    client::wait_for_service(&client, &name)?;
    for round in 0..50 {
        assert!(!endpoint.has_subscribers(Topic::Angles), "round {round}");
        let joined = client::join(&client, &name, Topic::Angles)?;
        assert!(endpoint.has_subscribers(Topic::Angles), "round {round}: known at once of who has asked for the snapshot");
        assert!(!endpoint.has_subscribers(Topic::Loads), "round {round}: nobody listens to this one");
        drop(joined);
        wait_until("the subscriber has gone", || !endpoint.has_subscribers(Topic::Angles))?;
        let subscriber = client::subscribe(&client, &name, Topic::Angles)?;
        wait_until("a subscriber has come", || endpoint.has_subscribers(Topic::Angles))?;
        drop(subscriber);
        wait_until("that has gone", || !endpoint.has_subscribers(Topic::Angles))?;
    }
    endpoint.close()?;
    bus::close(&session)?;
    bus::close(&client)?;
    Ok(())
}

#[test]
fn prop_only_subscribed_or_recorded_messages_are_encoded() -> Outcome {
    let unheard = Service::start_as(tempfile::tempdir()?, scene(&[])?, Pace::Max, Some(2.0), |live| {
        live.record = None;
        live.scene_updates_hz = Some(25.0);
    })?;
    let (report, _) = unheard.finish()?;
    let last = report.angles.and_then(|angles| angles.stamp).ok_or("the newest is kept all the same")?;
    assert_eq!((report.encoded, last.step), (0, 2000));
    let heard = Service::start_as(tempfile::tempdir()?, scene(&[])?, Pace::Factor(1.0), None, |live| live.record = None)?;
    let mut joined = client::join(&heard.client, &heard.name, Topic::Angles)?;
    let mut count = 0;
    while count < 200 {
        assert_eq!(joined.next(PATIENCE).ok_or("nothing comes")?.1, 0, "message {count}");
        count += 1;
    }
    let (report, _) = heard.stop()?;
    while joined.next(Duration::ZERO).is_some() {
        count += 1;
    }
    assert!(report.encoded >= count && report.encoded < 2 * count, "{} made of one topic, {count} heard", report.encoded);
    Ok(())
}

#[test]
fn prop_an_earlier_subscriber_receives_the_first_message_through_a_router() -> Outcome {
    use zenoh::Wait;
    let address = std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?;
    let endpoint = vec![format!("tcp/{address}")];
    let mut config = zenoh::Config::default();
    for (key, value) in [
        ("mode", r#""router""#.to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("listen/endpoints", format!("{endpoint:?}")),
    ] {
        config.insert_json5(key, &value).map_err(|error| error.to_string())?;
    }
    let router = zenoh::open(config).wait().map_err(|error| error.to_string())?;
    let options = BusOptions { connect: endpoint, ..BusOptions::default() };
    let client = options.open_client()?;
    for round in 0..20 {
        let name: Name = format!("test-{round}").parse()?;
        let subscriber = client.declare_subscriber(name.topic(Topic::Angles)).wait().map_err(|error| error.to_string())?;
        // The router's answer comes after it has received the subscription.
        client::services(&client, Duration::ZERO, |_| true)?;
        let session = options.open_service()?;
        let endpoint = ServiceEndpoint::declare(&session, &name, ("", &About::default()), Vec::new())?;
        for payload in [vec![1], vec![2]] {
            endpoint.publish(Topic::Angles, payload);
        }
        let first = subscriber.recv_timeout(PATIENCE).ok().flatten().ok_or(format!("round {round}: nothing comes"))?;
        assert_eq!(first.payload().to_bytes().as_ref(), [1], "round {round}");
        endpoint.close()?;
        bus::close(&session)?;
    }
    bus::close(&client)?;
    router.close().wait().map_err(|error| error.to_string())?;
    Ok(())
}

/// Which of the scenes refuses the change was not said.
#[test]
fn regress_a_change_that_one_of_several_scenes_refuses_names_it() -> Outcome {
    for (scenes, whose) in [(&["crank-slider", "ref-r5"][..], "ref-r5: "), (&["ref-r5"][..], "")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexcrank"));
        command.arg("run").args(scenes).args(["--set", "slider.mass_kg=0.5", "--no-bus", "--no-record", "--pace", "max"]);
        let ended = command.args(["--until", "0.1"]).output()?;
        let said = String::from_utf8(ended.stderr)?;
        let refusal = format!("error: {whose}--set slider.mass_kg=0.5: slider: ");
        assert!(ended.status.code() == Some(2) && said.starts_with(&refusal), "{scenes:?}: {said}");
    }
    Ok(())
}

#[test]
fn prop_many_services_share_a_process_and_nothing_else() -> Outcome {
    const COUNT: usize = 12;
    let (session, client) = linked_sessions()?;
    let folder = tempfile::tempdir()?;
    let scene = scene(&[])?;
    let mut members = Vec::new();
    for number in 0..COUNT {
        let live = service::LiveOptions {
            name: format!("many-{number:03}").parse()?,
            stepping: SteppingOptions {
                pace: Pace::Factor(1.0),
                until_s: Some(0.5 + 0.1 * number as f64),
                ..SteppingOptions::default()
            },
            record: Some(folder.path().join(format!("{number}.mcap"))),
            ..common::live(scene.clone(), folder.path())?
        };
        members.push(LiveSimulation { live, simulation: Simulation::new(&scene.scene)?, second: None, log_time: None });
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
    let waking = ThreadOptions { spin: Spin::NONE, realtime: false };
    let running = thread::spawn(move || {
        let reports = runtime.block_on(service::run_all(&session, members, waking, std::future::pending()));
        bus::close(&session)?;
        reports
    });
    let seventh: Name = "many-007".parse()?;
    client::wait_for_service(&client, &seventh)?;
    let pulse = TorquePulse { id: "p".to_owned(), torque_nm: 1.0, duration_s: 0.01, ..TorquePulse::default() };
    assert!(client::pulse(&client, &seventh, &pulse)?.accepted);
    let reports = running.join().map_err(|_| "the services panicked")??;
    assert_eq!(reports.len(), COUNT);
    for (number, report) in reports.iter().enumerate() {
        assert_eq!((&report.ending, report.dropped), (&Ending::Finished, 0));
        let file = folder.path().join(format!("{number}.mcap"));
        let steps: Vec<u64> = common::decoded::<Loads>(&file, "loads")?.iter().map(|loads| loads.stamp.unwrap().step).collect();
        assert_eq!(steps.last(), Some(&(500 + 100 * number as u64)), "each ends at its own time");
        let commands = common::payloads(&file, "commands")?.len();
        assert_eq!(commands, usize::from(number == 7), "a pulse is for one only");
    }
    bus::close(&client)?;
    Ok(())
}
