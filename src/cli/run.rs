//! `run`: live services, until they finish or are stopped.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use clap::{Parser, ValueEnum};
use clap_complete::engine::{ArgValueCandidates, ArgValueCompleter};

use super::args::command_line;
use super::async_runtime::runtime;
use super::building::build;
use super::bus_args::BusArgs;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::fixed_cost::with_fixed_cost;
use super::folders::{must_have_folder, must_hold_recordings};
use super::foxglove::{FoxgloveArgs, Viewers};
use super::resume::{self, ResumeArgs, RunStart};
use super::ros2_args::{Nodes, Ros2Args};
use super::run_conclusion::{conclude, step_remedy};
use super::run_levels::{check_levels, check_spare};
use super::service_names::{ServiceNames, on_the_bus};
use super::signals::interrupted;
use super::status_line::StatusLine;
use super::supervise::supervise;
use super::values::{flush_period, frames, pace, positive, positive_time, recording_size, services, spin, split};
use crate::bus::{self, BusOptions, Name, Session};
use crate::recording::{RecordingError, Split, paths};
use crate::resimulation::BestLevelRun;
use crate::runtime::{Ending, Overrun, Pace, ShadowSimulation, Slowdown, Spin, SteppingOptions, ThreadOptions};
use crate::scene::{IntegratorKind, MODELS, SceneError, SceneSource, builtin};
use crate::service::{self, LiveOptions, LiveReport, LiveSimulation, SecondRun};
use crate::simulation::{PublishRate, PublishRates};

/// The random times of `--slow-solver` are the same in each run.
const SLOWDOWN_SEED: u64 = 17;
/// The shadow at the best level of the scene.
pub(super) const BEST: &str = "best";

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank run --pace max --until 10
  flexcrank run --set rod.length_m=1.2 --set pulse.0.torque_nm=5
  flexcrank run mine.toml --name left --publish-hz all --no-record
  flexcrank run mine.toml other.toml --count 10 --publish-hz 50,loads=all
  flexcrank run --record soak.mcap --split 10min --flush 50ms --fsync
  flexcrank run leveled.toml --overrun degrade --spare
  flexcrank run --foxglove
  flexcrank run --resume recordings/crank.mcap
  flexcrank run --supervise --record crank.mcap
  flexcrank run --fixed-cost --until 2
  flexcrank run --ros2";

#[derive(Debug, Parser)]
pub(super) struct Args {
    /// Built-in scenes or TOML files. Several run side by side in one process.
    #[arg(default_value = builtin::DEFAULT, add = ArgValueCompleter::new(completions::scenes))]
    pub scene: Vec<String>,
    /// Number of services to run per scene.
    #[arg(long, value_name = "N", default_value = "1", value_parser = services)]
    pub count: u32,
    #[command(flatten)]
    pub resume: super::resume::ResumeArgs,
    /// Name on the bus: keys are flexcrank/NAME/…. Default: crank, or crank-2, crank-3, … if that is taken; or the name of the
    /// resumed session. Several services are named NAME-001, NAME-002, …
    #[arg(long)]
    pub name: Option<Name>,
    /// Pace: real, max, simulated seconds per second, or lockstep: clients ask for the steps (flexcrank/NAME/advance).
    #[arg(long, default_value = "real", value_parser = pace)]
    pub pace: Pace,
    /// Finish at this simulated time: 10, 0.5, 200ms, 10min.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    pub until: Option<f64>,
    /// Publishing rate: samples per simulated second, or all; or by topic (displacements, angles, loads, energies):
    /// 50,angles=all,energies=10. Energies have the rate of loads unless named. Default: 200, or the rate of the resumed session.
    #[arg(long, value_name = "HZ")]
    pub publish_hz: Option<PublishRates>,
    /// Policy for deadlines missed by more than a step: catch-up; skip (move the deadlines and report it); stop, with exit code 5; or
    /// degrade (go to a cheaper [[level]] of the scene before a deadline is missed, and back when there is room).
    #[arg(long, value_name = "POLICY", default_value = "catch-up")]
    pub overrun: Overruns,
    /// Compute each step at the next cheaper level too, on a thread of its own, and go on from there when a step would be late. Needs
    /// --overrun degrade, and three processors.
    #[arg(long)]
    pub spare: bool,
    /// For trials: at random times, steps take this many times as long.
    #[arg(long, hide = true, value_name = "FACTOR", value_parser = positive)]
    pub slow_solver: Option<f64>,
    /// Busy-wait for this long before each deadline instead of sleeping (0 disables it). auto adapts, so that one wake-up in a
    /// thousand is later; at most 200us and a fifth of the period. Default: auto for one service, 0 for several.
    #[arg(long, value_name = "TIME", value_parser = spin)]
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
    #[command(flatten)]
    pub foxglove: FoxgloveArgs,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Give every step the same number of Newton corrections, the least that suffices. It is found at the start, in some seconds,
    /// and printed with the error that it adds. Steps are not cut at the edges of pulses.
    #[arg(long, conflicts_with = "resume")]
    pub fixed_cost: bool,
    /// Run another model beside the first on the same commands, and publish the difference; best: the best [[level]] of the scene, on
    /// a thread of its own, which measures the error that cheaper levels leave.
    #[arg(long, value_name = "MODEL|best", add = ArgValueCandidates::new(completions::shadows))]
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
    #[arg(long, conflicts_with_all = ["listen", "connect", "zenoh_config", "force", "ros2"])]
    pub no_bus: bool,
    #[command(flatten)]
    pub ros2: Ros2Args,
    #[command(flatten)]
    pub bus: BusArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Overruns {
    /// Hurry until deadlines are met again.
    CatchUp,
    /// Move all later deadlines.
    Skip,
    /// End the run.
    Stop,
    /// Go to a cheaper level of the scene before a deadline is missed, and back when there is room.
    Degrade,
}

impl From<Overruns> for Overrun {
    fn from(policy: Overruns) -> Self {
        match policy {
            Overruns::CatchUp => Overrun::CatchUp,
            Overruns::Skip => Overrun::Skip,
            Overruns::Stop => Overrun::Stop,
            Overruns::Degrade => Overrun::Degrade,
        }
    }
}

pub(super) fn run(mut args: Args) -> CommandResult {
    Viewers::check(args.foxglove)?;
    if args.supervise {
        if args.scene.len() > 1 {
            return Err(Failure::Usage("--supervise runs one service: give one scene".to_owned()));
        }
        let Some(record) = args.supervised_record.take() else { return supervise(&args) };
        args.record = Some(record);
        end_with_parent()?;
        if let Some(file) = args.supervised_resume.take() {
            args.resume = ResumeArgs { resume: Some(file), at: None };
        }
    }
    args.record.as_deref().map_or(Ok(()), must_have_folder)?;
    let (fixed, starts) = starts(&args)?;
    let remedy = step_remedy(starts.iter().map(|start| &start.scene.scene));
    let bus = BusOptions { isolated: args.no_bus, gossip: args.ros2.ros2.is_some(), ..args.bus.options() };
    let status_line = StatusLine::new(starts.len(), args.until);
    let was_interrupted = Cell::new(false);
    let reports = runtime()?.block_on(async {
        // From here on, before anything is recorded, a signal no longer ends the process by itself.
        let signal = interrupted();
        let shutdown = async {
            signal.await;
            was_interrupted.set(true);
        };
        let (session, endpoints) = bus.open_listening()?;
        let names = ServiceNames { fixed, count: starts.len(), force: args.force };
        // The claims on the names last as long as the services.
        let served = match names.take(&bus, &session) {
            Ok((names, _claims)) => serve_viewed(&args, &session, &endpoints, (names, starts), &status_line, shutdown).await,
            Err(refused) => Err(refused),
        };
        bus::close(&session)?;
        served
    })?;
    status_line.clear();
    let done = conclude(&reports, &status_line.warnings(), remedy);
    let unfinished = reports.iter().any(|report| report.ending == Ending::Stopped);
    let early = args.until.is_some() && was_interrupted.get() && unfinished;
    Ok(if early && done == ExitStatus::Success { ExitStatus::Interrupted } else { done })
}

/// Lets this process end in order when its supervisor dies.
fn end_with_parent() -> CommandResult<()> {
    #[cfg(target_os = "linux")]
    rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::TERM)).map_err(std::io::Error::from)?;
    Ok(())
}

/// Runs the services under their names until they end, beside a server for viewers if one is asked for.
async fn serve_viewed(
    args: &Args,
    session: &Session,
    endpoints: &[String],
    (names, starts): (Vec<Name>, Vec<RunStart>),
    status_line: &StatusLine,
    shutdown: impl Future<Output = ()>,
) -> CommandResult<Vec<LiveReport>> {
    let viewers = Viewers::beside_run(args.foxglove, session, &names).await?;
    let starts = names.into_iter().zip(starts);
    let served = serve(args, session, endpoints, starts, (status_line, &viewers), shutdown).await;
    let stopped = viewers.stop().await;
    let reports = served?;
    stopped.map(|()| reports)
}

/// Runs the services under their names until they end.
async fn serve(
    args: &Args,
    session: &Session,
    endpoints: &[String],
    starts: impl ExactSizeIterator<Item = (Name, RunStart)>,
    (status_line, viewers): (&StatusLine, &Viewers),
    shutdown: impl Future<Output = ()>,
) -> CommandResult<Vec<LiveReport>> {
    let (count, domain) = (starts.len(), args.ros2.domain()?);
    let member = |(index, (name, start))| member(args, name, start, (index, count), (endpoints, status_line, viewers));
    let members = starts.enumerate().map(member).collect::<CommandResult<Vec<_>>>()?;
    if let Some(LiveSimulation { live, .. }) = members.first() {
        let bus = if args.no_bus { "not on the bus".to_owned() } else { on_the_bus(&live.name, endpoints) };
        let bus =
            [Some(bus), viewers.place(), Nodes::place(&live.name, domain)].into_iter().flatten().collect::<Vec<_>>().join("; ");
        status_line.head(heading(live, count, &bus));
    }
    for member in &members {
        warn_of_weight(&member.live);
    }
    let spin = args.spin.unwrap_or(if count == 1 { Spin::Auto } else { Spin::NONE });
    let waking = ThreadOptions { spin, realtime: !args.no_realtime };
    let names = members.iter().map(|member| &member.live.name);
    Nodes::check(names.clone(), domain)?;
    let nodes = Nodes::start(session, names, domain, true)?;
    let reports = service::run_all(session, members, waking, shutdown).await;
    nodes.close()?;
    Ok(reports?)
}

/// The starts of all services: `count` of every scene, or a resumed session; with the name that the user or the session gave.
fn starts(args: &Args) -> CommandResult<(Option<Name>, Vec<RunStart>)> {
    if let Some(file) = &args.resume.resume {
        let (name, start) = resume::start_from(file, args.resume.at, args.name.clone(), args.publish_hz, args.until)?;
        return Ok((Some(name), vec![start.reaches(args.until)?]));
    }
    let publish = args.publish_hz.unwrap_or(PublishRate::DEFAULT.into());
    let mut all = Vec::new();
    for scene in &args.scene {
        let scene = SceneSource::open(scene, &args.overrides)?;
        let scene = if args.fixed_cost { with_fixed_cost(&scene)? } else { scene };
        for _ in 0..args.count {
            let simulation = build(&scene)?;
            all.push(RunStart { scene: scene.clone(), simulation, publish, resumption: None }.reaches(args.until)?);
        }
    }
    Ok((args.name.clone(), all))
}

/// Prepares service `index` of `count`.
fn member(
    args: &Args,
    name: Name,
    start: RunStart,
    (index, count): (usize, usize),
    (endpoints, status_line, viewers): (&[String], &StatusLine, &Viewers),
) -> CommandResult<LiveSimulation> {
    let RunStart { scene, simulation, publish, resumption } = start;
    check_levels(args, &scene)?;
    check_spare(args, count)?;
    let second = args.shadow.as_deref().map(|model| second_run(&scene, model)).transpose()?;
    let folder = Path::new(paths::FOLDER);
    let path = match (&args.record, args.no_record) {
        (_, true) => None,
        (Some(path), _) if count > 1 => Some(paths::part(path, u32::try_from(index + 1).unwrap_or(u32::MAX))),
        (Some(path), _) => Some(path.clone()),
        (None, _) => {
            must_hold_recordings(folder, "record elsewhere with --record, or not at all with --no-record")?;
            Some(paths::fresh(folder, &name.to_string(), SystemTime::now()))
        }
    };
    if let Some(first) = path.as_ref().map(|path| first_file(path, args.split)).filter(|first| first.exists()) {
        return Err(RecordingError::Exists(first).into());
    }
    let on_status = status_line.of(index, &name.to_string());
    let live = LiveOptions {
        name,
        scene,
        stepping: SteppingOptions {
            pace: args.pace,
            until_s: args.until,
            publish,
            overrun: args.overrun.into(),
            slowdown: args.slow_solver.map(|factor| Slowdown::new(factor, SLOWDOWN_SEED)),
            spare: args.spare,
        },
        record: path,
        recordings: folder.to_owned(),
        flush_period: args.flush,
        fsync: args.fsync,
        split: args.split,
        max_recording_bytes: args.max_recording_size.map(|size| size.as_u64()),
        scene_updates_hz: args.foxglove.scene_updates_hz(args.scene_updates),
        command_line: command_line(),
        on_status,
        // The name is checked already.
        force: true,
        resumed: resumption,
        endpoints: endpoints.to_vec(),
    };
    Ok(LiveSimulation { live, simulation, second, log_time: viewers.log_time(index) })
}

/// The scene at its best level, or by another model with the integrator that usually suits it.
fn second_run(scene: &SceneSource, model: &str) -> CommandResult<SecondRun> {
    if model == BEST {
        let run = BestLevelRun::new(scene).map_err(|refused| scene.refusal(refused.key, refused.to_string()))?;
        return Ok(SecondRun::BestLevel(Box::new(run)));
    }
    let kind = MODELS.iter().find(|(word, _)| *word == model).map(|(_, kind)| *kind);
    let Some(kind) = kind else {
        let words: Vec<&str> = MODELS.iter().map(|(word, _)| *word).collect();
        return Err(Failure::Usage(format!("--shadow {model}: must be one of {}, or {BEST}", words.join(", "))));
    };
    let origin = format!("--shadow {model}: {}", scene.origin);
    let scene = SceneSource { origin: origin.clone(), ..scene.clone() }.by_model(kind).map_err(|refused| {
        let by_model = refused.place.starts_with("--set ");
        if by_model { SceneError { place: origin, ..refused } } else { refused }
    })?;
    Ok(SecondRun::OtherModel(Box::new(ShadowSimulation::new(kind, build(&scene)?))))
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
fn heading(LiveOptions { scene, record, split, .. }: &LiveOptions, count: usize, bus: &str) -> String {
    let solver = &scene.scene.solver;
    let to =
        record.as_ref().map_or("not recorded".to_owned(), |path| format!("recorded to {}", first_file(path, *split).display()));
    let others = if count > 1 { format!("; and {} more", count - 1) } else { String::new() };
    format!(
        "{}: {} model, {}, step {} s; {bus}; {to}{others}",
        scene.origin,
        solver.model.as_str(),
        solver.integrator.as_str(),
        solver.step_s,
    )
}
