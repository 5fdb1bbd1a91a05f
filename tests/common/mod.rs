//! A service in this process, a client beside it, and what was recorded.
#![allow(dead_code, clippy::unwrap_used, reason = "each test binary uses its own part; a test may fail")]

pub mod process;
pub mod rewritten;

use std::collections::HashMap;
use std::error::Error;
use std::net::TcpListener;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use flexcrank::bus::{self, BusError, BusOptions, Name, Session, Topic, client};
use flexcrank::recording::Messages;
use flexcrank::runtime::{Pace, SteppingOptions};
use flexcrank::scene::SceneSource;
use flexcrank::service::{self, LiveOptions, LiveReport, Resumption, SecondRun, ServiceError};
use flexcrank::simulation::{PublishRate, Simulation};
use flexcrank::wire;
use tempfile::TempDir;

pub type Outcome<T = ()> = Result<T, Box<dyn Error>>;

/// The default scene, run by the rigid model, with overrides.
pub fn scene(overrides: &[&str]) -> Result<SceneSource, Box<dyn Error>> {
    let overrides: Vec<String> = ["solver.model=rigid", "solver.integrator=runge-kutta", "solver.step_s=0.001"]
        .iter()
        .chain(overrides)
        .map(|&o| o.to_owned())
        .collect();
    Ok(SceneSource::open("crank-slider", &overrides)?)
}

/// Two sessions that are linked over a loopback port of their own.
pub fn linked_sessions() -> Result<(Session, Session), Box<dyn Error>> {
    loop {
        let address = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
        let endpoint = vec![format!("tcp/{address}")];
        let options = BusOptions { listen: endpoint.clone(), sees_subscriptions: true, ..BusOptions::default() };
        let service = match options.open_service() {
            // Another test has taken the port meanwhile.
            Err(BusError::InUse(_)) => continue,
            opened => opened?,
        };
        let client = BusOptions { connect: endpoint, ..BusOptions::default() }.open_client()?;
        return Ok((service, client));
    }
}

/// Options of a service that runs a scene in real time without end, named `test` and not recorded.
pub fn live(scene: SceneSource, folder: &Path) -> Result<LiveOptions, Box<dyn Error>> {
    Ok(LiveOptions {
        name: "test".parse()?,
        scene,
        stepping: SteppingOptions::default(),
        record: None,
        recordings: folder.to_owned(),
        flush_period: Duration::from_millis(200),
        fsync: false,
        split: None,
        max_recording_bytes: None,
        scene_updates_hz: None,
        command_line: "test".to_owned(),
        on_status: Box::new(|_| {}),
        force: false,
        resumed: None,
        endpoints: Vec::new(),
    })
}

/// A running service and a client that has found it.
pub struct Service {
    pub name: Name,
    pub client: Session,
    thread: JoinHandle<Result<LiveReport, ServiceError>>,
    folder: TempDir,
}

impl Service {
    pub fn start(scene: SceneSource, pace: Pace, until_s: Option<f64>, publish: PublishRate) -> Result<Self, Box<dyn Error>> {
        Self::start_in(tempfile::tempdir()?, scene, pace, until_s, publish)
    }

    pub fn start_in(
        folder: TempDir,
        scene: SceneSource,
        pace: Pace,
        until_s: Option<f64>,
        publish: PublishRate,
    ) -> Result<Self, Box<dyn Error>> {
        Self::start_with(folder, scene, None, pace, until_s, publish)
    }

    pub fn start_with(
        folder: TempDir,
        scene: SceneSource,
        second: Option<SecondRun>,
        pace: Pace,
        until_s: Option<f64>,
        publish: PublishRate,
    ) -> Result<Self, Box<dyn Error>> {
        let simulation = Simulation::new(&scene.scene)?;
        Self::launch(
            folder,
            scene,
            (simulation, second),
            SteppingOptions { pace, until_s, publish: publish.into(), ..SteppingOptions::default() },
            |_| {},
        )
    }

    /// Starts a service with changed options.
    pub fn start_as(
        folder: TempDir,
        scene: SceneSource,
        pace: Pace,
        until_s: Option<f64>,
        change: impl FnOnce(&mut LiveOptions),
    ) -> Result<Self, Box<dyn Error>> {
        let simulation = Simulation::new(&scene.scene)?;
        Self::launch(folder, scene, (simulation, None), SteppingOptions { pace, until_s, ..SteppingOptions::default() }, change)
    }

    /// Resumes a recorded session, unpaced.
    pub fn resume(
        scene: SceneSource,
        simulation: Simulation,
        resumption: Resumption,
        until_s: f64,
        publish: PublishRate,
    ) -> Result<Self, Box<dyn Error>> {
        let stepping =
            SteppingOptions { pace: Pace::Max, until_s: Some(until_s), publish: publish.into(), ..SteppingOptions::default() };
        Self::launch(tempfile::tempdir()?, scene, (simulation, None), stepping, |live| live.resumed = Some(resumption))
    }

    /// Resumes a recorded session in lock-step.
    pub fn resume_in_lockstep(
        scene: SceneSource,
        simulation: Simulation,
        resumption: Resumption,
    ) -> Result<Self, Box<dyn Error>> {
        let stepping = SteppingOptions { pace: Pace::Lockstep, publish: PublishRate::All.into(), ..SteppingOptions::default() };
        Self::launch(tempfile::tempdir()?, scene, (simulation, None), stepping, |live| live.resumed = Some(resumption))
    }

    fn launch(
        folder: TempDir,
        scene: SceneSource,
        simulations: (Simulation, Option<SecondRun>),
        stepping: SteppingOptions,
        change: impl FnOnce(&mut LiveOptions),
    ) -> Result<Self, Box<dyn Error>> {
        let (session, client) = linked_sessions()?;
        let name: Name = "test".parse()?;
        let mut live = LiveOptions {
            name: name.clone(),
            stepping,
            record: Some(folder.path().join("run.mcap")),
            ..live(scene, folder.path())?
        };
        change(&mut live);
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
        let thread = std::thread::spawn(move || {
            let report = runtime.block_on(service::run(&session, live, simulations, std::future::pending()));
            bus::close(&session)?;
            report
        });
        if stepping.until_s.is_none() {
            client::wait_for_service(&client, &name)?;
        }
        Ok(Service { name, client, thread, folder })
    }

    /// Asks it to stop and waits.
    pub fn stop(self) -> Result<(LiveReport, TempDir), Box<dyn Error>> {
        let stop = wire::Control { id: String::new(), action: Some(wire::control::Action::Stop(wire::Stop {})) };
        assert!(client::control(&self.client, &self.name, &stop)?.accepted);
        self.finish()
    }

    /// Waits until it ends by itself.
    pub fn finish(self) -> Result<(LiveReport, TempDir), Box<dyn Error>> {
        let report = self.thread.join().map_err(|_| "the service panicked")??;
        bus::close(&self.client)?;
        Ok((report, self.folder))
    }
}

/// Payloads of one topic of a recording, in file order.
pub fn payloads(file: &Path, chunk: &str) -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let mut found = Vec::new();
    for message in Messages::open(file)? {
        let message = message?;
        if message.channel.topic.rsplit('/').next() == Some(chunk) {
            found.push(message.data.to_vec());
        }
    }
    Ok(found)
}

pub fn decoded<M: prost::Message + Default>(file: &Path, chunk: &str) -> Result<Vec<M>, Box<dyn Error>> {
    payloads(file, chunk)?.iter().map(|bytes| Ok(M::decode(bytes.as_slice())?)).collect()
}

pub fn log_times(file: &Path) -> Result<Vec<u64>, Box<dyn Error>> {
    Messages::open(file)?.map(|message| Ok(message?.log_time)).collect()
}

pub fn time_s(stamp: &Option<wire::Stamp>) -> f64 {
    stamp.as_ref().map_or(f64::NAN, |stamp| stamp.sim_time_s)
}

/// Everything that a service publishes, byte for byte.
pub struct Listener {
    heard: Arc<Mutex<HashMap<String, Vec<Vec<u8>>>>>,
}

impl Listener {
    pub fn new(session: &Session, name: &Name) -> Result<Self, Box<dyn Error>> {
        use zenoh::Wait;
        let heard: Arc<Mutex<HashMap<String, Vec<Vec<u8>>>>> = Arc::default();
        let keep = Arc::clone(&heard);
        session
            .declare_subscriber(format!("{}/*", name.presence()))
            .callback(move |sample| {
                let key = sample.key_expr().as_str().to_owned();
                keep.lock().unwrap().entry(key).or_default().push(sample.payload().to_bytes().into_owned());
            })
            .background()
            .wait()
            .map_err(|error| error.to_string())?;
        Ok(Listener { heard })
    }

    pub fn payloads(&self, topic: Topic) -> Vec<Vec<u8>> {
        let suffix = format!("/{}", topic.chunk());
        let heard = self.heard.lock().unwrap();
        heard.iter().find(|(key, _)| key.ends_with(&suffix)).map(|(_, all)| all.clone()).unwrap_or_default()
    }

    /// Waits until `count` messages of a topic have come.
    pub fn wait_for(&self, topic: Topic, count: usize, patience: Duration) -> Outcome {
        let begun = Instant::now();
        while self.payloads(topic).len() < count {
            if begun.elapsed() > patience {
                return Err(format!(
                    "{} of {count} messages of {topic:?} at {:?}",
                    self.payloads(topic).len(),
                    SystemTime::now()
                )
                .into());
            }
            std::thread::yield_now();
        }
        Ok(())
    }
}
