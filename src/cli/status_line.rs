//! The status line in the terminal: the status of one service, or a summary of many.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use super::log::is_quiet;
use super::progress::visible;
use crate::runtime::{is_distrust, is_expiry};
use crate::service::OnStatus;
use crate::shown::shown_s;
use crate::wire::{Status, status::EnergyVerdict, status::State};

/// Said where a run was not to be trusted, and is again.
pub(super) const DISTRUST_LIFTED: &str =
    "more energy is in play now, and the balance is within solver.balance_tolerance of it: that warning no longer holds";
/// Columns of the narrowest terminal.
const WIDTH: usize = 80;

/// A line on the terminal that is overwritten; invisible without a terminal.
#[derive(Clone)]
pub(super) struct StatusLine {
    line: ProgressBar,
    told: Arc<Mutex<StatusLineState>>,
}

struct StatusLineState {
    /// Printed when the first status arrives.
    heading: Option<String>,
    services: Vec<ServiceStatus>,
    /// Simulated time at which the run finishes, s.
    until_s: Option<f64>,
}

/// The newest status of a service, and the warning printed of it.
#[derive(Clone, Default)]
struct ServiceStatus {
    newest: Option<Status>,
    /// The warning that was printed and still holds; empty for none.
    warning: String,
    /// The epoch of that warning.
    epoch: u64,
    /// Setpoints that had expired before the first status, as of a session that is resumed: their warning is old.
    expired_before: Option<u64>,
}

impl StatusLine {
    /// Creates a status line for `count` services.
    pub(super) fn new(count: usize, until_s: Option<f64>) -> Self {
        let line = visible(ProgressBar::new_spinner());
        if let Ok(style) = ProgressStyle::with_template("{msg}") {
            line.set_style(style);
        }
        StatusLine {
            line,
            told: Arc::new(Mutex::new(StatusLineState {
                heading: None,
                services: vec![ServiceStatus::default(); count],
                until_s,
            })),
        }
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
        let StatusLineState { heading, services, until_s } = &mut *told;
        if let Some(heading) = heading.take() {
            self.line.suspend(|| say!("{heading}"));
        }
        let many = services.len() > 1;
        let Some(service) = services.get_mut(index) else { return };
        let whose = if many { format!("{name}: ") } else { String::new() };
        // With `--quiet`, the end of the run prints what its exit code is due to.
        if let Some(line) = (!is_quiet()).then(|| service.line(status, &whose)).flatten() {
            self.line.suspend(|| say!("{line}"));
        }
        service.newest = Some(status.clone());
        match many {
            false => self.line.set_message(describe(status, *until_s)),
            // One summary per round of statuses.
            true if index == 0 => self.line.set_message(summary(services)),
            true => {}
        }
    }

    /// The warning of each service that was printed and still holds; empty for none.
    pub(super) fn warnings(&self) -> Vec<String> {
        let told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        told.services.iter().map(|service| service.warning.clone()).collect()
    }

    /// Removes the line.
    pub(super) fn clear(&self) {
        self.line.finish_and_clear();
    }
}

impl ServiceStatus {
    /// The line that a status calls for: the first warning, or that a distrust is lifted.
    fn line(&mut self, status: &Status, whose: &str) -> Option<String> {
        let (time_s, epoch) = status.stamp.as_ref().map_or((0.0, 0), |stamp| (stamp.sim_time_s, stamp.epoch));
        let time_s = shown_s(time_s);
        if epoch != self.epoch {
            // A run that was reset is another.
            (self.epoch, self.warning) = (epoch, String::new());
            self.expired_before = self.expired_before.map(|_| 0);
        }
        if !self.warning.is_empty() {
            let is_lifted = is_distrust(&self.warning) && status.energy_verdict() == EnergyVerdict::Balanced;
            return is_lifted.then(|| {
                self.warning.clear();
                format!("{whose}t = {time_s} s: {DISTRUST_LIFTED}")
            });
        }
        let expired_before = *self.expired_before.get_or_insert(status.setpoints_expired);
        let is_old = status.setpoints_expired == expired_before && is_expiry(&status.message);
        if status.state() != State::Running || status.message.is_empty() || is_old {
            return None;
        }
        self.warning.clone_from(&status.message);
        let by = if is_distrust(&self.warning) { format!(", by t = {time_s} s") } else { String::new() };
        Some(format!("warning: {whose}{}{by}", self.warning))
    }
}

/// The state in a status, in a word; a replay that is paused says so.
pub(super) fn state_word(status: &Status) -> &'static str {
    let paused = status.replay.as_ref().is_some_and(|replay| replay.paused) && status.state() == State::Replaying;
    if paused { State::Paused.as_str_name() } else { status.state().as_str_name() }
}

/// State and simulated time, as a status line begins.
pub(super) fn state_and_time(status: &Status) -> String {
    let time_s = status.stamp.as_ref().map_or(0.0, |stamp| stamp.sim_time_s);
    format!("{:<8} t {time_s:.3} s", state_word(status))
}

/// Formats a status as one line of at most 80 characters; of a run with an end, with the part that is done.
pub(super) fn describe(status: &Status, until_s: Option<f64>) -> String {
    let energy_j = status.kinetic_j.map(|kinetic_j| kinetic_j + status.strain_j.unwrap_or(0.0));
    let parts = [
        left(status, until_s),
        (status.dropped_samples > 0).then(|| format!("dropped {}", status.dropped_samples)),
        status.real_time_factor.map(|factor| format!("rtf {}", significant(factor))),
        status.lateness_p99_s.map(|late_s| format!("late p99 {}", milliseconds(late_s))),
        status.sample_age_p99_s.map(|age_s| format!("age p99 {}", milliseconds(age_s))),
        energy_j.map(|energy_j| format!("energy {} J", significant(energy_j))),
    ];
    let mut line = state_and_time(status);
    for part in parts.into_iter().flatten() {
        if line.chars().count() + 2 + part.chars().count() <= WIDTH {
            line = format!("{line}  {part}");
        }
    }
    line
}

/// Summarizes many services by the slowest and the latest.
fn summary(services: &[ServiceStatus]) -> String {
    let all = || services.iter().filter_map(|service| service.newest.as_ref());
    let running = all().filter(|status| status.state() == State::Running).count();
    let slowest = all().filter_map(|status| status.real_time_factor).reduce(f64::min);
    let latest = all().filter_map(|status| status.lateness_p99_s).reduce(f64::max);
    let dropped: u64 = all().map(|status| status.dropped_samples).sum();
    format!(
        "{running} of {} running{}{}{}",
        services.len(),
        optional("slowest rtf", slowest.map(|factor| format!("{factor:.4}"))),
        optional("worst late p99", latest.map(milliseconds)),
        if dropped > 0 { format!("  dropped {dropped}") } else { String::new() },
    )
}

/// The part of the run that is done, and the time left at the present speed.
fn left(status: &Status, until_s: Option<f64>) -> Option<String> {
    let time_s = status.stamp.as_ref().map_or(0.0, |stamp| stamp.sim_time_s);
    let until_s = until_s.filter(|until_s| *until_s > 0.0)?;
    let percent = (100.0 * time_s / until_s).min(100.0);
    let left_s = status.real_time_factor.map(|factor| (until_s - time_s).max(0.0) / factor).filter(|left_s| *left_s < 1e9);
    let left = left_s.map_or(String::new(), |left_s| format!(", {} left", HumanDuration(Duration::from_secs_f64(left_s))));
    Some(format!("{percent:.0} %{left}"))
}

/// Four significant digits: `0.9998`, `123.4`, `6.543e6`.
fn significant(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        magnitude if !(1e-3..1e5).contains(&magnitude) => format!("{value:.3e}"),
        magnitude => format!("{value:.*}", (3 - magnitude.log10().floor() as i32).max(0) as usize),
    }
}

fn optional(name: &str, value: Option<String>) -> String {
    value.map_or(String::new(), |value| format!("  {name} {value}"))
}

fn milliseconds(value: f64) -> String {
    format!("{:.2} ms", value * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::{setpoint_warning, unbalanced};
    use crate::simulation::SetpointState;
    use crate::wire::Stamp;

    /// The first steps of a pulse can leave the tolerance by a little: the warning stood there, though the run ended with code 0.
    #[test]
    fn regress_a_distrust_that_is_lifted_has_a_line() {
        let epoch = std::cell::Cell::new(1);
        let status = |energy_verdict: EnergyVerdict, sim_time_s: f64, message: &str| Status {
            stamp: Some(Stamp { sim_time_s, epoch: epoch.get(), ..Stamp::default() }),
            state: State::Running.into(),
            energy_verdict: energy_verdict.into(),
            message: message.to_owned(),
            ..Status::default()
        };
        let distrust = unbalanced(9e-6, 6e-4);
        let mut service = ServiceStatus::default();
        let mut line = |verdict, time_s, message: &str| service.line(&status(verdict, time_s, message), "");
        assert_eq!(line(EnergyVerdict::Balanced, 0.5, ""), None);
        let warning = Some(format!("warning: {distrust}, by t = 1.001 s"));
        assert_eq!(line(EnergyVerdict::Unbalanced, 1.001, &distrust), warning);
        assert_eq!(line(EnergyVerdict::Unbalanced, 1.2, &unbalanced(9e-6, 7e-4)), None);
        assert_eq!(line(EnergyVerdict::Balanced, 1.5, ""), Some(format!("t = 1.5 s: {DISTRUST_LIFTED}")));
        assert_eq!(line(EnergyVerdict::Balanced, 2.0, ""), None);
        // A reset begins another run.
        assert!(line(EnergyVerdict::Unbalanced, 2.2, &distrust).is_some());
        epoch.set(2);
        assert_eq!(line(EnergyVerdict::Balanced, 0.0, ""), None);
        // Other warnings are printed once, and stand.
        assert_eq!(line(EnergyVerdict::Balanced, 2.5, "bent"), Some("warning: bent".to_owned()));
        assert_eq!([line(EnergyVerdict::Balanced, 3.0, "bent"), line(EnergyVerdict::Balanced, 3.5, "")], [None, None]);
    }

    /// A resumed session told of an expiry as if it were new.
    #[test]
    fn regress_a_setpoint_that_expired_before_is_not_told_again() {
        let message = setpoint_warning(&SetpointState { expired: true, ..SetpointState::default() }).unwrap_or_default();
        let expired = |setpoints_expired, epoch| Status {
            stamp: Some(Stamp { epoch, ..Stamp::default() }),
            state: State::Running.into(),
            message: message.clone(),
            setpoints_expired,
            ..Status::default()
        };
        let mut resumed = ServiceStatus::default();
        let mut is_told = |count, epoch| resumed.line(&expired(count, epoch), "").is_some();
        assert_eq!([2, 2, 3, 3].map(|count| is_told(count, 1)), [false, false, true, false]);
        // The count begins again with a reset.
        assert_eq!([2, 2].map(|count| is_told(count, 2)), [true, false]);
    }

    #[test]
    fn regress_the_status_line_fits_80_columns_and_shows_what_is_left() {
        let status = Status {
            stamp: Some(Stamp { sim_time_s: 12345.678, ..Stamp::default() }),
            state: State::Running.into(),
            real_time_factor: Some(123.456),
            lateness_p50_s: Some(1e-5),
            lateness_p99_s: Some(12.345e-3),
            spin_s: Some(2e-4),
            kinetic_j: Some(-12.8514),
            strain_j: Some(0.01),
            ..Status::default()
        };
        let line = describe(&status, Some(20000.0));
        assert!(line.starts_with("RUNNING  t 12345.678 s  62 %, ") && line.contains("left  rtf 123.5"), "{line}");
        assert!(line.chars().count() <= 80, "{line}");
        let endless = describe(&status, None);
        assert_eq!(endless, "RUNNING  t 12345.678 s  rtf 123.5  late p99 12.35 ms  energy -12.84 J");
        assert_eq!([0.99984, 1e-9, 6.5432e6, 99.999].map(significant), ["0.9998", "1.000e-9", "6.543e6", "100.00"]);
    }
}
