//! Findings of a verification.

use super::difference::Difference;
use crate::recording::Damage;
use crate::simulation::PulseRefused;

/// Something wrong or lost in a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Finding {
    /// A record is unreadable or contradicts others.
    #[error("byte {}: {}{}", .0.offset, .0.what, lost(.0))]
    Damaged(Damage),
    /// The file was not closed.
    #[error("the file ends early, at byte {at} of {bytes}: it is still being recorded, or was not closed")]
    CutOff {
        /// End of the last complete record, bytes.
        at: u64,
        /// Size of the file, bytes.
        bytes: u64,
    },
    /// The file was recovered from a damaged one, and something was lost.
    #[error("the recording was recovered from a damaged one: {}", lost_before(*missing))]
    Recovered {
        /// Number of messages that it lacks; `None` if the recording's end is lost, too.
        missing: Option<u64>,
    },
    /// The scene was changed after the recording.
    #[error("scene.toml was changed after the recording was made")]
    SceneChanged,
    /// Steps that were due are missing.
    #[error("{topic}: {} between steps {after} and {before} of epoch {epoch}: {why}", missing(*count))]
    Missing {
        /// Last chunk of the topic.
        topic: &'static str,
        /// The epoch.
        epoch: u64,
        /// Last recorded step before the missing ones.
        after: u64,
        /// First recorded step after them.
        before: u64,
        /// Number of missing steps.
        count: u64,
        /// Why they are missing.
        why: LossReason,
    },
    /// The recording holds no message, or none in a whole chunk.
    #[error("the recording holds no message")]
    Empty {
        /// Whether the file was closed. One that ends early may have lost its messages.
        is_closed: bool,
    },
    /// The metadata lacks an entry.
    #[error("the metadata does not state {0}: {1}")]
    NoFact(&'static str, &'static str),
    /// The file does not state how the recording ended.
    #[error("the file does not state how the recording ended: messages at its end may be missing")]
    NoEnd,
    /// The stated end does not fit the messages.
    #[error("the stated end of the recording: {0}")]
    End(String),
    /// A channel is none of this service.
    #[error("{topic}: {what}")]
    Channel {
        /// The full topic.
        topic: String,
        /// The fault, in words.
        what: String,
    },
    /// A record that stands once in a recording is there again, so that it is not known which one is meant.
    #[error("{0} is there more than once")]
    Repeated(&'static str),
    /// The sequence numbers of a topic jump or repeat.
    #[error("{topic}: message number {found} comes where number {expected} was due{}", other_jumps(*.others))]
    Sequence {
        /// The full topic.
        topic: String,
        /// Expected sequence number of the first such message.
        expected: u32,
        /// Its sequence number.
        found: u32,
        /// Further jumps and repetitions on the topic.
        others: u64,
    },
    /// A message contradicts itself or others.
    #[error("{topic}, step {step} of epoch {epoch}: {what}")]
    Contradiction {
        /// Last chunk of the topic.
        topic: &'static str,
        /// The epoch.
        epoch: u64,
        /// The step.
        step: u64,
        /// The contradiction, in words.
        what: String,
    },
    /// Messages were dropped, where no step is known to be missing.
    #[error("{topic}: {count} {} missing: {why}", if *count == 1 { "message is" } else { "messages are" })]
    Dropped {
        /// Last chunk of the topic.
        topic: String,
        /// Number of messages.
        count: u64,
        /// Why they are missing.
        why: LossReason,
    },
    /// Messages could not be re-simulated.
    #[error("{messages} messages could not be re-simulated, because data before them is lost")]
    NotRecomputed {
        /// Number of messages.
        messages: u64,
    },
    /// The file does not begin with a checkpoint.
    #[error("the recording does not begin with a checkpoint: messages before the first cannot be re-simulated")]
    NoCheckpoint,
    /// A log time falls or differs from the stamp.
    #[error("{topic}: {what} at step {step} of epoch {epoch}")]
    Time {
        /// Last chunk of the topic.
        topic: String,
        /// The fault, in words.
        what: &'static str,
        /// The epoch.
        epoch: u64,
        /// The step.
        step: u64,
    },
    /// A message does not fit its schema.
    #[error("{topic}: a message does not fit its schema: {cause}")]
    Undecodable {
        /// Last chunk of the topic.
        topic: String,
        /// The decoder's error.
        cause: String,
    },
    /// A number is not finite, or a joint is open.
    #[error("{topic}, step {step} of epoch {epoch}: {what}")]
    Physics {
        /// Last chunk of the topic.
        topic: &'static str,
        /// The epoch.
        epoch: u64,
        /// The step.
        step: u64,
        /// The fault, in words.
        what: String,
    },
    /// Re-simulation gives different messages.
    #[error("the re-simulation differs from {first}; {messages} messages differ in all")]
    Differs {
        /// The first difference.
        first: Box<Difference>,
        /// Number of messages that differ.
        messages: u64,
    },
    /// Re-simulation cannot follow the recording.
    #[error("step {step} of epoch {epoch}: {what}")]
    ResimulationFault {
        /// The epoch.
        epoch: u64,
        /// The step.
        step: u64,
        /// Why it cannot.
        what: String,
    },
    /// A recorded command is refused.
    #[error("step {step}: the recorded command {id} is refused: {cause}")]
    Refused {
        /// Id of the command.
        id: String,
        /// The step at which it was applied.
        step: u64,
        /// Why it is refused.
        cause: PulseRefused,
    },
}

/// Steps without a sample, in words.
fn missing(count: u64) -> String {
    if count == 1 { "1 step that was due is missing".to_owned() } else { format!("{count} steps that were due are missing") }
}

/// The loss before a recovery, in words.
fn lost_before(missing: Option<u64>) -> String {
    match missing {
        None => "anything after its end is lost".to_owned(),
        Some(1) => "1 message is lost".to_owned(),
        Some(count) => format!("{count} messages are lost"),
    }
}

/// Why messages are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LossReason {
    /// A queue was full, as the recording reports.
    #[error("a queue was full")]
    Queue,
    /// They were in a damaged part of the file.
    #[error("the file is damaged there")]
    Damage,
    /// They were lost before the file was recovered.
    #[error("they were lost before the recording was recovered")]
    Recovered,
    /// The recording that this one was computed from lacks them, as this one reports.
    #[error("the recording that it was computed from lacks them")]
    Source,
    /// The file does not explain it.
    #[error("the file does not explain it")]
    Unexplained,
}

impl Finding {
    /// Whether this is an explained loss that leaves the rest intact.
    pub fn is_loss(&self) -> bool {
        matches!(
            self,
            Finding::CutOff { .. }
                | Finding::Empty { is_closed: false }
                | Finding::Recovered { .. }
                | Finding::NoEnd
                | Finding::NoFact(..)
                | Finding::Dropped { .. }
                | Finding::NotRecomputed { .. }
                | Finding::Missing { why: LossReason::Queue | LossReason::Recovered | LossReason::Source, .. }
        )
    }
}

fn lost(damage: &Damage) -> String {
    damage.lost_ns.map_or(String::new(), |[from, to]| {
        format!("; its messages of {:.3} s are lost (log_time {from} to {to} ns)", (to.saturating_sub(from)) as f64 * 1e-9)
    })
}

fn other_jumps(others: u64) -> String {
    if others > 0 { format!(", and {others} more numbers do not follow") } else { String::new() }
}
