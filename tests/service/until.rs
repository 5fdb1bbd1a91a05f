//! The end, at `--until`, of a run whose steps are asked for one by one.

use std::time::Duration;

use flexcrank::bus::client;
use flexcrank::resimulation::{RecordedSession, verify};
use flexcrank::runtime::{Ending, Pace};
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{self, Advance, control::Action};

use crate::common::{Outcome, Service, scene};
use crate::control;

/// A service that waits to be stepped: 500 steps to its end at 1 s.
fn until_one_second() -> Outcome<Service> {
    let service = Service::start(scene(&["solver.step_s=0.002", "pulse=[]"])?, Pace::Lockstep, Some(1.0), PublishRate::All)?;
    client::wait_for_service(&service.client, &service.name)?;
    Ok(service)
}

fn assert_ends_in_step_500(service: Service) -> Outcome {
    let (report, folder) = service.finish()?;
    assert_eq!(report.ending, Ending::Finished);
    assert_eq!(report.angles.and_then(|angles| angles.stamp).map(|stamp| stamp.step), Some(500));
    assert_eq!(verify(&RecordedSession::open(&folder.path().join("run.mcap"))?, &|_, _| {})?.findings, []);
    Ok(())
}

#[test]
fn regress_steps_asked_for_do_not_go_beyond_the_end() -> Outcome {
    let service = until_one_second()?;
    let reply = client::control(&service.client, &service.name, &control(Action::Step(wire::Steps { count: 600 })))?;
    assert!(reply.accepted, "{}", reply.reason);
    assert_ends_in_step_500(service)
}

#[test]
fn regress_an_advance_beyond_the_end_is_answered_at_the_end() -> Outcome {
    let service = until_one_second()?;
    let wanted = Advance { id: "long".to_owned(), torque_nm: Some(0.1), steps: 600 };
    let answer = client::advance(&service.client, &service.name, &wanted, Duration::from_secs(20))?;
    let reply = answer.reply.unwrap_or_default();
    assert_eq!((reply.accepted, reply.reason.as_str()), (true, "the run reached its end after 500 of 600 steps"));
    assert_eq!(answer.energies.and_then(|energies| energies.stamp).map(|stamp| stamp.step), Some(500));
    assert_ends_in_step_500(service)
}
