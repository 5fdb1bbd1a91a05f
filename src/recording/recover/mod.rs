//! A whole, indexed recording from a broken one: cut off, damaged in places, without its index.

mod salvage;
mod scan;

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use mcap::records::op;

use super::RecordingError;
use super::summary::summary;
use salvage::{Salvage, Tally};
use scan::{Piece, Scanner};

/// What was saved of a broken recording, and what was not.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recovered {
    /// Messages in the new file.
    pub messages: u64,
    /// How many of them come from a chunk that the file ends in: its sum cannot be checked.
    pub unchecked: u64,
    /// Recorded time that they span, s.
    pub span_s: f64,
    /// What is missing.
    pub loss: Loss,
}

/// What a broken recording no longer holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Loss {
    /// Places where the file is damaged before its end.
    pub places: u64,
    /// Whether it ends early: what came after is not there at all.
    pub cut_off: bool,
    /// Messages that are known to be missing, by topic.
    pub messages: BTreeMap<String, u64>,
    /// Whether it is known how many are missing.
    pub counted: bool,
    /// Messages that are there but cannot be assigned to a topic.
    pub orphans: u64,
    /// Recorded time without any message around what is missing, s; what comes before the first message or after the last
    /// one is counted only where the file's statistics tell it.
    pub seconds: f64,
}

impl Loss {
    /// Whether nothing is missing.
    pub fn is_none(&self) -> bool {
        self.places == 0 && !self.cut_off && self.orphans == 0 && self.messages.values().all(|count| *count == 0)
    }
}

/// Writes what can be read of `broken` into a new file, with a new index; nothing is overwritten. Memory is bounded by the
/// largest chunk, which may have 64 MiB.
///
/// `progress` is called with bytes done and bytes in all.
///
/// # Errors
/// [`RecordingError::Empty`] when there is no message to be saved (then no file is left), [`RecordingError`] when a file
/// cannot be read or written.
pub fn recover(broken: &Path, output: &Path, progress: impl FnMut(u64, u64)) -> Result<Recovered, RecordingError> {
    let mut scanner = Scanner::open(broken).map_err(RecordingError::file(broken))?;
    let salvage = Salvage::create(output)?;
    let recovered = run(&mut scanner, salvage, (broken, output), progress);
    if recovered.is_err() {
        // Half a file is of no use, and the broken one is still there.
        std::fs::remove_file(output).map_err(RecordingError::file(output))?;
    }
    recovered
}

fn run(
    scanner: &mut Scanner,
    mut salvage: Salvage,
    (broken, output): (&Path, &Path),
    mut progress: impl FnMut(u64, u64),
) -> Result<Recovered, RecordingError> {
    let unread = || RecordingError::file(broken);
    // A damaged summary is none: it only helps.
    let mut file = File::open(broken).map_err(unread())?;
    if let Ok(Some(summary)) = summary(&mut file, scanner.length()) {
        salvage.learn(summary);
    }
    let mut loss = Loss::default();
    let mut closed = false;
    while let Some(piece) = scanner.next().map_err(unread())? {
        let sound = match piece {
            Piece::Damage => false,
            Piece::CutChunk(body) => {
                salvage.take_cut_chunk(body).map_err(RecordingError::mcap(output))?;
                true
            }
            Piece::Record { opcode, body } => {
                closed |= opcode == op::DATA_END;
                salvage.take(opcode, body).map_err(RecordingError::mcap(output))?
            }
        };
        if !sound {
            salvage.in_hole = true;
            // What is broken after the end of the data is the index, which is made anew.
            loss.places += u64::from(!closed);
        }
        progress(scanner.done(), scanner.length());
    }
    loss.cut_off = !closed;
    if loss.cut_off && salvage.in_hole {
        loss.places -= 1;
    }
    conclude(salvage, loss, (broken, output))
}

fn conclude(mut salvage: Salvage, mut loss: Loss, (broken, output): (&Path, &Path)) -> Result<Recovered, RecordingError> {
    let Some((first, last)) = salvage.span_ns else { return Err(RecordingError::Empty { path: broken.to_owned() }) };
    salvage.compare_with_statistics();
    loss.orphans = salvage.orphans;
    let numbered = salvage.ours && loss.places > 0;
    loss.counted = salvage.statistics.is_some() || (numbered && !loss.cut_off);
    let there_were = |tally: &Tally| tally.stated.unwrap_or(if numbered { tally.counted } else { tally.saved });
    let missing = |(topic, tally): (&String, &Tally)| (topic.clone(), there_were(tally).saturating_sub(tally.saved));
    loss.messages = salvage.tallies.iter().map(missing).filter(|(_, count)| *count > 0).collect();
    let ends = salvage.statistics.as_ref().filter(|_| !loss.messages.is_empty()).map_or(0, |statistics| {
        first.saturating_sub(statistics.message_start_time) + statistics.message_end_time.saturating_sub(last)
    });
    loss.seconds = (salvage.hole_ns + ends) as f64 * 1e-9;
    let (messages, unchecked) = (salvage.saved(), salvage.unchecked);
    let lost = loss.counted.then(|| loss.orphans + loss.messages.values().sum::<u64>());
    salvage.finish(broken, lost).map_err(RecordingError::mcap(output))?;
    Ok(Recovered { messages, unchecked, span_s: (last - first) as f64 * 1e-9, loss })
}
