//! `run`: live services, until they finish or are stopped.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::Context as _;

use super::args::RunArgs;
use super::resume::{RunStart, begin};
use super::signals::interrupted;
use super::status_line::StatusLine;
pub(super) use super::status_line::describe;
use super::{ExitStatus, shown_s};
use crate::bus::{self, BusError};
use crate::recording::{RecordingError, Split, Written, paths};
use crate::runtime::{Ending, ShadowSimulation, Spin, SteppingOptions, ThreadOptions, unbalanced};
use crate::scene::{IntegratorKind, MODELS, SceneSource};
use crate::service::{self, LiveOptions, LiveReport, LiveSimulation};
use crate::simulation::{EnergyVerdict, Simulation};
use crate::wire::Angles;

pub(super) fn run(args: RunArgs) -> anyhow::Result<ExitStatus> {
    let starts = begin(&args)?;
    let count = starts.len();
    if !args.force {
        let names: Vec<&bus::Name> = starts.iter().map(|start| &start.name).collect();
        if let Some(taken) = args.bus.options().first_taken_through_endpoints(&names)? {
            return Err(BusError::Taken(taken).into());
        }
    }
    let status_line = StatusLine::new(count);
    let mut members = Vec::with_capacity(count);
    for (index, start) in starts.into_iter().enumerate() {
        members.push(member(&args, start, (index, count), &status_line)?);
    }
    if let Some(LiveSimulation { live, .. }) = members.first() {
        status_line.head(heading(live, count));
    }
    for member in &members {
        warn_of_weight(&member.live);
    }
    let spin = args.spin.unwrap_or(if count == 1 { Spin::Auto } else { Spin::NONE });
    let waking = ThreadOptions { spin, realtime: !args.no_realtime };
    let reports = runtime()?.block_on(async {
        let session = args.bus.options().open_service()?;
        let reports = service::run_all(&session, members, waking, interrupted()).await;
        bus::close(&session)?;
        anyhow::Ok(reports?)
    })?;
    status_line.clear();
    Ok(conclude(&reports))
}

/// Prepares service `index` of `count`.
fn member(
    args: &RunArgs,
    beginning: RunStart,
    (index, count): (usize, usize),
    status_line: &StatusLine,
) -> anyhow::Result<LiveSimulation> {
    let RunStart { name, scene, simulation, publish, resumption } = beginning;
    let shadow = args.shadow.as_deref().map(|model| shadow(&scene, model)).transpose()?;
    let folder = Path::new(paths::FOLDER);
    let path = match (&args.record, args.no_record) {
        (_, true) => None,
        (Some(path), _) if count > 1 => Some(paths::part(path, u32::try_from(index + 1)?)),
        (Some(path), _) => Some(path.clone()),
        (None, _) => Some(paths::fresh(folder, &name.to_string(), SystemTime::now())),
    };
    if let Some(first) = path.as_ref().map(|path| first_file(path, args.split)).filter(|first| first.exists()) {
        return Err(RecordingError::Exists(first).into());
    }
    let on_status = status_line.of(index, &name.to_string());
    let live = LiveOptions {
        name,
        scene,
        stepping: SteppingOptions { pace: args.pace, until_s: args.until, publish, overrun: args.overrun.into() },
        record: path,
        recordings: folder.to_owned(),
        flush_period: args.flush,
        fsync: args.fsync,
        split: args.split,
        max_recording_bytes: args.max_recording_size.map(|size| size.as_u64()),
        scene_updates_hz: args.scene_updates,
        command_line: std::env::args().collect::<Vec<_>>().join(" "),
        on_status,
        force: args.force,
        resumed: resumption,
    };
    Ok(LiveSimulation { live, simulation, shadow })
}

/// The same scene by another model, with the integrator that usually suits it.
fn shadow(scene: &SceneSource, model: &str) -> anyhow::Result<ShadowSimulation> {
    let mut overrides = vec![format!("solver.model={model}")];
    let kind = MODELS.iter().find(|(word, _)| *word == model).map(|(_, kind)| *kind);
    overrides.extend(kind.map(|kind| format!("solver.integrator={}", kind.usual_integrator().as_str())));
    let scene = SceneSource::parse(&format!("--shadow {model}"), &scene.text, &overrides)?;
    Ok(ShadowSimulation::new(scene.scene.solver.model, Simulation::new(&scene.scene)?))
}

fn first_file(record: &Path, split: Option<Split>) -> PathBuf {
    split.map_or_else(|| record.to_owned(), |_| paths::part(record, 1))
}

/// Warns of a weight below ½: vibrations grow at any step.
fn warn_of_weight(live: &LiveOptions) {
    let solver = &live.scene.scene.solver;
    if solver.integrator == IntegratorKind::TwoPoint && solver.weight < 0.5 {
        tracing::warn!(
            scene = live.scene.origin,
            "solver.weight = {}: two-point is unstable below 0.5; it is there for comparison with the thesis",
            solver.weight
        );
    }
}

/// The heading for the first of `count` services.
fn heading(LiveOptions { name, scene, record, split, .. }: &LiveOptions, count: usize) -> String {
    let solver = &scene.scene.solver;
    let to =
        record.as_ref().map_or("not recorded".to_owned(), |path| format!("recorded to {}", first_file(path, *split).display()));
    let others = if count > 1 { format!("; and {} more", count - 1) } else { String::new() };
    format!(
        "{}: {} model, {}, step {} s; on the bus as flexcrank/{}; {to}{others}",
        scene.origin,
        solver.model.as_str(),
        solver.integrator.as_str(),
        solver.step_s,
        name,
    )
}

/// Prints how each service ended and what it recorded; for several, only what is out of the ordinary.
fn conclude(reports: &[LiveReport]) -> ExitStatus {
    let many = reports.len() > 1;
    let done =
        reports.iter().map(|report| conclude_one(report, many)).max_by_key(|done| severity(*done)).unwrap_or(ExitStatus::Success);
    if many {
        let written: Vec<&Written> = reports.iter().flat_map(|report| report.recordings.iter().flatten()).collect();
        let messages: u64 = written.iter().map(|written| written.messages).sum();
        let recorded =
            if written.is_empty() { String::new() } else { format!("; recorded {messages} messages to {} files", written.len()) };
        say!("{} runs ended{recorded}", reports.len());
    }
    done
}

fn severity(done: ExitStatus) -> u8 {
    match done {
        ExitStatus::Success => 0,
        ExitStatus::Lossy => 1,
        ExitStatus::Untrusted => 2,
        ExitStatus::Refused => 3,
        ExitStatus::Late => 4,
        ExitStatus::Diverged => 5,
    }
}

fn conclude_one(report: &LiveReport, many: bool) -> ExitStatus {
    if let (Some(Angles { stamp: Some(stamp), links }), false) = (&report.angles, many) {
        let angles: Vec<String> = links.iter().map(|link| format!("{} at {:.9} rad", link.link, link.chord_rad)).collect();
        say!("t = {} s: {}", shown_s(stamp.sim_time_s), angles.join(", "));
    }
    let mut done = match &report.ending {
        Ending::Finished | Ending::Stopped => ExitStatus::Success,
        Ending::Diverged(diverged) => {
            say!("error: {diverged}");
            ExitStatus::Diverged
        }
        Ending::Late { step, late } => {
            say!("error: step {step} missed its deadline by {late:.1?}, and --overrun is stop");
            ExitStatus::Late
        }
    };
    let mut lossy = report.dropped > 0;
    if lossy {
        say!("warning: {} samples were dropped because bus or disk could not keep up", report.dropped);
    }
    for recording in &report.recordings {
        lossy |= recording.as_ref().map_or(true, |written| written.limited);
        if !many || recording.is_err() {
            report_recording(recording);
        }
    }
    if lossy && done == ExitStatus::Success {
        done = ExitStatus::Lossy;
    }
    if let (EnergyVerdict::Unbalanced { worst_j, in_play_j }, ExitStatus::Success | ExitStatus::Lossy) = (report.verdict, done) {
        say!("warning: {}", unbalanced(worst_j, in_play_j));
        done = ExitStatus::Untrusted;
    }
    done
}

fn report_recording(recording: &Result<Written, RecordingError>) {
    match recording {
        Ok(Written { path, messages, limited }) => {
            let early = if *limited { ", and then stopped: --max-recording-size" } else { "" };
            say!("recorded {messages} messages to {}{early}", path.display());
        }
        Err(error) => say!("error: recording: {error}"),
    }
}

pub(super) fn runtime() -> anyhow::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().context("cannot start the async runtime")
}
