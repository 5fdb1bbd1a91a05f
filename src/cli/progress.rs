//! Progress bars; invisible without a terminal.

use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use super::log::is_quiet;

/// Time between two redraws.
const TICK: Duration = Duration::from_millis(200);

const PERCENT: &str = "{wide_bar} {percent} %{left}";
/// Parts of a bar over parts.
const FINE: u64 = 1000;

/// A bar of this length and template; `{left}` is the remaining time.
pub(super) fn bar(length: u64, template: &str) -> ProgressBar {
    let bar = visible(ProgressBar::new(length));
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("left", left));
    }
    // Elapsed time runs on while nothing is reported.
    bar.enable_steady_tick(TICK);
    bar
}

/// The bar, hidden with `--quiet`.
pub(super) fn visible(bar: ProgressBar) -> ProgressBar {
    if is_quiet() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar
}

/// Elapsed time of work whose length is unknown.
pub(super) fn elapsed(what: &'static str) -> ProgressBar {
    let spinner = bar(0, "{spinner} {msg}, {elapsed}");
    spinner.set_message(what);
    spinner
}

/// A bar over `readings` readings of a file.
pub(super) fn over_file(file: &Path, readings: u64) -> ProgressBar {
    let bytes = std::fs::metadata(file).map_or(0, |file| file.len());
    bar(readings * bytes, PERCENT)
}

/// A bar for work that reports the part that is done, from 0 to 1, to the function.
pub(super) fn over_parts() -> (ProgressBar, impl Fn(f64)) {
    let bar = bar(FINE, PERCENT);
    let moved = bar.clone();
    (bar, move |done| moved.set_position((done * FINE as f64) as u64))
}

/// The remaining time is unknown at the start.
fn left(state: &ProgressState, out: &mut dyn Write) {
    if state.pos() > 0 {
        // A line that cannot be written is omitted.
        let _ = write!(out, ", about {} left", HumanDuration(state.eta()));
    }
}
