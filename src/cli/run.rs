//! `run`: live services, until they finish or are stopped.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::async_runtime::runtime;
use super::building::build;
use super::command_line::command_line;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::fixed_cost::with_fixed_cost;
use super::folders::{must_have_folder, must_hold_recordings, must_suit_recording};
use super::foxglove::Viewers;
use super::resume::{self, ResumeArgs, RunStart};
use super::ros2_args::Nodes;
use super::run_args::{Args, BEST};
use super::run_conclusion::{conclude, step_remedy};
use super::run_levels::{check_levels, check_spare};
use super::service_names::{ServiceNames, on_the_bus};
use super::short_load::ShortLoad;
use super::signals::{Interruption, interrupted};
use super::status_line::StatusLine;
use super::supervise::supervise;
use super::suspect_numbers::suspect_numbers;
use crate::bus::{self, BusOptions, Name, Session};
use crate::nearest::did_you_mean;
use crate::recording::{RecordingError, Split, paths};
use crate::resimulation::BestLevelRun;
use crate::runtime::{Ending, Pace, ShadowSimulation, Slowdown, Spin, SteppingOptions, ThreadOptions};
use crate::scene::{IntegratorKind, MODELS, ModelKind, SceneError, SceneSource};
use crate::service::{self, LiveOptions, LiveReport, LiveSimulation, SecondRun};
use crate::simulation::PublishRate;

/// The random times of `--slow-solver` are the same in each run.
const SLOWDOWN_SEED: u64 = 17;
pub(super) fn run(mut args: Args) -> CommandResult {
    Viewers::check(args.foxglove)?;
    args.resume.check()?;
    check_asked(&args)?;
    if args.supervise {
        if args.scene.len() > 1 {
            return Err(Failure::Usage("--supervise runs one service: give one scene".to_owned()));
        }
        let Some(record) = args.supervised_record.take() else {
            if args.max_recording_size.is_some() {
                say!(
                    "once --max-recording-size has stopped the recording, --supervise brings the session back to there, without \
                     what followed"
                );
            }
            return supervise(&args);
        };
        args.record = Some(record);
        end_with_parent()?;
        if let Some(file) = args.supervised_resume.take() {
            args.resume = ResumeArgs { resume: Some(file), at: None };
        }
    }
    if let Some(path) = &args.record {
        must_suit_recording(path)?;
        must_have_folder(path)?;
    }
    // While the scenes are prepared, and `--fixed-cost` rates them, a signal ends the process: nothing is to be kept.
    let preparing = Interruption::watch()?;
    let (fixed, starts) = starts(&args)?;
    tell_endless(&args);
    let remedy = step_remedy(starts.iter().map(|start| &start.scene.scene));
    let bus = BusOptions { isolated: args.no_bus, gossip: args.ros2.ros2.is_some(), ..args.bus.options() };
    let status_line = StatusLine::new(starts.len(), args.until);
    let was_interrupted = Cell::new(false);
    let runtime = runtime()?;
    // From here on, before anything is recorded, a signal no longer ends the process by itself.
    let signal = {
        let _context = runtime.enter();
        interrupted()
    };
    drop(preparing);
    let reports = runtime.block_on(async {
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
    let done = conclude(&reports, &status_line.warnings(), remedy, args.fixed_cost);
    let unfinished = reports.iter().any(|report| report.ending == Ending::Stopped);
    let early = args.until.is_some() && was_interrupted.get() && unfinished;
    if early {
        say_reason!("interrupted before --until");
    }
    Ok(if early && done == ExitStatus::Success { ExitStatus::Interrupted } else { done })
}

/// Tells of a run that computes as fast as it can, and never ends by itself.
fn tell_endless(args: &Args) {
    if args.pace == Pace::Max && args.until.is_none() && args.resume.resume.is_none() {
        say!("warning: --pace max without --until keeps computing until it is stopped, as by Ctrl-C");
    }
}

/// Tells of a shadow whose difference goes nowhere.
fn tell_unseen(args: &Args) {
    let is_seen = !args.no_bus || !args.no_record || args.foxglove.is_given();
    if !is_seen {
        say!("warning: with --no-bus and --no-record, nobody sees the difference that --shadow computes");
    }
}

/// Refuses a run for whose steps nobody can ask.
fn check_asked(args: &Args) -> CommandResult<()> {
    if args.no_bus && args.pace == Pace::Lockstep && !args.foxglove.has_control() {
        let problem = "--pace lockstep takes the steps that clients ask for, and with --no-bus nobody can ask: give another pace, \
                       such as max";
        return Err(Failure::Usage(problem.to_owned()));
    }
    Ok(())
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
        warn_of_short_load(&member.live);
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
        let whose = if args.scene.len() > 1 { format!("{scene}: ") } else { String::new() };
        let scene = SceneSource::open(scene, &args.overrides).map_err(|refused| of_scene(&whose, refused))?;
        suspect_numbers(&scene).iter().for_each(|warning| say!("warning: {whose}{warning}"));
        let scene = if args.fixed_cost { with_fixed_cost(&scene)? } else { scene };
        for _ in 0..args.count {
            let simulation = build(&scene)?;
            all.push(RunStart { scene: scene.clone(), simulation, publish, resumption: None }.reaches(args.until)?);
        }
    }
    Ok((args.name.clone(), all))
}

/// The refusal of an override by one of several scenes, with the scene; `whose` is empty for a single one.
fn of_scene(whose: &str, refused: SceneError) -> SceneError {
    let by_override = refused.place.starts_with("--set ");
    if by_override { SceneError { place: format!("{whose}{}", refused.place), ..refused } } else { refused }
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
    if second.is_some() && index == 0 {
        tell_unseen(args);
    }
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
    // No chain has the model of oscillators.
    let is_chain = scene.scene.chain().is_some();
    let models = || MODELS.iter().filter(move |(_, kind)| !is_chain || *kind != ModelKind::MassSpring);
    let kind = models().find(|(word, _)| *word == model).map(|(_, kind)| *kind);
    let Some(kind) = kind else {
        let words: Vec<&str> = models().map(|(word, _)| *word).collect();
        let near = did_you_mean(model, words.iter().copied().chain([BEST]));
        return Err(Failure::Usage(format!("--shadow {model}: must be one of {}, or {BEST}{near}", words.join(", "))));
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

/// Warns of a step that is too long for the resistance on the slider.
fn warn_of_short_load(live: &LiveOptions) {
    if let Some(warning) = ShortLoad::warning_of(&live.scene) {
        tracing::warn!(scene = live.scene.origin, "{warning}");
    }
}

/// The heading for the first of `count` services. A resumed session begins at the level that was in force.
fn heading(LiveOptions { scene, record, split, resumed, .. }: &LiveOptions, count: usize, bus: &str) -> String {
    let level = resumed.as_ref().map_or(0, |resumed| resumed.level);
    // A level whose changes are refused is refused where the service begins.
    let in_force = scene.at_level(level).unwrap_or_else(|_| scene.clone());
    let solver = &in_force.scene.solver;
    let name = scene.scene.levels.get(level).filter(|_| level > 0).map(|level| format!("level {}, ", level.name));
    let to =
        record.as_ref().map_or("not recorded".to_owned(), |path| format!("recorded to {}", first_file(path, *split).display()));
    let others = if count > 1 { format!("; and {} more", count - 1) } else { String::new() };
    format!(
        "{}: {}{} model, {}, step {} s; {bus}; {to}{others}",
        scene.origin,
        name.unwrap_or_default(),
        solver.model.as_str(),
        solver.integrator.as_str(),
        solver.step_s,
    )
}
