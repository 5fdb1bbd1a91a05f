//! Plain output for files and pipes: a block of lines a second.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::super::async_runtime::runtime;
use super::super::failure::CommandResult;
use super::super::output::of_standard_output;
use super::super::signals::interrupted;
use super::Args;
use super::signals::Signals;
use super::subscribers::Subscribers;
use crate::cli::status_line::{describe, state_word};
use crate::wire::{Angles, Displacements, Energies, Loads, Shadow, Snapshot, Status, status::State};

/// Time between two looks at new messages.
const REFRESH: Duration = Duration::from_millis(100);
/// Time between two blocks of lines.
const PERIOD: Duration = Duration::from_secs(1);
/// Silence after which a service is gone.
const GONE: Duration = Duration::from_secs(3);

/// The newest message of each topic, and all signals by name.
#[derive(Default)]
struct Seen {
    angles: Option<Angles>,
    displacements: Option<Displacements>,
    loads: Option<Loads>,
    energies: Option<Energies>,
    shadow: Option<Shadow>,
    status: Option<Status>,
    signals: Signals,
}

/// Prints until the service has ended or a signal arrives.
pub(super) fn print(subscribers: &Subscribers, snapshot: Snapshot, args: &Args) -> CommandResult<()> {
    let over = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&over);
    // Signals are handled as long as the runtime lives.
    let signals = runtime()?;
    signals.spawn(async move {
        interrupted().await;
        told.store(true, Ordering::Relaxed);
    });
    // A service that is paused publishes its status alone.
    let mut seen = Seen::from(snapshot);
    let (mut heard, mut printed) = (Instant::now(), None::<Instant>);
    while heard.elapsed() < GONE {
        if over.load(Ordering::Relaxed) {
            return Ok(());
        }
        if let Some(status) = seen.take(subscribers) {
            heard = Instant::now();
            if [State::Finished, State::Diverged].contains(&status) {
                break;
            }
        }
        if printed.is_none_or(|printed| printed.elapsed() >= PERIOD) && seen.status.is_some() {
            seen.print(args.json, false)?;
            printed = Some(Instant::now());
        }
        std::thread::sleep(REFRESH);
    }
    seen.print(args.json, true)?;
    if !args.json {
        writeln!(std::io::stdout(), "flexcrank/{} has ended", args.name).map_err(of_standard_output)?;
    }
    Ok(())
}

/// A line of JSON.
#[derive(Serialize)]
struct Line<'a> {
    state: Option<String>,
    sim_time_s: Option<f64>,
    real_time_factor: Option<f64>,
    message: Option<&'a str>,
    /// Whether the service has ended; this is the last line then.
    ended: bool,
    signals: BTreeMap<&'a str, f64>,
}

impl From<Snapshot> for Seen {
    fn from(snapshot: Snapshot) -> Self {
        let Snapshot { displacements, angles, loads, energies, .. } = snapshot;
        let mut signals = Signals::default();
        // Loads first, because they show whether there is a slider.
        loads.iter().for_each(|loads| signals.loads(loads));
        energies.iter().for_each(|energies| signals.energies(energies));
        angles.iter().for_each(|angles| signals.angles(angles));
        displacements.iter().for_each(|displacements| signals.displacements(displacements));
        Seen { displacements, angles, loads, energies, signals, ..Seen::default() }
    }
}

impl Seen {
    /// Takes all new messages; returns the state in the newest status, if one came.
    fn take(&mut self, subscribers: &Subscribers) -> Option<State> {
        self.loads = subscribers.loads().inspect(|loads| self.signals.loads(loads)).last().or(self.loads.take());
        self.energies = subscribers.energies().inspect(|all| self.signals.energies(all)).last().or(self.energies.take());
        self.angles = subscribers.angles().inspect(|angles| self.signals.angles(angles)).last().or(self.angles.take());
        self.shadow = subscribers.shadows().inspect(|shadow| self.signals.shadow(shadow)).last().or(self.shadow.take());
        let displacements = subscribers.displacements().inspect(|all| self.signals.displacements(all)).last();
        self.displacements = displacements.or(self.displacements.take());
        let status = subscribers.statuses().inspect(|status| self.signals.status(status)).last()?;
        let state = status.state();
        self.status = Some(status);
        Some(state)
    }

    fn print(&self, json: bool, ended: bool) -> CommandResult<()> {
        let text =
            if json { serde_json::to_string(&self.line(ended)).map_err(std::io::Error::from)? } else { self.lines().join("\n") };
        Ok(writeln!(std::io::stdout(), "{text}").map_err(of_standard_output)?)
    }

    fn line(&self, ended: bool) -> Line<'_> {
        let status = self.status.as_ref();
        let now = |name| Some((name, self.signals.find(name)?.now));
        Line {
            state: status.map(|status| state_word(status).to_lowercase()),
            sim_time_s: status.and_then(|status| Some(status.stamp.as_ref()?.sim_time_s)),
            real_time_factor: status.and_then(|status| status.real_time_factor),
            message: status.map(|status| status.message.as_str()).filter(|message| !message.is_empty()),
            ended,
            signals: self.signals.names().filter_map(now).collect(),
        }
    }

    fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        lines.extend(self.status.as_ref().map(|status| describe(status, None)));
        for link in self.angles.iter().flat_map(|angles| &angles.links) {
            lines.push(format!(
                "{:<12} angle {:>12.6} rad   rate {:>12.6} rad/s   turns {}",
                link.link, link.chord_rad, link.rate_rad_per_s, link.revolutions
            ));
        }
        for node in self.displacements.iter().flat_map(|all| &all.nodes).filter(|node| node.index > 0) {
            lines.push(format!(
                "{:<12} x {:>14.6} m     y {:>14.6} m",
                format!("{} node {}", node.link, node.index),
                node.x_m,
                node.y_m
            ));
        }
        if let Some(loads) = &self.loads {
            lines.push(format!("{:<12} {:>18.6} N·m", "torque", loads.driving_torque_nm));
            for joint in &loads.joints {
                lines.push(format!("{:<12} x {:>14.4} N     y {:>14.4} N", joint.joint, joint.fx_n, joint.fy_n));
            }
        }
        if let Some(Energies { kinetic_j, strain_j, potential_j, balance_error_j, .. }) = &self.energies {
            let total_j: f64 = [kinetic_j, strain_j, potential_j].into_iter().flatten().sum();
            lines.push(format!("{:<12} {total_j:>18.6} J     balance {:>8.0e} J", "energy", balance_error_j.unwrap_or(0.0)));
        }
        if let Some(shadow) = &self.shadow {
            let of = format!("shadow {}", shadow.model);
            lines.push(format!("{of:<12} angle {:>12.1e} rad   end {:>13.1e} m", shadow.angle_rad, shadow.end_x_m));
        }
        lines
    }
}
