//! Commands on their way from the bus to the stepping thread, and their answers on the way back.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::Thread;

use crate::simulation::PulseRequest;
use crate::wire::{CommandReply, control};

/// Commands that may wait for the stepping thread; beyond that they are refused at the door.
const QUEUE: usize = 1024;

/// What a command asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// A torque pulse.
    Torque(PulseRequest),
    /// Something about the run.
    Control(control::Action),
}

/// Where an answer goes. Called off the stepping thread.
pub type ReplyTo = Box<dyn FnOnce(CommandReply) + Send>;

/// A decoded command and where its answer goes.
pub struct Command {
    /// Chosen by the sender; empty when it does not care about repetition.
    pub id: String,
    /// What is asked for.
    pub request: Request,
    /// Takes the answer.
    pub reply: ReplyTo,
}

/// The door for commands; cheap to clone.
#[derive(Clone)]
pub struct Inbox {
    queue: SyncSender<Command>,
    counts: Arc<SharedCounters>,
}

/// What is counted and wished for across threads.
#[derive(Debug, Default)]
pub struct SharedCounters {
    waiting: AtomicUsize,
    rejected: AtomicU64,
    dropped: AtomicU64,
    checkpoint_wanted: AtomicBool,
    /// The thread that takes commands.
    thread: OnceLock<Thread>,
}

impl SharedCounters {
    /// Commands are taken by this thread: it may be asleep.
    pub(super) fn wake_with(&self, thread: Thread) {
        // It is told once.
        let _ = self.thread.set(thread);
    }

    /// Asks for a checkpoint after the next step.
    pub fn want_checkpoint(&self) {
        self.checkpoint_wanted.store(true, Ordering::Relaxed);
    }

    /// Whether one was asked for since this was last called.
    pub(super) fn take_checkpoint_wanted(&self) -> bool {
        self.checkpoint_wanted.load(Ordering::Relaxed) && self.checkpoint_wanted.swap(false, Ordering::Relaxed)
    }

    /// Commands refused at the door: undecodable, or the queue was full.
    pub fn rejected(&self) -> u64 {
        self.rejected.load(Ordering::Relaxed)
    }

    /// Messages that a full queue kept from the recording.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// One message was kept from the recording.
    pub fn count_dropped(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }

    /// One command has been answered.
    pub fn answered(&self) {
        self.waiting.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The two ends of the command queue.
pub fn inbox() -> (Inbox, Receiver<Command>) {
    let (queue, commands) = sync_channel(QUEUE);
    (Inbox { queue, counts: Arc::default() }, commands)
}

impl Inbox {
    /// What this door has counted.
    pub fn counts(&self) -> Arc<SharedCounters> {
        Arc::clone(&self.counts)
    }

    /// Hands a command to the stepping thread, or refuses it at once when too many wait or the run is over.
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

    /// Refuses something that never became a command, and counts it.
    pub fn refuse(&self, id: String, reason: String, reply: ReplyTo) {
        self.counts.rejected.fetch_add(1, Ordering::Relaxed);
        reply(CommandReply { id, accepted: false, reason, ..CommandReply::default() });
    }
}
