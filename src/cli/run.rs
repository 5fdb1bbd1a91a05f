//! `run`: live services, until they finish or are stopped.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::str::FromStr as _;
use std::time::{Duration, SystemTime};

use clap::{Parser, ValueEnum};

use super::async_runtime::runtime;
use super::bus_args::BusArgs;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::resume::{self, ResumeArgs, RunStart};
use super::signals::interrupted;
use super::status_line::StatusLine;
use super::supervise::supervise;
use super::values::{flush_period, frames, pace, positive, recording_size, split};
use crate::bus::{self, BusError, BusOptions, Name};
use crate::recording::{RecordingError, Split, Written, paths};
use crate::runtime::{Ending, Overrun, Pace, ShadowSimulation, Spin, SteppingOptions, ThreadOptions, unbalanced};
use crate::scene::{IntegratorKind, MODELS, SceneSource, builtin};
use crate::service::{self, LiveOptions, LiveReport, LiveSimulation};
use crate::shown::shown_s;
use crate::simulation::{EnergyVerdict, PublishRate, PublishRates, Simulation};
use crate::wire::Angles;

/// Default name of a service.
pub(super) const NAME: &str = "crank";

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank run --pace max --until 10
  flexcrank run --set rod.length_m=1.2 --set pulse.0.torque_nm=5
  flexcrank run mine.toml --name left --publish-hz all --no-record
  flexcrank run mine.toml other.toml --count 10 --publish-hz 50,loads=all
  flexcrank run --record soak.mcap --split 10min --flush 50ms --fsync
  flexcrank run --resume recordings/crank.mcap
  flexcrank run --supervise --record crank.mcap";

#[derive(Debug, Parser)]
pub(super) struct Args {
    /// Built-in scenes or TOML files. Several run side by side in one process.
    #[arg(default_value = builtin::DEFAULT)]
    pub scene: Vec<String>,
    /// Number of services to run per scene.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=999))]
    pub count: u32,
    #[command(flatten)]
    pub resume: super::resume::ResumeArgs,
    /// Name on the bus: keys are flexcrank/NAME/…. Default: crank, or the name of the resumed session. Several services are named
    /// NAME-001, NAME-002, …
    #[arg(long)]
    pub name: Option<Name>,
    /// Pace: real, max, or simulated seconds per second.
    #[arg(long, default_value = "real", value_parser = pace)]
    pub pace: Pace,
    /// Finish at this simulated time, s.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub until: Option<f64>,
    /// Publishing rate: samples per simulated second, or all; or by topic (displacements, angles, loads, energies):
    /// 50,angles=all,energies=10. Energies have the rate of loads unless named. Default: 200, or the rate of the resumed session.
    #[arg(long, value_name = "HZ")]
    pub publish_hz: Option<PublishRates>,
    /// Policy for deadlines missed by more than a step: catch-up; skip (move the deadlines and report it); or stop, with exit code 5.
    #[arg(long, value_name = "POLICY", default_value = "catch-up")]
    pub overrun: Overruns,
    /// Busy-wait for this long before each deadline instead of sleeping (0 disables it). auto adapts, so that one wake-up in a
    /// thousand is later; at most 200us and a fifth of the period. Default: auto for one service, 0 for several.
    #[arg(long, value_name = "TIME", value_parser = Spin::from_str)]
    pub spin: Option<Spin>,
    /// Do not request real-time scheduling, locked memory and processors that stay awake.
    #[arg(long)]
    pub no_realtime: bool,
    /// Record to this file instead of recordings/NAME-TIME.mcap; several services record to numbered files.
    #[arg(long, value_name = "PATH", conflicts_with = "no_record")]
    pub record: Option<PathBuf>,
    /// Do not record.
    #[arg(long)]
    pub no_record: bool,
    /// Flush period: a crash loses at most what was recorded in this time.
    #[arg(long, value_name = "TIME", default_value = "200ms", value_parser = flush_period)]
    pub flush: Duration,
    /// At every flush, wait until the data is on the disk: a power failure loses no more either.
    #[arg(long)]
    pub fsync: bool,
    /// Record into numbered parts of this size or recorded time: 500MB, 10min. Each part is complete by itself.
    #[arg(long, value_name = "SIZE|TIME", value_parser = split)]
    pub split: Option<Split>,
    /// Stop recording before it exceeds this size, all parts together; the simulation goes on: 2GB.
    #[arg(long, value_name = "SIZE", value_parser = recording_size)]
    pub max_recording_size: Option<bytesize::ByteSize>,
    /// Also publish the mechanism as shapes for Foxglove and Lichtblick: foxglove.SceneUpdate, at 25 Hz or HZ.
    #[arg(long, value_name = "HZ", num_args = 0..=1, require_equals = true, default_missing_value = "25", value_parser = frames)]
    pub scene_updates: Option<f64>,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Run another model beside the first on the same commands, and publish the difference.
    #[arg(long, value_name = "MODEL")]
    pub shadow: Option<String>,
    /// Run even if another service on the bus has this name.
    #[arg(long)]
    pub force: bool,
    /// Run the service in a process of its own. If that is killed or crashes, start another that resumes its recording, equal to
    /// the bit, and records to PATH-resumed-1.mcap, and so on.
    #[arg(long, conflicts_with_all = ["no_record", "count", "shadow"])]
    pub supervise: bool,
    /// The recording that the supervisor chose for its service.
    #[arg(long, hide = true, requires = "supervise")]
    pub supervised_record: Option<PathBuf>,
    /// The recording that the supervisor lets its service resume.
    #[arg(long, hide = true, requires = "supervise")]
    pub supervised_resume: Option<PathBuf>,
    /// Run without the bus, for batches: the service takes no port and no name, and nobody can reach it.
    #[arg(long, conflicts_with_all = ["listen", "connect", "zenoh_config", "force"])]
    pub no_bus: bool,
    #[command(flatten)]
    pub bus: BusArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Overruns {
    CatchUp,
    Skip,
    Stop,
}

impl From<Overruns> for Overrun {
    fn from(policy: Overruns) -> Self {
        match policy {
            Overruns::CatchUp => Overrun::CatchUp,
            Overruns::Skip => Overrun::Skip,
            Overruns::Stop => Overrun::Stop,
        }
    }
}

pub(super) fn run(mut args: Args) -> CommandResult {
    if args.supervise {
        if args.scene.len() > 1 {
            return Err(Failure::Usage("--supervise runs one service: give one scene".to_owned()));
        }
        let Some(record) = args.supervised_record.take() else { return supervise(&args) };
        args.record = Some(record);
        if let Some(file) = args.supervised_resume.take() {
            args.resume = ResumeArgs { resume: Some(file), at: None };
        }
    }
    let starts = starts(&args)?;
    let count = starts.len();
    let bus = BusOptions { isolated: args.no_bus, ..args.bus.options() };
    if !args.force {
        let names: Vec<&Name> = starts.iter().map(|start| &start.name).collect();
        if let Some(taken) = bus.first_taken_through_endpoints(&names)? {
            return Err(BusError::Taken(taken).into());
        }
    }
    let status_line = StatusLine::new(count);
    let mut members = Vec::with_capacity(count);
    for (index, start) in starts.into_iter().enumerate() {
        members.push(member(&args, start, (index, count), &status_line)?);
    }
    if let Some(LiveSimulation { live, .. }) = members.first() {
        status_line.head(heading(live, count, args.no_bus));
    }
    for member in &members {
        warn_of_weight(&member.live);
    }
    let spin = args.spin.unwrap_or(if count == 1 { Spin::Auto } else { Spin::NONE });
    let waking = ThreadOptions { spin, realtime: !args.no_realtime };
    let was_interrupted = Cell::new(false);
    let reports = runtime()?.block_on(async {
        // From here on, before anything is recorded, a signal no longer ends the process by itself.
        let signal = interrupted();
        let shutdown = async {
            signal.await;
            was_interrupted.set(true);
        };
        let session = bus.open_service()?;
        let reports = service::run_all(&session, members, waking, shutdown).await;
        bus::close(&session)?;
        CommandResult::Ok(reports?)
    })?;
    status_line.clear();
    let done = conclude(&reports);
    let unfinished = reports.iter().any(|report| report.ending == Ending::Stopped);
    let early = args.until.is_some() && was_interrupted.get() && unfinished;
    Ok(if early && done == ExitStatus::Success { ExitStatus::Interrupted } else { done })
}

/// The starts of all services: `count` of every scene, or a resumed session.
fn starts(args: &Args) -> CommandResult<Vec<RunStart>> {
    if let Some(file) = &args.resume.resume {
        return Ok(vec![resume::start_from(file, args.resume.at, args.name.clone(), args.publish_hz)?]);
    }
    let name = args.name.clone().map_or_else(|| NAME.parse(), Ok)?;
    let publish = args.publish_hz.unwrap_or(PublishRate::DEFAULT.into());
    let mut all = Vec::new();
    for scene in &args.scene {
        let scene = SceneSource::open(scene, &args.overrides)?;
        for _ in 0..args.count {
            let simulation = Simulation::new(&scene.scene)?;
            all.push(RunStart { name: name.clone(), scene: scene.clone(), simulation, publish, resumption: None });
        }
    }
    if all.len() > 1 {
        for (number, start) in (1..).zip(&mut all) {
            start.name = format!("{name}-{number:03}").parse()?;
        }
    }
    Ok(all)
}

/// Prepares service `index` of `count`.
fn member(
    args: &Args,
    beginning: RunStart,
    (index, count): (usize, usize),
    status_line: &StatusLine,
) -> CommandResult<LiveSimulation> {
    let RunStart { name, scene, simulation, publish, resumption } = beginning;
    let shadow = args.shadow.as_deref().map(|model| shadow(&scene, model)).transpose()?;
    let folder = Path::new(paths::FOLDER);
    let path = match (&args.record, args.no_record) {
        (_, true) => None,
        (Some(path), _) if count > 1 => Some(paths::part(path, u32::try_from(index + 1).unwrap_or(u32::MAX))),
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
fn shadow(scene: &SceneSource, model: &str) -> CommandResult<ShadowSimulation> {
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
fn heading(LiveOptions { name, scene, record, split, .. }: &LiveOptions, count: usize, no_bus: bool) -> String {
    let solver = &scene.scene.solver;
    let to =
        record.as_ref().map_or("not recorded".to_owned(), |path| format!("recorded to {}", first_file(path, *split).display()));
    let bus = if no_bus { "not on the bus".to_owned() } else { format!("on the bus as flexcrank/{name}") };
    let others = if count > 1 { format!("; and {} more", count - 1) } else { String::new() };
    format!(
        "{}: {} model, {}, step {} s; {bus}; {to}{others}",
        scene.origin,
        solver.model.as_str(),
        solver.integrator.as_str(),
        solver.step_s,
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
        ExitStatus::Success | ExitStatus::Interrupted | ExitStatus::OfService(_) => 0,
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
