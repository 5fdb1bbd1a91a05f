//! The server: it joins feeds, services, parameters and timeline, and lives as long as the services it shows.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use ::foxglove::websocket::Capability;
use ::foxglove::{Context, WebSocketServerHandle};
use prost::Message as _;

use super::FoxgloveError;
use super::commander::Commander;
use super::feed::Feed;
use super::jobs::Jobs;
use super::listener::Listener;
use super::parameters::{SceneParameters, in_force};
use super::playback::Timeline;
use super::services::{JSON, services};
use super::source::Source;
use super::status_log::StatusLog;
use crate::bus::{self, LogTime, Name, OwnSubscription, Session};
use crate::wire::AppliedCommand;

/// Messages that wait for a slow viewer; the oldest are dropped for newer ones.
const BACKLOG: usize = 4096;
/// Time in which the last messages are sent.
const LAST_MESSAGES: Duration = Duration::from_millis(100);
/// Time in which connections are closed in order; then they are cut.
const CLOSING: Duration = Duration::from_millis(500);

/// Options of the server.
#[derive(Debug, Clone, Copy)]
pub struct ServerOptions {
    /// Address to listen on; port 0 is any free one.
    pub address: SocketAddr,
    /// Whether viewers may send commands.
    pub control: bool,
}

/// The handle of the running server, once it runs.
type Handle = Arc<Mutex<Option<WebSocketServerHandle>>>;

/// A server for Foxglove and Lichtblick.
pub struct FoxgloveServer {
    handle: Handle,
    address: SocketAddr,
    /// Owns the channels: they close with it.
    context: Arc<Context>,
    jobs: Jobs,
    thread: JoinHandle<()>,
    subscriptions: Vec<OwnSubscription>,
}

impl FoxgloveServer {
    /// Starts a server that shows services of `session`; with a timeline, one that viewers move.
    ///
    /// # Errors
    /// [`FoxgloveError`] if the address is taken, or the system or the bus refuses.
    pub async fn start(
        session: &Session,
        options: ServerOptions,
        sources: Vec<Source>,
        timeline: Option<Timeline>,
    ) -> Result<Self, FoxgloveError> {
        let context = Context::new();
        let names: Arc<[Name]> = sources.iter().map(|source| source.name.clone()).collect();
        let (handle, timeline): (Handle, _) = (Handle::default(), timeline.map(Arc::new));
        let log_times: Vec<LogTime> = sources.iter().map(|source| source.log_time.clone()).collect();
        let (mut feeds, mut logs) = (Vec::new(), Vec::new());
        for Source { name, log_time, topics } in sources {
            logs.push((name.clone(), StatusLog::new(&context, &name, log_time.clone())));
            for topic in topics {
                feeds.push(Feed::new(&context, topic, log_time.clone())?);
            }
        }
        let (following, mut clock) = (session.clone(), Clock::new(log_times, Arc::clone(&handle)));
        let (jobs, thread) = Jobs::start(move || {
            feeds.iter_mut().for_each(|feed| feed.follow_viewers(&following));
            clock.tick();
        })?;
        let commander = Commander::new(session.clone(), jobs.clone(), options.control);
        let mut subscriptions = Vec::new();
        for (name, log) in logs {
            subscriptions.push(follow_status(session, &name, log, (timeline.clone(), &handle))?);
            subscriptions.push(follow_changes(&commander, &name, &handle)?);
        }
        let all_services = names.iter().flat_map(|name| services(&commander, name)).collect::<Vec<_>>();
        let mut server = context
            .websocket_server()
            .name("flexcrank")
            .bind(host(options.address), options.address.port())
            .message_backlog_size(BACKLOG)
            .capabilities([Capability::ClientPublish, Capability::Time])
            .supported_encodings([JSON, "protobuf"])
            .services(all_services)
            .parameter_handler(Arc::new(SceneParameters::new(commander.clone(), Arc::clone(&names))));
        if let Some(timeline) = &timeline {
            let (first_ns, last_ns) = timeline.span_ns();
            server = server.playback_time_range(first_ns, last_ns);
        }
        let running = server.listener(Arc::new(Listener { commander, names, timeline })).start().await;
        let running = running.map_err(|error| FoxgloveError::of_start(options.address, error))?;
        let address = SocketAddr::new(options.address.ip(), running.port());
        *lock(&handle) = Some(running);
        Ok(FoxgloveServer { handle, address, context, jobs, thread, subscriptions })
    }

    /// The address that it listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sends the last messages, closes the connections and ends.
    ///
    /// # Errors
    /// [`FoxgloveError`] if the bus refuses.
    pub async fn stop(self) -> Result<(), FoxgloveError> {
        for subscription in self.subscriptions {
            subscription.close()?;
        }
        let running = lock(&self.handle).take();
        if let Some(running) = running {
            if running.client_count() > 0 {
                tokio::time::sleep(LAST_MESSAGES).await;
            }
            // The connection of a viewer that is stopped is cut.
            let _ = tokio::time::timeout(CLOSING, running.stop().wait()).await;
        }
        drop(self.context);
        self.jobs.end();
        self.thread.join().map_err(|_| FoxgloveError::Thread(std::io::Error::other("it died")))
    }
}

/// The host of an address, as it stands before a port.
fn host(address: SocketAddr) -> String {
    match address {
        SocketAddr::V4(address) => address.ip().to_string(),
        SocketAddr::V6(address) => format!("[{}]", address.ip()),
    }
}

fn lock(handle: &Handle) -> MutexGuard<'_, Option<WebSocketServerHandle>> {
    handle.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Calls `act` with the running server, if it runs.
fn with_server(handle: &Handle, act: impl FnOnce(&WebSocketServerHandle)) {
    if let Some(server) = lock(handle).as_ref() {
        act(server);
    }
}

/// The viewers' clock: the log time of the newest message.
struct Clock {
    log_times: Vec<LogTime>,
    handle: Handle,
    shown_ns: u64,
}

impl Clock {
    fn new(log_times: Vec<LogTime>, handle: Handle) -> Self {
        Clock { log_times, handle, shown_ns: 0 }
    }

    /// Sends the time to the viewers if it has changed.
    fn tick(&mut self) {
        let now_ns = self.log_times.iter().map(LogTime::get).max().unwrap_or(0);
        if now_ns != self.shown_ns {
            with_server(&self.handle, |server| server.broadcast_time(now_ns));
            self.shown_ns = now_ns;
        }
    }
}

/// Follows the status of a service: its log, and the timeline of a replay.
fn follow_status(
    session: &Session,
    name: &Name,
    log: StatusLog,
    (timeline, handle): (Option<Arc<Timeline>>, &Handle),
) -> Result<OwnSubscription, FoxgloveError> {
    let handle = Arc::clone(handle);
    let follow = move |payload: &[u8]| {
        log.follow(payload);
        if let Some(state) = timeline.as_ref().and_then(|timeline| timeline.follow(payload)) {
            with_server(&handle, |server| server.broadcast_playback_state(state));
        }
    };
    Ok(OwnSubscription::declare(session, &name.topic(bus::Topic::Status), follow)?)
}

/// Follows the changes of a service's scene, so that viewers receive its parameters.
fn follow_changes(commander: &Commander, name: &Name, handle: &Handle) -> Result<OwnSubscription, FoxgloveError> {
    let (commander, owner, handle) = (commander.clone(), name.clone(), Arc::clone(handle));
    let session = commander.session().clone();
    let follow = move |payload: &[u8]| {
        if AppliedCommand::decode(payload).is_ok_and(|applied| !applied.scene.is_empty()) {
            let (commander, owner, handle) = (commander.clone(), owner.clone(), Arc::clone(&handle));
            let session = commander.session().clone();
            commander.jobs().submit(move |has_room| {
                if has_room {
                    let now = in_force(&session, &owner);
                    with_server(&handle, |server| server.publish_parameter_values(now));
                }
            });
        }
    };
    Ok(OwnSubscription::declare(&session, &name.topic(bus::Topic::Commands), follow)?)
}
