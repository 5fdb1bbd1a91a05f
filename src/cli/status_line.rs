//! The status line in the terminal: the status of one service, or a summary of many.

use std::sync::{Arc, Mutex, PoisonError};

use indicatif::{ProgressBar, ProgressStyle};

use crate::service::OnStatus;
use crate::wire::{Status, status::State};

/// A line on the terminal that is overwritten; invisible without a terminal.
#[derive(Clone)]
pub(super) struct StatusLine {
    line: ProgressBar,
    told: Arc<Mutex<StatusLineState>>,
}

struct StatusLineState {
    /// Printed when the first status arrives.
    heading: Option<String>,
    /// The newest status of each service, and whether its warning was printed.
    newest: Newest,
}

type Newest = Vec<(Option<Status>, bool)>;

impl StatusLine {
    /// Creates a status line for `count` services.
    pub(super) fn new(count: usize) -> Self {
        let line = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{msg}") {
            line.set_style(style);
        }
        StatusLine { line, told: Arc::new(Mutex::new(StatusLineState { heading: None, newest: vec![(None, false); count] })) }
    }

    /// Sets the heading to print with the first status: by then services run and record.
    pub(super) fn head(&self, heading: String) {
        self.told.lock().unwrap_or_else(PoisonError::into_inner).heading = Some(heading);
    }

    /// Returns the status callback of service `index`.
    pub(super) fn of(&self, index: usize, name: &str) -> OnStatus {
        let (status_line, name) = (self.clone(), name.to_owned());
        Box::new(move |status| status_line.take(index, &name, status))
    }

    fn take(&self, index: usize, name: &str, status: &Status) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let StatusLineState { heading, newest } = &mut *told;
        if let Some(heading) = heading.take() {
            self.line.suspend(|| say!("{heading}"));
        }
        let many = newest.len() > 1;
        let Some((kept, warned)) = newest.get_mut(index) else { return };
        // Only the first warning is printed.
        if status.state() == State::Running && !status.message.is_empty() && !*warned {
            *warned = true;
            let whose = if many { format!("{name}: ") } else { String::new() };
            self.line.suspend(|| say!("warning: {whose}{}", status.message));
        }
        *kept = Some(status.clone());
        match many {
            false => self.line.set_message(describe(status)),
            // One summary per round of statuses.
            true if index == 0 => self.line.set_message(summary(newest)),
            true => {}
        }
    }

    /// Removes the line.
    pub(super) fn clear(&self) {
        self.line.finish_and_clear();
    }
}

/// Formats a status as one line.
pub(super) fn describe(status: &Status) -> String {
    let state = State::try_from(status.state).unwrap_or_default();
    let time = status.stamp.as_ref().map_or(0.0, |stamp| stamp.sim_time_s);
    format!(
        "{:<8} t {time:9.3} s{}{}{}{}{}{}{}",
        state.as_str_name(),
        optional("rtf", status.real_time_factor.map(|factor| format!("{factor:.4}"))),
        optional("late p50", status.lateness_p50_s.map(milliseconds)),
        optional("p99", status.lateness_p99_s.map(milliseconds)),
        optional("age p99", status.sample_age_p99_s.map(milliseconds)),
        optional("spin", status.spin_s.map(milliseconds)),
        optional("", status.kinetic_j.map(|kinetic| format!("{:.4} J", kinetic + status.strain_j.unwrap_or(0.0)))),
        if status.dropped_samples > 0 { format!("  dropped {}", status.dropped_samples) } else { String::new() },
    )
}

/// Summarizes many services by the slowest and the latest.
fn summary(newest: &[(Option<Status>, bool)]) -> String {
    let all = || newest.iter().filter_map(|(status, _)| status.as_ref());
    let running = all().filter(|status| status.state() == State::Running).count();
    let slowest = all().filter_map(|status| status.real_time_factor).reduce(f64::min);
    let latest = all().filter_map(|status| status.lateness_p99_s).reduce(f64::max);
    let dropped: u64 = all().map(|status| status.dropped_samples).sum();
    format!(
        "{running} of {} running{}{}{}",
        newest.len(),
        optional("slowest rtf", slowest.map(|factor| format!("{factor:.4}"))),
        optional("worst late p99", latest.map(milliseconds)),
        if dropped > 0 { format!("  dropped {dropped}") } else { String::new() },
    )
}

fn optional(name: &str, value: Option<String>) -> String {
    value.map_or(String::new(), |value| format!("  {name} {value}"))
}

fn milliseconds(value: f64) -> String {
    format!("{:.2} ms", value * 1e3)
}
