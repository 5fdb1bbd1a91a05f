//! What a verification has to say against a recording.

use super::difference::Difference;
use crate::recording::Damage;
use crate::simulation::PulseRefused;

/// Something that is not as it should be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Finding {
    /// A part of the file is unreadable or contradicts the rest.
    #[error("byte {}: {}{}", .0.offset, .0.what, lost(.0))]
    Damaged(Damage),
    /// The file was not closed.
    #[error("the file ends early, at byte {at} of {bytes}: it was not closed")]
    CutOff {
        /// Where the last whole record ends.
        at: u64,
        /// Size of the file.
        bytes: u64,
    },
    /// The file was made from a broken one.
    #[error("the recording was recovered from a broken one: what came after its end is not there")]
    Recovered,
    /// The scene is not the one recorded with.
    #[error("scene.toml was changed after the recording was made")]
    SceneChanged,
    /// Steps that were due are not there.
    #[error(
        "{topic}: {count} steps that were due after step {after} and before step {before} of epoch {epoch} are missing: {why}"
    )]
    Missing {
        /// Last chunk of the topic.
        topic: &'static str,
        /// The epoch.
        epoch: u64,
        /// The last step before the hole.
        after: u64,
        /// The first after it.
        before: u64,
        /// How many are missing.
        count: u64,
        /// Why.
        why: LossReason,
    },
    /// The file does not begin with a checkpoint.
    #[error("the recording does not begin with a checkpoint: what comes before the first cannot be computed again")]
    NoCheckpoint,
    /// Log times must not fall, and must be what the stamp says.
    #[error("{topic}: {what} at step {step} of epoch {epoch}")]
    Time {
        /// Last chunk of the topic.
        topic: String,
        /// What is wrong.
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
        /// What the decoder says.
        cause: String,
    },
    /// A law is broken.
    #[error("{topic}, step {step} of epoch {epoch}: {what}")]
    Physics {
        /// Last chunk of the topic.
        topic: &'static str,
        /// The epoch.
        epoch: u64,
        /// The step.
        step: u64,
        /// What is wrong.
        what: String,
    },
    /// What was recorded is not what the scene and the commands give.
    #[error("computed again, it differs from {first}; {messages} messages differ in all")]
    Differs {
        /// Where first.
        first: Box<Difference>,
        /// How many messages differ.
        messages: u64,
    },
    /// The computation cannot follow the recording.
    #[error("step {step} of epoch {epoch}: {what}")]
    ResimulationFault {
        /// The epoch.
        epoch: u64,
        /// The step.
        step: u64,
        /// Why.
        what: String,
    },
    /// A recorded command would not be accepted.
    #[error("step {step}: the recorded command {id} would be refused: {cause}")]
    Refused {
        /// Its id.
        id: String,
        /// When it was applied.
        step: u64,
        /// Why.
        cause: PulseRefused,
    },
}

/// Why messages are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LossReason {
    /// A queue was full, and the recording says so.
    #[error("a queue was full")]
    Queue,
    /// They were in a part of the file that is damaged.
    #[error("the file is damaged there")]
    Damage,
    /// They were lost with a part of the file before it was recovered.
    #[error("they were lost before the recording was recovered")]
    Recovered,
    /// Nothing says why.
    #[error("nothing in the file says why")]
    Unexplained,
}

impl Finding {
    /// Whether it only says that something was lost, and why, and what is left is sound.
    pub fn is_loss(&self) -> bool {
        matches!(
            self,
            Finding::CutOff { .. } | Finding::Recovered | Finding::Missing { why: LossReason::Queue | LossReason::Recovered, .. }
        )
    }
}

fn lost(damage: &Damage) -> String {
    damage.lost_ns.map_or(String::new(), |[from, to]| {
        format!("; its messages of {:.3} s are lost (log_time {from} to {to} ns)", (to.saturating_sub(from)) as f64 * 1e-9)
    })
}
