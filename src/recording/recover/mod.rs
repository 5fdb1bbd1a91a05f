//! Recovery: makes a complete, indexed recording from one that was cut off, damaged, or lost its index.

mod holes;
mod salvage;
mod scan;

use std::collections::BTreeMap;
use std::path::Path;

use mcap::records::op;

use super::RecordingError;
use super::open::open;
use super::parse::parse;
use super::summary::summary;
use salvage::{Salvage, Tally};
use scan::{Piece, Scanner};

/// The result of a recovery.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recovered {
    /// Messages in the new file.
    pub messages: u64,
    /// Messages from a chunk in which the file ends: no checksum covers them.
    pub unchecked: u64,
    /// Recorded time from first to last message, s.
    pub span_s: f64,
    /// The losses.
    pub loss: Loss,
}

/// The losses of a damaged recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Loss {
    /// Number of damaged places before the end of the file.
    pub places: u64,
    /// Whether the file ends early: everything after is lost.
    pub cut_off: bool,
    /// Number of messages known to be missing, by topic.
    pub messages: BTreeMap<String, u64>,
    /// Whether the number of missing messages is known.
    pub counted: bool,
    /// Messages that belong to no known topic.
    pub orphans: u64,
    /// Messages that no chunk can hold so that it is read again: of 64 MiB and more.
    pub too_long: u64,
    /// Recorded time without messages around the losses, s. Time before the first or after the last message counts only if the
    /// statistics of the file cover it.
    pub seconds: f64,
    /// Whether the metadata or the scene of a service's recording is not there.
    pub anonymous: bool,
}

impl Loss {
    /// Whether nothing is lost.
    pub fn is_none(&self) -> bool {
        self.places == 0
            && !self.cut_off
            && !self.anonymous
            && self.orphans == 0
            && self.messages.values().all(|count| *count == 0)
    }
}

/// Writes all readable messages of `broken` into a new file with a new index; overwrites nothing. The new file gets its name when
/// it is whole. Memory is bounded by the largest chunk, at most 64 MiB, and the schemas.
///
/// `progress` is called with the bytes done and the total.
///
/// # Errors
/// [`RecordingError::Empty`] if no message can be recovered (no file is left then), [`RecordingError::TooLong`] if none of
/// them fits a chunk, [`RecordingError`] if a file cannot be read
/// or written.
pub fn recover(broken: &Path, output: &Path, progress: impl FnMut(u64, u64)) -> Result<Recovered, RecordingError> {
    if output.exists() {
        return Err(RecordingError::Exists(output.to_owned()));
    }
    let mut scanner = Scanner::new(open(broken)?).map_err(RecordingError::file(broken))?;
    run(&mut scanner, Salvage::create(output)?, (broken, output), progress)
}

fn run(
    scanner: &mut Scanner,
    mut salvage: Salvage,
    (broken, output): (&Path, &Path),
    mut progress: impl FnMut(u64, u64),
) -> Result<Recovered, RecordingError> {
    let unread = || RecordingError::file(broken);
    learn(&mut salvage, broken)?;
    let mut loss = Loss::default();
    let mut closed = false;
    while let Some(piece) = scanner.next().map_err(unread())? {
        let sound = match piece {
            Piece::Damage => false,
            Piece::CutChunk(body) => {
                salvage.take_cut_chunk(&body).map_err(RecordingError::mcap(output))?;
                true
            }
            // The index holds no messages.
            Piece::Record { opcode: op::MESSAGE, .. } if closed => false,
            Piece::Record { opcode, body } => {
                closed |= opcode == op::DATA_END;
                salvage.take(opcode, &body).map_err(RecordingError::mcap(output))?
            }
        };
        if !sound {
            salvage.holes.opens = true;
            // Damage after the end of the data concerns the index, which is rebuilt.
            loss.places += u64::from(!closed && !salvage.has_end);
        }
        progress(scanner.done(), scanner.length());
    }
    // A file that is cut off behind the end of its recording lost no message.
    loss.cut_off = !closed && !salvage.has_end;
    if loss.cut_off && salvage.holes.opens {
        loss.places = loss.places.saturating_sub(1);
    }
    conclude(salvage, loss, (broken, output))
}

/// Reads topics and counts from the summary. Bytes that were put in or taken out before it have moved it from where the footer says: then
/// its records are looked for. A damaged summary counts as absent: it only helps.
fn learn(salvage: &mut Salvage, broken: &Path) -> Result<(), RecordingError> {
    let mut file = open(broken)?;
    match summary(&mut file) {
        Some(summary) => summary.into_iter().for_each(|record| salvage.learn(record)),
        None => {
            let unread = || RecordingError::file(broken);
            let mut scanner = Scanner::new(file).map_err(unread())?;
            while let (true, Some(piece)) = (scanner.closed(), scanner.next().map_err(unread())?) {
                if let Piece::Record { opcode: opcode @ (op::SCHEMA | op::CHANNEL | op::STATISTICS), body } = piece
                    && let Ok(record) = parse(opcode, &body)
                {
                    salvage.learn(record);
                }
            }
        }
    }
    salvage.complete_channels();
    Ok(())
}

fn conclude(mut salvage: Salvage, mut loss: Loss, (broken, output): (&Path, &Path)) -> Result<Recovered, RecordingError> {
    let Some((first, last)) = salvage.span_ns else {
        return Err(if salvage.too_long() > 0 {
            RecordingError::TooLong(broken.to_owned())
        } else {
            RecordingError::empty(broken)
        });
    };
    salvage.compare_with_statistics();
    loss.orphans = salvage.orphans;
    loss.too_long = salvage.too_long();
    let numbered = salvage.ours && loss.places > 0;
    loss.counted = salvage.statistics.is_some() || (numbered && !loss.cut_off);
    let there_were = |tally: &Tally| tally.stated.unwrap_or(if numbered { tally.counted } else { tally.saved + tally.too_long });
    let missing = |(topic, tally): (&String, &Tally)| (topic.clone(), there_were(tally).saturating_sub(tally.saved));
    loss.messages = salvage.tallies.iter().map(missing).filter(|(_, count)| *count > 0).collect();
    let ends = salvage.statistics.as_ref().filter(|_| !loss.messages.is_empty()).map_or(0, |statistics| {
        first.saturating_sub(statistics.message_start_time) + statistics.message_end_time.saturating_sub(last)
    });
    let taken_out = if loss.messages.is_empty() { 0 } else { salvage.holes.taken_out_ns };
    loss.seconds = (salvage.holes.damaged_ns + taken_out + ends) as f64 * 1e-9;
    loss.anonymous = salvage.is_anonymous();
    let (messages, unchecked) = (salvage.saved(), salvage.unchecked);
    let lost = loss.counted.then(|| loss.orphans + loss.messages.values().sum::<u64>());
    salvage.finish(broken, lost).map_err(RecordingError::mcap(output))?.finish_new().map_err(RecordingError::new_file(output))?;
    Ok(Recovered { messages, unchecked, span_s: (last - first) as f64 * 1e-9, loss })
}
