//! Progress bars; invisible without a terminal, where `trade` and `sweep` print lines.

use std::fmt::Write;
use std::io::{IsTerminal as _, stderr};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use super::log::is_quiet;

/// Time between two redraws.
const TICK: Duration = Duration::from_millis(200);
/// Time between two lines.
const LINE_PERIOD: Duration = Duration::from_secs(10);

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

/// Lines about the progress of long work without a terminal. Work of less than [`LINE_PERIOD`] prints none.
pub(super) struct ProgressLines {
    /// Time of the last line, or of the beginning.
    last: Mutex<Instant>,
}

impl ProgressLines {
    /// Begins the work.
    pub(super) fn begin() -> Self {
        ProgressLines { last: Mutex::new(Instant::now()) }
    }

    /// Prints a line if it is time for one and there is no terminal.
    pub(super) fn report(&self, line: impl FnOnce() -> String) {
        if !stderr().is_terminal() && self.is_due(Instant::now()) {
            say!("{}", line());
        }
    }

    /// Whether it is time for a line. Then the next one is due a period later.
    fn is_due(&self, now: Instant) -> bool {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let is_due = now.saturating_duration_since(*last) >= LINE_PERIOD;
        if is_due {
            *last = now;
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_lines_about_progress_are_a_period_apart() {
        let lines = ProgressLines::begin();
        let begin = Instant::now();
        let due: Vec<u64> = (0..60).filter(|second| lines.is_due(begin + Duration::from_secs(*second))).collect();
        assert_eq!(due, [10, 20, 30, 40, 50]);
    }
}
