//! Live services: simulations stepped in real time, published on the bus and recorded.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::{Builder, JoinHandle, available_parallelism};
use std::time::{Duration, SystemTime};

use tokio::sync::oneshot;

use super::ServiceError;
use super::advance_answers::AdvanceAnswers;
use super::beside::Beside;
use super::best_level::BestLevelThread;
use super::drop_ledger::DropLedger;
use super::live_modes::ModesService;
use super::output_thread::serve;
use super::output_worker::{Closed, OnStatus, OutputStatistics, OutputWorker, RecordingHistory, RecordingTarget};
use super::scene_changer::SceneChanger;
use super::scene_update_timer::SceneUpdateTimer;
use crate::bus::{self, About, BusError, LogTime, Name, ServiceEndpoint, Session, client};
use crate::recording::{self, RecordingError, Settings, Split, WhenFull, Written};
use crate::resimulation::BestLevelRun;
use crate::runtime::{
    Action, Command, Ending, Finish, Inbox, Ladder, Outbox, Output, Pace, Ports, Reply, Request, RunSummary, SceneInForce,
    ShadowSimulation, Spin, Stepper, SteppingOptions, ThreadOptions, inbox, run_stepping_thread,
};
use crate::scene::{SceneAtLevel, SceneSource};
use crate::simulation::{EnergyVerdict, PassedLoad, PerTelemetry, PublishRates, Sample, Simulation};
use crate::wire::{Angles, Displacements};

/// Samples in flight from one simulation, if few run.
const MOST_SAMPLES: usize = 2048;
/// Samples in flight from all simulations of the process.
const SAMPLES_IN_TOTAL: usize = 32_768;
/// Fewest samples in flight from one simulation.
const FEWEST_SAMPLES: usize = 128;

/// Options of a live service.
pub struct LiveOptions {
    /// Name on the bus.
    pub name: Name,
    /// The scene.
    pub scene: SceneSource,
    /// Pace, end and publishing rates.
    pub stepping: SteppingOptions,
    /// File to record to from the start, if any.
    pub record: Option<PathBuf>,
    /// Folder of recordings that a command starts.
    pub recordings: PathBuf,
    /// A crash loses at most what was recorded in this time.
    pub flush_period: Duration,
    /// At every flush, wait until the data is on the disk.
    pub fsync: bool,
    /// When the recording continues in a new file.
    pub split: Option<Split>,
    /// Size limit of a recording, all parts together.
    pub max_recording_bytes: Option<u64>,
    /// Rate of scene updates, shapes for 3D viewers; `None` publishes none.
    pub scene_updates_hz: Option<f64>,
    /// The command line, for the recording.
    pub command_line: String,
    /// Called with every status message.
    pub on_status: OnStatus,
    /// Use the name even if another service has it.
    pub force: bool,
    /// The session to resume, if any.
    pub resumed: Option<Resumption>,
    /// Endpoints that the session listens on, for [`About`].
    pub endpoints: Vec<String>,
}

/// A recorded session to resume.
#[derive(Debug, Clone)]
pub struct Resumption {
    /// Wall clock at the start of the session.
    pub started: SystemTime,
    /// Session time at which the epoch began, s.
    pub epoch_start_s: f64,
    /// Level of the scene in force, from 0.
    pub level: usize,
    /// Replies to the commands accepted before, so that a retry is not applied again.
    pub answers: Vec<Reply>,
    /// Topics on which the sample of the instant to begin at is published: the recording lacks it.
    pub missing: PerTelemetry<bool>,
    /// The recording, and where the session resumes.
    pub of: String,
}

/// The result of a run.
#[derive(Debug)]
pub struct LiveReport {
    /// The service.
    pub name: Name,
    /// The end of the run.
    pub ending: Ending,
    /// The last published angles, if the scene has any.
    pub angles: Option<Angles>,
    /// The last published displacements.
    pub displacements: Option<Displacements>,
    /// The recordings made.
    pub recordings: Vec<Result<Written, RecordingError>>,
    /// Verdict on the energy balance of all epochs.
    pub verdict: EnergyVerdict,
    /// Steps of fixed cost that left more than the scene's tolerance.
    pub unconverged: u64,
    /// Largest published slope of a link from its chord that exceeded the model's range, rad; 0 if none did.
    pub worst_out_of_range: f64,
    /// The load that a crank under a torque passed in the fewest steps, if in few.
    pub passed_load: Option<PassedLoad>,
    /// Samples and messages that full queues dropped from bus or recording.
    pub dropped: u64,
    /// Commands accepted from the bus.
    pub commands_accepted: u64,
    /// Messages encoded because a topic had subscribers or was recorded.
    pub encoded: u64,
}

/// A simulation to run.
pub struct LiveSimulation {
    /// Its options.
    pub live: LiveOptions,
    /// The simulation, at its start.
    pub simulation: Simulation,
    /// A second run on the same commands, whose difference is published.
    pub second: Option<SecondRun>,
    /// Receives the log time of every message, for viewers in this process.
    pub log_time: Option<LogTime>,
}

/// A second run beside the first.
pub enum SecondRun {
    /// By another model, step by step with the first, on its thread.
    OtherModel(Box<ShadowSimulation>),
    /// At the best level of the scene, on a thread of its own.
    BestLevel(Box<BestLevelRun>),
}

/// Runs a simulation without real-time scheduling or busy-waiting; see [`run_all`].
///
/// # Errors
/// [`ServiceError`] if the name is taken, the recording cannot be created or the bus refuses.
pub async fn run(
    session: &Session,
    live: LiveOptions,
    (simulation, second): (Simulation, Option<SecondRun>),
    shutdown: impl Future<Output = ()>,
) -> Result<LiveReport, ServiceError> {
    let waking = ThreadOptions { spin: Spin::NONE, realtime: false };
    let mut reports =
        run_all(session, vec![LiveSimulation { live, simulation, second, log_time: None }], waking, shutdown).await?;
    reports.pop().ok_or(ServiceError::Died("stepping"))
}

/// Runs simulations under one session, each until its scene's end, a `stop` command, divergence, or `shutdown`; leaves the bus in
/// order. There are as many stepping threads as processors, and as many output threads.
///
/// # Errors
/// [`ServiceError`] if a name is taken, a recording cannot be created or the bus refuses.
pub async fn run_all(
    session: &Session,
    members: Vec<LiveSimulation>,
    waking: ThreadOptions,
    shutdown: impl Future<Output = ()>,
) -> Result<Vec<LiveReport>, ServiceError> {
    let wary: Vec<&Name> = members.iter().filter(|member| !member.live.force).map(|member| &member.live.name).collect();
    if let Some(taken) = client::first_taken(session, &wary)? {
        return Err(BusError::Taken(taken).into());
    }
    let (runs, threads) = start(session, members, waking)?;
    let inboxes: Vec<Inbox> = runs.iter().map(|run| run.inbox.clone()).collect();
    let all = async {
        let mut reports = Vec::with_capacity(runs.len());
        for run in runs {
            reports.push(run.report().await?);
        }
        Ok(reports)
    };
    tokio::pin!(all, shutdown);
    let reports = tokio::select! {
        reports = &mut all => reports,
        () = &mut shutdown => {
            inboxes.iter().for_each(stop);
            all.await
        }
    };
    for (what, thread) in threads {
        thread.join().map_err(|_| ServiceError::Died(what))?;
    }
    reports
}

/// Handles to a running simulation.
struct RunningSimulation {
    name: Name,
    inbox: Inbox,
    ended: oneshot::Receiver<RunSummary>,
    closed: oneshot::Receiver<Closed>,
}

impl RunningSimulation {
    async fn report(self) -> Result<LiveReport, ServiceError> {
        let RunSummary { ending, dropped: lost, verdict, unconverged, worst_out_of_range, passed_load } =
            self.ended.await.map_err(|_| ServiceError::Died("stepping"))?;
        let closed = self.closed.await.map_err(|_| ServiceError::Died("output"))?;
        closed.left?;
        let dropped = lost + self.inbox.shared().dropped();
        let Closed { angles, displacements, recordings, commands_accepted, encoded, .. } = closed;
        Ok(LiveReport {
            name: self.name,
            ending,
            verdict,
            unconverged,
            worst_out_of_range,
            passed_load,
            angles,
            displacements,
            recordings,
            dropped,
            commands_accepted,
            encoded,
        })
    }
}

/// Threads with their purposes.
type Threads = Vec<(&'static str, JoinHandle<()>)>;

fn start(
    session: &Session,
    members: Vec<LiveSimulation>,
    waking: ThreadOptions,
) -> Result<(Vec<RunningSimulation>, Threads), ServiceError> {
    let groups = available_parallelism().map_or(1, NonZeroUsize::get).min(members.len()).max(1);
    let samples = (SAMPLES_IN_TOTAL / members.len().max(1)).clamp(FEWEST_SAMPLES, MOST_SAMPLES);
    let mut runs = Vec::with_capacity(members.len());
    let mut group: Vec<Group> = (0..groups).map(|_| Group::new()).collect();
    for (number, member) in members.into_iter().enumerate() {
        runs.push(group[number % groups].take(session, member, samples)?);
    }
    let mut threads = Threads::new();
    for Group { steppers, workers, outputs, .. } in group {
        let output = move || serve(workers, &outputs);
        threads.push(("output", Builder::new().name("output".to_owned()).spawn(output)?));
        threads
            .push(("stepping", Builder::new().name("stepping".to_owned()).spawn(move || run_stepping_thread(steppers, waking))?));
    }
    Ok((runs, threads))
}

/// Simulations that share a stepping thread and an output thread.
struct Group {
    steppers: Vec<(Stepper, Finish)>,
    workers: Vec<(OutputWorker, oneshot::Sender<Closed>)>,
    output: Sender<(usize, Output)>,
    outputs: Receiver<(usize, Output)>,
}

impl Group {
    fn new() -> Self {
        let (output, outputs) = channel();
        Group { steppers: Vec::new(), workers: Vec::new(), output, outputs }
    }

    fn take(&mut self, session: &Session, member: LiveSimulation, samples: usize) -> Result<RunningSimulation, ServiceError> {
        let LiveSimulation { mut live, simulation, second, log_time } = member;
        let (shadow, best_level) = match second {
            Some(SecondRun::OtherModel(shadow)) => (Some(*shadow), None),
            Some(SecondRun::BestLevel(run)) => (None, Some(BestLevelThread::start(*run)?)),
            None => (None, None),
        };
        let (inbox, commands) = inbox();
        let (to_pool, pool) = sync_channel(samples);
        for _ in 0..samples {
            if to_pool.try_send(Arc::new(simulation.blank_sample())).is_err() {
                break;
            }
        }
        if live.scene.scene.chain().is_none() {
            // The mean torque follows the displacements.
            let PublishRates { displacements, energies, .. } = live.stepping.publish;
            live.stepping.publish = PublishRates { energies, ..displacements.into() };
        }
        let (name, stepping, resumed) = (live.name.clone(), live.stepping, live.resumed.clone());
        let changer = SceneChanger::new(&inbox, live.scene.clone(), shadow.as_ref().map(ShadowSimulation::model));
        let level = live.resumed.as_ref().map_or(0, |resumed| resumed.level);
        let source = live.scene.at_level(level).map_err(|refused| ServiceError::Scene(refused.to_string()))?;
        let scene = SceneAtLevel { base: live.scene.clone(), level, source };
        let ladder = Ladder::of_running(&scene, &simulation).map_err(ServiceError::Scene)?;
        let in_force = Arc::clone(ladder.in_force());
        let mut output_worker = output_worker(session, live, in_force, (&inbox, changer), to_pool)?;
        output_worker.beside.best_level = best_level;
        output_worker.endpoint = output_worker.endpoint.with_log_time(log_time);
        let output = Outbox::new(self.output.clone(), self.workers.len());
        let ports = Ports { commands, output, pool, shared: inbox.shared() };
        let mut stepper = Stepper::new(simulation, shadow, stepping, ports)?.with_ladder(ladder);
        if let Some(Resumption { epoch_start_s, answers, missing, .. }) = resumed {
            stepper = stepper.resumed(epoch_start_s, &answers, missing);
        }
        let (finish, ended) = oneshot::channel();
        let (close, closed) = oneshot::channel();
        // The receivers are gone only if the service is being torn down.
        self.steppers.push((stepper, Box::new(move |ended| drop(finish.send(ended)))));
        self.workers.push((output_worker, close));
        Ok(RunningSimulation { name, inbox, ended, closed })
    }
}

fn output_worker(
    session: &Session,
    live: LiveOptions,
    in_force: Arc<SceneInForce>,
    (inbox, changer): (&Inbox, SceneChanger),
    pool: SyncSender<Arc<Sample>>,
) -> Result<OutputWorker, ServiceError> {
    let mut facts = vec![("publish_hz", live.stepping.publish.to_string())];
    facts.extend((live.stepping.pace == Pace::Lockstep).then(|| ("pace", "lockstep".to_owned())));
    facts.extend(live.resumed.as_ref().map(|resumed| ("resumes", resumed.of.clone())));
    let target = RecordingTarget {
        folder: live.recordings,
        settings: Settings {
            flush_period: live.flush_period,
            fsync: live.fsync,
            split: live.split,
            limit_bytes: live.max_recording_bytes,
            when_full: match live.stepping.pace {
                Pace::Max | Pace::Lockstep => WhenFull::Wait,
                Pace::Factor(_) => WhenFull::Drop,
            },
        },
        session: recording::SessionInfo {
            name: live.name.to_string(),
            scene: live.scene.text.clone(),
            started: live.resumed.as_ref().map_or_else(SystemTime::now, |resumed| resumed.started),
            command_line: live.command_line,
            facts,
        },
    };
    let recorder = live.record.map(|path| target.start(&path)).transpose()?;
    let changer = Arc::new(changer);
    let commands = bus::service_commands(session, &live.name, inbox, move |command| changer.submit(command))?;
    let about = About::new(&live.scene.origin, &live.endpoints);
    let modes = ModesService::new(in_force.scene.source.scene.clone(), inbox.shared());
    let mut endpoint = ServiceEndpoint::declare(session, &live.name, (&in_force.scene.source.text, &about), commands)?;
    let answering = Arc::clone(&modes);
    endpoint.take_questions_for_modes(session, &live.name, move |question| answering.take(question))?;
    Ok(OutputWorker {
        name: live.name,
        endpoint,
        in_force,
        target,
        recorder,
        pool,
        shared: inbox.shared(),
        on_status: live.on_status,
        recordings: RecordingHistory::default(),
        beside: Beside { modes, best_level: None },
        statistics: OutputStatistics::new()?,
        replies_after_status: Vec::new(),
        drops: DropLedger::default(),
        advances: AdvanceAnswers::default(),
        scene_update_timer: live.scene_updates_hz.map(SceneUpdateTimer::new),
        last_stamp: None,
    })
}

/// Stops the run.
fn stop(inbox: &Inbox) {
    inbox.submit(Command { id: String::new(), request: Request::Control(Action::Stop), reply: Box::new(|_| {}), change: None });
}
