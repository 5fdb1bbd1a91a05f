//! The merged table of a campaign, summed up: its rows by their ends, those that cannot be trusted, those that are missing.

use std::io::Write as _;
use std::ops::Range;

use crate::cli::aligned_table::figure;
use crate::cli::exit_status::ExitStatus;
use crate::cli::failure::{CommandResult, Failure};
use crate::cli::formatting::counted;
use crate::cli::output::output;
use crate::cli::run_conclusion::step_remedy;
use crate::runtime::{beyond_range, unbalanced};
use crate::shown::shown_sentence;
use crate::study::sweep::{Campaign, Ending, Merged, OutOfRange, Untrusted};

/// Ranges of missing rows that are named.
const NAMED: usize = 20;

/// Prints what a table holds, and what it lacks.
pub(super) fn merged(merged: &Merged, campaign: &Campaign) -> CommandResult {
    let mut out = output();
    writeln!(
        out,
        "{}: {}, computed in {} s, SHA-256 {}",
        merged.path.display(),
        counted(merged.rows, "row"),
        three_digits(merged.seconds),
        merged.sha256
    )?;
    for (count, ended) in counts(merged) {
        writeln!(out, "{count:>10}  {ended}")?;
    }
    warn_of_failures(merged);
    merged.untrusted.iter().for_each(|untrusted| warn_of_untrusted(untrusted, campaign));
    merged.out_of_range.iter().for_each(warn_of_bending);
    if merged.missing.is_empty() {
        return Ok(ExitStatus::Success);
    }
    Err(Failure::Failed(are_missing(&merged.missing, campaign)))
}

/// The number of rows that are missing, and the first of them.
pub(super) fn are_missing(missing: &[Range<u64>], campaign: &Campaign) -> String {
    let range = |range: &Range<u64>| match range.end - range.start {
        1 => range.start.to_string(),
        _ => format!("{}–{}", range.start, range.end - 1),
    };
    let named: Vec<String> = missing.iter().take(NAMED).map(range).collect();
    let more = if missing.len() > NAMED { ", …" } else { "" };
    let count: u64 = missing.iter().map(|range| range.end - range.start).sum();
    format!("{count} of {} rows are missing: {}{more}", campaign.runs(), named.join(", "))
}

/// Number of runs by their end; those that are done, but not to be trusted or out of the model's range, apart.
fn counts(merged: &Merged) -> Vec<(u64, &'static str)> {
    let untrusted = merged.untrusted.map_or(0, |untrusted| untrusted.count);
    let bent = merged.out_of_range.map_or(0, |bent| bent.count);
    let apart = |(ending, count): (&Ending, &u64)| match ending {
        Ending::Done => vec![
            (count - untrusted - bent, "done"),
            (bent, "done, out of the model's range: a link was bent too far"),
            (untrusted, "done, not to be trusted: the energy balance is off"),
        ],
        ending => vec![(*count, ending.as_str())],
    };
    merged.endings.iter().flat_map(apart).filter(|(count, _)| *count > 0).collect()
}

/// Warns of runs that are not to be trusted, with an example and the way to a better step.
fn warn_of_untrusted(untrusted: &Untrusted, campaign: &Campaign) {
    let Untrusted { count, first, worst_balance_j, in_play_j } = *untrusted;
    let example = unbalanced(worst_balance_j, in_play_j);
    say!("warning: {} ended unbalanced, such as run {first}: {example}", counted(count, "run"));
    let source = campaign.scene_of(first).ok();
    if let Some(remedy) = source.and_then(|source| step_remedy(std::iter::once(&source.scene))) {
        say!("not to be trusted: {remedy}; SCENE is the campaign's scene with the values of run {first}");
    }
}

/// Warns of runs that bent a link further than the model covers, with an example.
fn warn_of_bending(out_of_range: &OutOfRange) {
    let OutOfRange { count, first, bent } = *out_of_range;
    let example = beyond_range(bent).unwrap_or_default();
    say!("warning: {} bent a link too far, such as run {first}: {example}", counted(count, "run"));
}

/// Warns of runs that did not run to their end, with an example of each ending.
fn warn_of_failures(merged: &Merged) {
    for (ending, count) in merged.endings.iter().filter(|(ending, _)| **ending != Ending::Done) {
        let ended = format!("{} ended as {}", counted(*count, "run"), ending.as_str());
        match merged.causes.get(ending) {
            Some((index, cause)) => say!("warning: {ended}, such as run {index}: {}", shown_sentence(cause)),
            None => say!("warning: {ended}: see the column `cause` of {}", merged.path.display()),
        }
    }
}

/// Formats with three significant digits.
fn three_digits(value: f64) -> String {
    figure(format!("{value:.2e}").parse().unwrap_or(value))
}
