//! `run`: a service that goes on until it is done or told to stop.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

use anyhow::Context as _;
use indicatif::{ProgressBar, ProgressStyle};
use tokio::signal::unix::{Signal, SignalKind, signal};

use super::Done;
use super::args::Run;
use super::resume::{Beginning, begin};
use crate::bus;
use crate::recording::{RecordingError, Written, place};
use crate::runtime::{Ending, Shadow, Stepping};
use crate::scene::{MODELS, SceneSource};
use crate::service::{self, Live, LiveReport};
use crate::simulation::Simulation;
use crate::wire::{Angles, Status, status::State};

pub(super) fn run(args: Run) -> anyhow::Result<Done> {
    let Beginning { name, scene, simulation, publish, resumption } = begin(&args)?;
    let shadow = args.shadow.as_deref().map(|model| shadow(&scene, model)).transpose()?;
    let folder = Path::new(place::FOLDER);
    let fresh = || place::fresh(folder, &name.to_string(), SystemTime::now());
    let record = (!args.no_record).then(|| args.record.clone().unwrap_or_else(fresh));
    let line = status_line();
    let (shown, warned) = (line.clone(), AtomicBool::new(false));
    let first = record.as_ref().map(|path| if args.split.is_some() { place::part(path, 1) } else { path.clone() });
    announce(&name, &scene, first.as_deref());
    let live = Live {
        name,
        scene,
        stepping: Stepping { pace: args.pace, until_s: args.until, publish },
        record,
        recordings: folder.to_owned(),
        flush_period: args.flush,
        fsync: args.fsync,
        split: args.split,
        scene_updates_hz: args.scene_updates,
        command_line: std::env::args().collect::<Vec<_>>().join(" "),
        on_status: Box::new(move |status| show(&shown, &warned, status)),
        force: args.force,
        resumed: resumption,
    };
    let report = runtime()?.block_on(async {
        let session = args.bus.options().open_service()?;
        let report = service::run(&session, live, (simulation, shadow), interrupted()).await;
        bus::close(&session)?;
        anyhow::Ok(report?)
    })?;
    line.finish_and_clear();
    Ok(conclude(&report))
}

/// Updates the status line; the first warning stays.
fn show(line: &ProgressBar, warned: &AtomicBool, status: &Status) {
    line.set_message(describe(status));
    if status.state() != State::Diverged && !status.message.is_empty() && !warned.swap(true, Ordering::Relaxed) {
        line.suspend(|| eprintln!("warning: {}", status.message));
    }
}

/// The same scene by another model, with the integrator that usually suits it.
fn shadow(scene: &SceneSource, model: &str) -> anyhow::Result<Shadow> {
    let mut overrides = vec![format!("solver.model={model}")];
    let kind = MODELS.iter().find(|(word, _)| *word == model).map(|(_, kind)| *kind);
    overrides.extend(kind.map(|kind| format!("solver.integrator={}", kind.usual_integrator().as_str())));
    let scene = SceneSource::parse(&format!("--shadow {model}"), &scene.text, &overrides)?;
    Ok(Shadow::new(scene.scene.solver.model, Simulation::new(&scene.scene)?))
}

fn announce(name: &bus::Name, scene: &SceneSource, record: Option<&Path>) {
    let solver = &scene.scene.solver;
    let to = record.map_or("not recorded".to_owned(), |path| format!("recorded to {}", path.display()));
    eprintln!(
        "{}: {} model, {}, step {} s; on the bus as flexcrank/{}; {to}",
        scene.origin,
        solver.model.as_str(),
        solver.integrator.as_str(),
        solver.step_s,
        name,
    );
}

/// Says where it ended, how, and what was recorded.
fn conclude(report: &LiveReport) -> Done {
    if let Some(Angles { stamp: Some(stamp), links }) = &report.angles {
        let angles: Vec<String> = links.iter().map(|link| format!("{} at {:.9} rad", link.link, link.chord_rad)).collect();
        eprintln!("t = {} s: {}", stamp.sim_time_s, angles.join(", "));
    }
    let mut done = match &report.ending {
        Ending::Finished | Ending::Stopped => Done::Well,
        Ending::Diverged(diverged) => {
            eprintln!("error: {diverged}");
            Done::Diverged
        }
    };
    let mut lossy = report.dropped > 0;
    if lossy {
        eprintln!("warning: {} samples were left out because bus or disk could not keep up", report.dropped);
    }
    for recording in &report.recordings {
        lossy |= recording.is_err();
        tell(recording);
    }
    if lossy && done == Done::Well {
        done = Done::Lossy;
    }
    done
}

fn tell(recording: &Result<Written, RecordingError>) {
    match recording {
        Ok(Written { path, messages }) => eprintln!("recorded {messages} messages to {}", path.display()),
        Err(error) => eprintln!("error: recording: {error}"),
    }
}

pub(super) fn runtime() -> anyhow::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().context("cannot start the async runtime")
}

/// Resolves at Ctrl-C or SIGTERM, which end nothing by themselves any more from the moment of this call.
pub(super) fn interrupted() -> impl Future<Output = ()> {
    let [interrupt, terminate] = [SignalKind::interrupt(), SignalKind::terminate()].map(signal);
    async {
        tokio::select! {
            () = received(interrupt) => {}
            () = received(terminate) => {}
        }
    }
}

/// Resolves at a signal; never where it cannot be heard.
async fn received(signal: std::io::Result<Signal>) {
    match signal {
        Ok(mut signal) => drop(signal.recv().await),
        Err(_) => std::future::pending().await,
    }
}

/// A line on the terminal that is overwritten; nothing when there is no terminal.
fn status_line() -> ProgressBar {
    let line = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{msg}") {
        line.set_style(style);
    }
    line
}

/// A status in one line.
pub(super) fn describe(status: &Status) -> String {
    let state = State::try_from(status.state).unwrap_or_default();
    let time = status.stamp.as_ref().map_or(0.0, |stamp| stamp.sim_time_s);
    let optional = |name: &str, value: Option<String>| value.map_or(String::new(), |value| format!("  {name} {value}"));
    let milliseconds = |value: f64| format!("{:.2} ms", value * 1e3);
    format!(
        "{:<8} t {time:9.3} s{}{}{}{}{}",
        state.as_str_name(),
        optional("rtf", status.real_time_factor.map(|factor| format!("{factor:.4}"))),
        optional("late p50", status.lateness_p50_s.map(milliseconds)),
        optional("p99", status.lateness_p99_s.map(milliseconds)),
        optional("", status.kinetic_j.map(|kinetic| format!("{:.4} J", kinetic + status.strain_j.unwrap_or(0.0)))),
        if status.dropped_samples > 0 { format!("  dropped {}", status.dropped_samples) } else { String::new() },
    )
}
