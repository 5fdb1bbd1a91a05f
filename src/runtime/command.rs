//! The command queue: from the bus to the stepping thread. Replies go back through a callback.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::Thread;

use super::reply::{Reply, ReplyTo};
use super::reply_cache::ReplyCache;
use super::scene_change::PreparedChange;
use crate::simulation::{AdvanceRequest, PulseRequest, SetpointRequest};

/// Capacity of the command queue; a command that finds it full is refused.
pub(super) const QUEUE: usize = 1024;

/// Controls a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Pause.
    Pause,
    /// Go on after a pause.
    Resume,
    /// While paused, take steps and stay paused.
    Step {
        /// Number of steps.
        count: u64,
    },
    /// Return to the start of the scene.
    Reset,
    /// End the run.
    Stop,
    /// Start a recording.
    StartRecording {
        /// Name of its file; empty for one made of the service and the time.
        name: String,
    },
    /// End the recording.
    StopRecording,
    /// Change the scene.
    Set {
        /// The changes, each `KEY=VALUE`.
        changes: Vec<String>,
    },
    /// Change the level of detail.
    Level {
        /// Name of the level.
        name: String,
    },
}

impl Action {
    /// Its kind, in a word.
    fn kind(&self) -> &'static str {
        match self {
            Action::Pause => "pause",
            Action::Resume => "resume",
            Action::Step { .. } => "step",
            Action::Reset => "reset",
            Action::Stop => "stop",
            Action::StartRecording { .. } => "start-recording",
            Action::StopRecording => "stop-recording",
            Action::Set { .. } => "set",
            Action::Level { .. } => "level",
        }
    }
}

/// The request of a command.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Add a torque pulse.
    Torque(PulseRequest),
    /// Hold a torque until the next setpoint.
    Setpoint(SetpointRequest),
    /// While paused, apply a torque and take steps.
    Advance(AdvanceRequest),
    /// Control the run.
    Control(Action),
}

impl Request {
    /// Its kind, in a word.
    pub fn kind(&self) -> &'static str {
        match self {
            Request::Torque(_) => "torque",
            Request::Setpoint(_) => "setpoint",
            Request::Advance(_) => "advance",
            Request::Control(action) => action.kind(),
        }
    }

    /// Whether it changes the scene.
    pub fn changes_scene(&self) -> bool {
        matches!(self, Request::Control(Action::Set { .. } | Action::Level { .. }))
    }

    /// Whether it starts or stops a recording.
    pub fn is_of_recording(&self) -> bool {
        matches!(self, Request::Control(Action::StartRecording { .. } | Action::StopRecording))
    }
}

/// A decoded command with its reply callback.
pub struct Command {
    /// Identifies the command, for deduplication of retries; empty if the sender never retries.
    pub id: String,
    /// The request.
    pub request: Request,
    /// Sends the reply.
    pub reply: ReplyTo,
    /// The prepared change, if the request changes the scene.
    pub change: Option<Box<PreparedChange>>,
}

/// The sending end of the command queue. Cheap to clone.
#[derive(Clone)]
pub struct Inbox {
    queue: SyncSender<Command>,
    shared: Arc<SharedState>,
}

/// Counters, replies and requests that the bus, the stepping thread and the output thread share.
#[derive(Debug, Default)]
pub struct SharedState {
    waiting: AtomicUsize,
    rejected: AtomicU64,
    dropped: AtomicU64,
    checkpoint_wanted: AtomicBool,
    replies: Mutex<ReplyCache>,
    /// The stepping thread, to be woken by a command.
    thread: OnceLock<Thread>,
}

impl SharedState {
    /// Sets the stepping thread: a new command wakes it.
    pub(super) fn wake_with(&self, thread: Thread) {
        // The thread is set once.
        let _ = self.thread.set(thread);
    }

    /// Requests a checkpoint after the next step.
    pub fn want_checkpoint(&self) {
        self.checkpoint_wanted.store(true, Ordering::Relaxed);
    }

    /// Whether a checkpoint was requested since the last call.
    pub(super) fn take_checkpoint_wanted(&self) -> bool {
        self.checkpoint_wanted.load(Ordering::Relaxed) && self.checkpoint_wanted.swap(false, Ordering::Relaxed)
    }

    /// The reply to a retry: to a command under the id of one that was accepted before. It must not be applied again. A command
    /// of another kind under that id is refused, and counted so.
    pub fn reply_to_retry(&self, id: &str, request: &Request) -> Option<Reply> {
        let reply = self.replies().get(id, request.kind())?;
        if !reply.accepted {
            self.count_rejected();
        }
        Some(reply)
    }

    /// Remembers the reply to an accepted command, so that a retry is not applied again. The request is unknown if it was accepted
    /// before this run.
    pub fn remember(&self, reply: &Reply, request: Option<&Request>) {
        self.replies().insert(reply, request.map(Request::kind));
    }

    /// Counts a command as refused.
    pub fn count_rejected(&self) {
        self.rejected.fetch_add(1, Ordering::Relaxed);
    }

    fn replies(&self) -> MutexGuard<'_, ReplyCache> {
        self.replies.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Commands refused in this run.
    pub fn rejected(&self) -> u64 {
        self.rejected.load(Ordering::Relaxed)
    }

    /// Messages dropped from the recording because a queue was full.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Counts a message dropped from the recording.
    pub fn count_dropped(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts a command as answered, which frees its place in the queue.
    pub fn answered(&self) {
        self.waiting.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Creates the command queue and returns both of its ends.
pub fn inbox() -> (Inbox, Receiver<Command>) {
    let (queue, commands) = sync_channel(QUEUE);
    (Inbox { queue, shared: Arc::default() }, commands)
}

impl Inbox {
    /// The state shared with the stepping thread and the output thread.
    pub fn shared(&self) -> Arc<SharedState> {
        Arc::clone(&self.shared)
    }

    /// Queues a command for the stepping thread. Refuses it at once if the queue is full or the run has ended.
    pub fn submit(&self, command: Command) {
        if self.shared.waiting.fetch_add(1, Ordering::Relaxed) >= QUEUE {
            return self.turn_away(command, "too many commands are waiting");
        }
        match self.queue.try_send(command) {
            Ok(()) => self.shared.thread.get().map_or((), Thread::unpark),
            Err(TrySendError::Full(command)) => self.turn_away(command, "too many commands are waiting"),
            Err(TrySendError::Disconnected(command)) => self.turn_away(command, "the run is over"),
        }
    }

    fn turn_away(&self, command: Command, reason: &str) {
        self.shared.answered();
        self.refuse(command.id, reason.to_owned(), command.reply);
    }

    /// Refuses a command that is not queued, and counts the refusal.
    pub fn refuse(&self, id: String, reason: String, reply: ReplyTo) {
        self.shared.count_rejected();
        reply(Reply::refused(id, reason).into());
    }
}
