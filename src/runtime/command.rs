//! The command queue: from the bus to the stepping thread. Replies go back through a callback.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::Thread;

use crate::simulation::PulseRequest;
use crate::wire::{CommandReply, control};

/// Capacity of the command queue; a command that finds it full is refused.
const QUEUE: usize = 1024;

/// The request of a command.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Add a torque pulse.
    Torque(PulseRequest),
    /// Control the run: pause, resume, step, reset, stop, start or stop a recording.
    Control(control::Action),
}

/// Sends the reply of a command. Called off the stepping thread.
pub type ReplyTo = Box<dyn FnOnce(CommandReply) + Send>;

/// A decoded command with its reply callback.
pub struct Command {
    /// Identifies the command, for deduplication of retries; empty if the sender never retries.
    pub id: String,
    /// The request.
    pub request: Request,
    /// Sends the reply.
    pub reply: ReplyTo,
}

/// The sending end of the command queue. Cheap to clone.
#[derive(Clone)]
pub struct Inbox {
    queue: SyncSender<Command>,
    counts: Arc<SharedCounters>,
}

/// Counters and flags that the bus, the output thread and the stepping thread share.
#[derive(Debug, Default)]
pub struct SharedCounters {
    waiting: AtomicUsize,
    rejected: AtomicU64,
    dropped: AtomicU64,
    checkpoint_wanted: AtomicBool,
    /// The stepping thread, to be woken by a command.
    thread: OnceLock<Thread>,
}

impl SharedCounters {
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

    /// Commands refused before they reached the stepping thread: undecodable, or the queue was full.
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
    (Inbox { queue, counts: Arc::default() }, commands)
}

impl Inbox {
    /// The counters that this queue shares.
    pub fn counts(&self) -> Arc<SharedCounters> {
        Arc::clone(&self.counts)
    }

    /// Queues a command for the stepping thread. Refuses it at once if the queue is full or the run has ended.
    pub fn submit(&self, command: Command) {
        if self.counts.waiting.fetch_add(1, Ordering::Relaxed) >= QUEUE {
            return self.turn_away(command, "too many commands are waiting");
        }
        match self.queue.try_send(command) {
            Ok(()) => self.counts.thread.get().map_or((), Thread::unpark),
            Err(TrySendError::Full(command)) => self.turn_away(command, "too many commands are waiting"),
            Err(TrySendError::Disconnected(command)) => self.turn_away(command, "the run is over"),
        }
    }

    fn turn_away(&self, command: Command, reason: &str) {
        self.counts.answered();
        self.refuse(command.id, reason.to_owned(), command.reply);
    }

    /// Refuses a command that is not queued, and counts the refusal.
    pub fn refuse(&self, id: String, reason: String, reply: ReplyTo) {
        self.counts.rejected.fetch_add(1, Ordering::Relaxed);
        reply(CommandReply { id, accepted: false, reason, ..CommandReply::default() });
    }
}
