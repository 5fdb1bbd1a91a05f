//! `recover`: makes a complete recording from a damaged one.

use std::path::PathBuf;

use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::folders::{must_have_folder, must_suit_recording};
use super::formatting::counted;
use super::progress::bar;
use crate::recording::{self, Loss, Recovered};
use crate::shown::shown_name;

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank recover recordings/crank.mcap -o whole.mcap

Exit codes: 0 nothing was lost, 3 something was, 1 nothing could be saved.";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The damaged recording; it is not changed.
    pub file: PathBuf,
    /// The new file; it must not exist.
    #[arg(long, short, value_name = "FILE")]
    pub output: PathBuf,
}

pub(super) fn recover(args: &Args) -> CommandResult {
    must_suit_recording(&args.output)?;
    must_have_folder(&args.output)?;
    let bar = bar(0, "{wide_bar} {bytes}/{total_bytes}");
    let recovered = recording::recover(&args.file, &args.output, |done, all| {
        bar.set_length(all);
        bar.set_position(done);
    });
    bar.finish_and_clear();
    let Recovered { messages, unchecked, span_s, loss } = recovered?;
    say!("recovered {}, {span_s:.3} s, to {}", counted(messages, "message"), args.output.display());
    if unchecked > 0 {
        say!("unchecked: the last {unchecked} of them come from a chunk that was cut off, so no checksum covers them");
    }
    if loss.is_none() {
        return Ok(ExitStatus::Success);
    }
    for line in describe(&loss, span_s) {
        say_reason!("lost: {line}");
    }
    Ok(ExitStatus::Lossy)
}

/// Describes the losses, one per line.
fn describe(loss: &Loss, span_s: f64) -> Vec<String> {
    let mut lines = Vec::new();
    let places = match loss.places {
        0 => String::new(),
        1 => ", damaged in 1 place".to_owned(),
        several => format!(", damaged in {several} places"),
    };
    let total: u64 = loss.messages.values().sum();
    if loss.places > 0 || total > 0 {
        let count =
            if loss.counted || total > 0 { counted(total, "message") } else { "an unknown number of messages".to_owned() };
        lines.push(format!("{count} and {:.3} s{places}", loss.seconds));
    }
    lines.extend(loss.messages.iter().map(|(topic, count)| format!("  {count} on {}", shown_name(topic))));
    if loss.too_long > 0 {
        lines.push(format!("  {} of them longer than the 64 MiB of a chunk", loss.too_long));
    }
    if loss.orphans > 0 {
        lines.push(format!("{} messages whose topic is unknown", loss.orphans));
    }
    if loss.anonymous {
        lines.push(
            "metadata and scene, so that the new file can be plotted, exported and replayed, but not verified, resumed or used for \
             a `what-if`"
                .to_owned(),
        );
    }
    if loss.cut_off {
        lines.push(format!("all after {span_s:.3} s: the file is still being recorded, or was cut off"));
    }
    lines
}
