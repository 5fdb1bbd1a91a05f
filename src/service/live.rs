//! A live service: a simulation stepped in real time, on the bus, recorded.

use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, channel, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, SystemTime};

use super::ServiceError;
use super::desk::{Closed, Desk, OnStatus, RecordingPlan};
use super::drawing::Drawing;
use super::gaps::Gaps;
use crate::bus::{BusError, Endpoint, Name, Session, client};
use crate::recording::{self, RecordingError, Settings, Split, WhenFull, Written};
use crate::runtime::{Command, Ending, Inbox, Pace, Ports, Request, Shadow, Stepper, Stepping, inbox};
use crate::scene::SceneSource;
use crate::simulation::{Sample, Simulation, Stamp};
use crate::wire::{self, Angles, Telemetry, control};

/// Samples that may be on their way from the stepping thread at once.
const SAMPLES_ON_THE_WAY: usize = 2048;

/// What to run and how.
pub struct Live {
    /// Its name on the bus.
    pub name: Name,
    /// The scene.
    pub scene: SceneSource,
    /// Pace, end and publishing rate.
    pub stepping: Stepping,
    /// File to record to from the start, if any.
    pub record: Option<PathBuf>,
    /// Folder for recordings that are asked for by name.
    pub recordings: PathBuf,
    /// A crash loses at most what was recorded in this time.
    pub flush_period: Duration,
    /// Wait at every flush until the disk has it.
    pub fsync: bool,
    /// When the recording goes on in a new file.
    pub split: Option<Split>,
    /// How often to tell the mechanism as shapes for 3D viewers, times a second; if at all.
    pub scene_updates_hz: Option<f64>,
    /// The command line, for the recording.
    pub command_line: String,
    /// Called with every status.
    pub on_status: OnStatus,
    /// Speak under the name even if another service does.
    pub force: bool,
    /// The session that is taken up, if it is none of its own.
    pub resumed: Option<Resumption>,
}

/// A session that was recorded up to where the simulation stands now.
#[derive(Debug, Clone)]
pub struct Resumption {
    /// Wall clock at its start.
    pub started: SystemTime,
    /// Simulated time of the session at which the epoch began, s.
    pub epoch_start_s: f64,
    /// The answers to the commands taken before, so that a retry is harmless.
    pub answers: Vec<wire::CommandReply>,
    /// The recording, and where it was taken up.
    pub of: String,
}

/// How a run went.
#[derive(Debug)]
pub struct LiveReport {
    /// How it ended.
    pub ending: Ending,
    /// The last angles published, of a scene that has any.
    pub angles: Option<Angles>,
    /// The recordings it made.
    pub recordings: Vec<Result<Written, RecordingError>>,
    /// Samples and messages that full queues kept from bus or recording.
    pub dropped: u64,
}

/// Runs a simulation, and a second one beside it if given, until the scene's end, a `stop` command, divergence, or `shutdown`; leaves the bus in order.
///
/// # Errors
/// [`ServiceError`] when the name is taken, the recording cannot be made or the bus refuses.
pub async fn run(
    session: &Session,
    live: Live,
    (simulation, shadow): (Simulation, Option<Shadow>),
    shutdown: impl Future<Output = ()>,
) -> Result<LiveReport, ServiceError> {
    if !live.force && client::is_taken(session, &live.name)? {
        return Err(BusError::Taken(live.name).into());
    }
    let threads = start(session, live, simulation, shadow)?;
    let (inbox, mut over) = (threads.inbox.clone(), threads.over);
    tokio::pin!(shutdown);
    tokio::select! {
        _ = &mut over => {}
        () = &mut shutdown => stop(&inbox),
    }
    let (ending, lost) = threads.stepping.join().map_err(|_| ServiceError::Died("stepping"))?;
    let closed = threads.output.join().map_err(|_| ServiceError::Died("output"))?;
    closed.endpoint.close()?;
    let dropped = lost + inbox.counts().dropped();
    Ok(LiveReport { ending, angles: closed.angles, recordings: closed.recordings, dropped })
}

/// The threads of a running service.
struct Threads {
    inbox: Inbox,
    stepping: JoinHandle<(Ending, u64)>,
    output: JoinHandle<Closed>,
    over: tokio::sync::oneshot::Receiver<()>,
}

fn start(session: &Session, live: Live, simulation: Simulation, shadow: Option<Shadow>) -> Result<Threads, ServiceError> {
    let (inbox, commands) = inbox();
    let (to_desk, from_stepper) = channel();
    let (to_pool, pool) = sync_channel(SAMPLES_ON_THE_WAY);
    for _ in 0..SAMPLES_ON_THE_WAY {
        if to_pool.try_send(Box::new(blank(&simulation))).is_err() {
            break;
        }
    }
    let (stepping, resumed) = (live.stepping, live.resumed.clone());
    let desk = desk(session, live, &simulation, &inbox, to_pool)?;
    let ports = Ports { commands, output: to_desk, pool, counts: inbox.counts() };
    let mut stepper = Stepper::new(simulation, shadow, stepping, ports)?;
    if let Some(Resumption { epoch_start_s, answers, .. }) = resumed {
        stepper = stepper.resumed(epoch_start_s, &answers);
    }
    let (finished, over) = tokio::sync::oneshot::channel();
    let output = Builder::new().name("output".to_owned()).spawn(move || desk.serve(&from_stepper))?;
    let stepping = Builder::new().name("stepping".to_owned()).spawn(move || {
        let ending = stepper.run();
        // Nobody waits for this only when the service is being torn down.
        let _ = finished.send(());
        ending
    })?;
    Ok(Threads { inbox, stepping, output, over })
}

fn desk(
    session: &Session,
    live: Live,
    simulation: &Simulation,
    inbox: &Inbox,
    pool: SyncSender<Box<Sample>>,
) -> Result<Desk, ServiceError> {
    let mut facts = vec![("publish_hz", live.stepping.publish.to_string())];
    facts.extend(live.resumed.as_ref().map(|resumed| ("resumes", resumed.of.clone())));
    let plan = RecordingPlan {
        folder: live.recordings,
        settings: Settings {
            flush_period: live.flush_period,
            fsync: live.fsync,
            split: live.split,
            when_full: if live.stepping.pace == Pace::Max { WhenFull::Wait } else { WhenFull::Drop },
        },
        session: recording::Session {
            name: live.name.to_string(),
            scene: live.scene.text.clone(),
            started: live.resumed.as_ref().map_or_else(SystemTime::now, |resumed| resumed.started),
            command_line: live.command_line,
            facts,
        },
    };
    let recorder = live.record.map(|path| plan.start(&path)).transpose()?;
    let endpoint = Endpoint::declare(session, &live.name, &live.scene.text, Some(inbox))?;
    Ok(Desk {
        name: live.name,
        endpoint,
        telemetry: Telemetry::new(&live.scene.scene.system, simulation.start()),
        plan,
        recorder,
        pool,
        counts: inbox.counts(),
        on_status: live.on_status,
        finished: Vec::new(),
        angles: None,
        gaps: Gaps::default(),
        drawing: live.scene_updates_hz.map(Drawing::new),
        now: None,
        full: false,
    })
}

/// A sample to be filled.
fn blank(simulation: &Simulation) -> Sample {
    let stamp = Stamp { step: 0, epoch: 0, sim_time_s: 0.0, epoch_start_s: 0.0, wall: SystemTime::UNIX_EPOCH };
    Sample { stamp, driving_torque_nm: 0.0, observation: simulation.observation().clone() }
}

/// Asks the stepping thread to end.
fn stop(inbox: &Inbox) {
    let request = Request::Control(control::Action::Stop(wire::Stop {}));
    inbox.submit(Command { id: String::new(), request, reply: Box::new(|_| {}) });
}
