//! Plain output for files and pipes: a block of lines a second.

use std::io::Write as _;
use std::time::{Duration, Instant};

use super::super::failure::CommandResult;
use super::subscribers::Subscribers;
use crate::cli::status_line::describe;
use crate::wire::{Angles, Displacements, Energies, Loads, Status, status::State};

/// Time between two looks at new messages.
const REFRESH: Duration = Duration::from_millis(100);
/// Time between two blocks of lines.
const PERIOD: Duration = Duration::from_secs(1);
/// Silence after which a service is gone.
const GONE: Duration = Duration::from_secs(3);

/// The newest message of each topic.
#[derive(Default)]
struct Seen {
    angles: Option<Angles>,
    displacements: Option<Displacements>,
    loads: Option<Loads>,
    energies: Option<Energies>,
    status: Option<Status>,
}

/// Prints until the service has ended.
pub(super) fn print(subscribers: &Subscribers) -> CommandResult<()> {
    let mut seen = Seen::default();
    let (mut heard, mut printed) = (Instant::now(), None::<Instant>);
    while heard.elapsed() < GONE {
        seen.angles = subscribers.angles().last().or(seen.angles);
        seen.displacements = subscribers.displacements().last().or(seen.displacements);
        seen.loads = subscribers.loads().last().or(seen.loads);
        seen.energies = subscribers.energies().last().or(seen.energies);
        if let Some(status) = subscribers.statuses().last() {
            heard = Instant::now();
            let over = [State::Finished, State::Diverged].contains(&status.state());
            seen.status = Some(status);
            if over {
                break;
            }
        }
        if printed.is_none_or(|printed| printed.elapsed() >= PERIOD) && seen.status.is_some() {
            seen.print()?;
            printed = Some(Instant::now());
        }
        std::thread::sleep(REFRESH);
    }
    seen.print()
}

impl Seen {
    fn print(&self) -> CommandResult<()> {
        writeln!(std::io::stdout(), "{}", self.lines().join("\n"))?;
        Ok(())
    }

    fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        lines.extend(self.status.as_ref().map(describe));
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
        lines
    }
}
