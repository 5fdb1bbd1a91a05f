//! Plain output for files and pipes: a block of lines a second.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::super::async_runtime::runtime;
use super::super::failure::CommandResult;
use super::super::formatting::decimal;
use super::super::output::of_standard_output;
use super::super::signals::interrupted;
use super::Args;
use super::chosen::ChosenSignals;
use super::samples::{FullestInstant, Samples};
use crate::bus::TopicQueue;
use crate::cli::status_line::{describe, state_and_time, state_word};
use crate::wire::{Energies, Message, NodeState, Shadow, Snapshot, Status, status::State};

/// Time between two looks at new messages.
const REFRESH: Duration = Duration::from_millis(100);
/// Time between two blocks of lines.
const PERIOD: Duration = Duration::from_secs(1);
/// Silence after which a service is gone.
const GONE: Duration = Duration::from_secs(3);
/// Time after the first sample in which chosen signals come.
const PATIENCE: Duration = Duration::from_secs(3);

/// The samples of one instant, and the newest message of the other topics.
#[derive(Default)]
struct Seen {
    chosen: ChosenSignals,
    samples: FullestInstant,
    shadow: Option<Shadow>,
    status: Option<Status>,
}

/// The content of a block of lines, or of a line of JSON.
struct Block<'a> {
    /// Names of the chosen signals; none stands for all.
    chosen: &'a [String],
    samples: &'a Samples,
    /// If there are samples, it has their time, and no energies, which would be those of an earlier instant.
    status: Option<Status>,
    shadow: Option<&'a Shadow>,
}

/// Prints until the service has ended or a signal arrives.
pub(super) fn print(queue: &TopicQueue, snapshot: Snapshot, args: &Args) -> CommandResult<()> {
    let over = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&over);
    // Signals are handled as long as the runtime lives.
    let signals = runtime()?;
    signals.spawn(async move {
        interrupted().await;
        told.store(true, Ordering::Relaxed);
    });
    // A service that is paused publishes its status alone.
    let mut seen = Seen::new(ChosenSignals::new(&args.signals), snapshot);
    let (mut heard, mut printed) = (Instant::now(), None::<Instant>);
    while heard.elapsed() < GONE {
        if over.load(Ordering::Relaxed) {
            return Ok(());
        }
        if let Some(status) = seen.take(queue) {
            heard = Instant::now();
            if [State::Finished, State::Diverged].contains(&status) {
                break;
            }
        }
        let is_due = printed.is_none_or(|printed| printed.elapsed() >= PERIOD) && seen.status.is_some();
        if is_due && seen.chosen.are_there(PATIENCE)? {
            seen.print(args.json, false)?;
            printed = Some(Instant::now());
        }
        std::thread::sleep(REFRESH);
    }
    seen.chosen.are_there(Duration::ZERO)?;
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
    signals: BTreeMap<String, f64>,
}

impl Seen {
    fn new(chosen: ChosenSignals, snapshot: Snapshot) -> Self {
        let Snapshot { displacements, angles, loads, energies, .. } = snapshot;
        let messages = [
            displacements.map(|message| Message::Displacements(message.into())),
            angles.map(|message| Message::Angles(message.into())),
            loads.map(|message| Message::Loads(message.into())),
            energies.map(|message| Message::Energies(message.into())),
        ];
        let mut messages: Vec<Message> = messages.into_iter().flatten().collect();
        messages.sort_by_key(|message| message.stamp().map(|stamp| (stamp.epoch, stamp.step)));
        let mut seen = Seen { chosen, ..Seen::default() };
        for message in messages {
            seen.chosen.add(&message);
            seen.samples.add(message);
        }
        seen
    }

    /// Takes all new messages; returns the state in the newest status, if one came.
    fn take(&mut self, queue: &TopicQueue) -> Option<State> {
        let mut state = None;
        for message in queue.new_messages() {
            self.chosen.add(&message);
            match message {
                Message::Status(status) => {
                    state = Some(status.state());
                    self.status(*status);
                }
                Message::Shadow(shadow) => self.shadow = Some(*shadow),
                sample => self.samples.add(sample),
            }
        }
        state
    }

    fn status(&mut self, status: Status) {
        self.samples.begin_epoch(status.stamp.map_or(0, |stamp| stamp.epoch));
        self.status = Some(status);
    }

    fn print(&mut self, json: bool, ended: bool) -> CommandResult<()> {
        let block = self.block();
        let text = match json {
            true => serde_json::to_string(&block.line(ended)).map_err(std::io::Error::from)?,
            false => block.lines().join("\n"),
        };
        Ok(writeln!(std::io::stdout(), "{text}").map_err(of_standard_output)?)
    }

    fn block(&mut self) -> Block<'_> {
        let samples = self.samples.look();
        let status = self.status.clone().map(|status| match samples.stamp {
            Some(_) => Status {
                stamp: samples.stamp,
                kinetic_j: None,
                strain_j: None,
                potential_j: None,
                work_in_j: None,
                dissipated_j: None,
                balance_error_j: None,
                ..status
            },
            None => status,
        });
        Block { chosen: &self.chosen.names, samples, status, shadow: self.shadow.as_ref() }
    }
}

impl Block<'_> {
    fn line(&self, ended: bool) -> Line<'_> {
        let status = self.status.as_ref();
        let stamp = self.samples.stamp.or(status.and_then(|status| status.stamp));
        Line {
            state: status.map(|status| state_word(status).to_lowercase()),
            sim_time_s: stamp.map(|stamp| stamp.sim_time_s),
            real_time_factor: status.and_then(|status| status.real_time_factor),
            message: status.map(|status| status.message.as_str()).filter(|message| !message.is_empty()),
            ended,
            signals: self.signals(),
        }
    }

    /// The chosen signals by the names given for them, as far as they are there; or all. Those of a shadow may be of another instant, and
    /// have its time.
    fn signals(&self) -> BTreeMap<String, f64> {
        let mut all = self.samples.signals();
        self.status.iter().for_each(|status| all.status(status));
        self.shadow.iter().for_each(|shadow| all.shadow(shadow));
        let now = |name: &str| Some((name.to_owned(), all.find(name)?.now));
        match self.chosen {
            [] => all.names().filter_map(now).collect(),
            names => names.iter().filter_map(|name| now(name)).collect(),
        }
    }

    /// One line: state, time and the chosen signals.
    fn chosen_line(&self, status: &Status) -> String {
        let signals = self.signals();
        let shown = |name: &String| {
            let value = signals.get(name).map_or("–".to_owned(), |value| format!("{value:.6e}"));
            format!("  {name} {value:>13}")
        };
        format!("{}{}", state_and_time(status), self.chosen.iter().map(shown).collect::<String>())
    }

    fn lines(&self) -> Vec<String> {
        if !self.chosen.is_empty() {
            return self.status.iter().map(|status| self.chosen_line(status)).collect();
        }
        let Samples { angles, displacements, loads, energies, .. } = self.samples;
        let mut lines = Vec::new();
        lines.extend(self.status.as_ref().map(|status| describe(status, None)));
        lines.extend(self.status.as_ref().map(|status| status.message.clone()).filter(|message| !message.is_empty()));
        for link in angles.iter().flat_map(|angles| &angles.links) {
            lines.push(format!(
                "{:<12} angle {:>12} rad   rate {:>12} rad/s   turns {}",
                link.link,
                decimal(link.chord_rad, 6),
                decimal(link.rate_rad_per_s, 6),
                link.revolutions
            ));
        }
        for node in displacements.iter().flat_map(|all| &all.nodes) {
            let [x_m, y_m] = [node.x_m, node.y_m].map(|place_m| decimal(place_m, 6));
            lines.extend(name_of(node).map(|name| format!("{name:<12} x {x_m:>14} m     y {y_m:>14} m")));
        }
        if let Some(loads) = loads {
            lines.push(format!("{:<12} {:>18} N·m", "torque", decimal(loads.driving_torque_nm, 6)));
            for joint in &loads.joints {
                let [fx_n, fy_n] = [joint.fx_n, joint.fy_n].map(|force_n| decimal(force_n, 4));
                lines.push(format!("{:<12} x {fx_n:>14} N     y {fy_n:>14} N", joint.joint));
            }
        }
        if let Some(Energies { kinetic_j, strain_j, potential_j, balance_error_j, .. }) = energies {
            let total_j: f64 = [kinetic_j, strain_j, potential_j].into_iter().flatten().sum();
            let (total, balance_j) = (decimal(total_j, 6), balance_error_j.unwrap_or(0.0));
            lines.push(format!("{:<12} {total:>18} J     balance {balance_j:>8.0e} J", "energy"));
        }
        if let Some(shadow) = self.shadow {
            let of = format!("shadow {}", shadow.model);
            let at = shadow.stamp.map_or(String::new(), |stamp| format!("   at t {:.3} s", stamp.sim_time_s));
            lines.push(format!("{of:<12} angle {:>12.1e} rad   end {:>13.1e} m{at}", shadow.angle_rad, shadow.end_x_m));
        }
        lines
    }
}

/// Name of a node; masses count from 1, as in figures. `None` of a link's first node: it is the pivot, or the last node of the link
/// before it.
fn name_of(NodeState { link, index, .. }: &NodeState) -> Option<String> {
    match (link.as_str(), *index) {
        ("mass", index) => Some(format!("mass {}", u64::from(index) + 1)),
        (_, 0) => None,
        (link, index) => Some(format!("{link} node {index}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Angles, Displacements, LinkAngle, Stamp};

    fn at(sim_time_s: f64, step: u64, epoch: u64) -> Option<Stamp> {
        Some(Stamp { step, sim_time_s, epoch, ..Stamp::default() })
    }

    #[test]
    fn regress_a_block_has_one_time_and_one_energy() {
        let mut seen = Seen::default();
        let status = Status { stamp: at(1.0, 100, 0), state: State::Running.into(), kinetic_j: Some(5.0), ..Status::default() };
        seen.status(status.clone());
        assert_eq!(seen.block().lines(), ["RUNNING  t 1.000 s  energy 5.000 J"], "as of a start that fails");
        seen.status(Status { message: "not to be trusted: …".to_owned(), ..status.clone() });
        assert_eq!(seen.block().lines()[1..], ["not to be trusted: …"]);
        seen.status(status.clone());
        let link = LinkAngle { link: "crank".to_owned(), chord_rad: 2.5, ..LinkAngle::default() };
        seen.samples.add(Message::Angles(Box::new(Angles { stamp: at(1.3, 130, 0), links: vec![link], ..Angles::default() })));
        assert_eq!(seen.block().signals().get("kinetic_j"), None, "of another instant");
        let energies = Energies { stamp: at(1.3, 130, 0), kinetic_j: Some(7.0), ..Energies::default() };
        seen.samples.add(Message::Energies(Box::new(energies)));
        let block = seen.block();
        let (line, lines) = (block.line(false), block.lines());
        assert_eq!(line.sim_time_s, Some(1.3));
        assert_eq!(["kinetic_j", "crank.chord_rad"].map(|name| line.signals.get(name).copied()), [Some(7.0), Some(2.5)]);
        assert_eq!(lines[0], "RUNNING  t 1.300 s");
        assert!(lines.iter().any(|line| line.starts_with("energy") && line.contains(" 7.000000 J")), "{lines:?}");
        seen.status(Status { stamp: at(0.0, 0, 1), ..status });
        assert_eq!(seen.block().lines(), ["RUNNING  t 0.000 s  energy 5.000 J"], "a reset while paused has no samples");
    }

    #[test]
    fn val_only_the_chosen_signals_are_printed() {
        let names = ["links.crank.chord_rad", "kinetic_j"].map(str::to_owned);
        let mut seen = Seen::new(ChosenSignals::new(&names), Snapshot::default());
        let link = LinkAngle { link: "crank".to_owned(), chord_rad: -2.5e-7, ..LinkAngle::default() };
        seen.status(Status { stamp: at(1.0, 100, 0), state: State::Running.into(), ..Status::default() });
        seen.samples.add(Message::Angles(Box::new(Angles { stamp: at(1.3, 130, 0), links: vec![link], ..Angles::default() })));
        let block = seen.block();
        assert_eq!(block.lines(), ["RUNNING  t 1.300 s  links.crank.chord_rad  -2.500000e-7  kinetic_j             –"]);
        assert_eq!(block.line(false).signals, BTreeMap::from([("links.crank.chord_rad".to_owned(), -2.5e-7)]));
    }

    /// The first mass was left out, as the first node of a link is.
    #[test]
    fn regress_every_mass_of_an_oscillator_has_a_line() {
        let names = |nodes: &[(&str, u32)]| {
            let node = |(link, index): (&str, u32)| NodeState { link: link.to_owned(), index, ..NodeState::default() };
            let nodes = nodes.iter().copied().map(node).collect();
            let mut seen = Seen::default();
            seen.samples.add(Message::Displacements(Box::new(Displacements { stamp: at(1.0, 100, 0), nodes })));
            let lines = seen.block().lines();
            lines.iter().filter_map(|line| line.split_once(" x ")).map(|(name, _)| name.trim().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(names(&[("mass", 0)]), ["mass 1"]);
        assert_eq!(names(&[("mass", 0), ("mass", 1)]), ["mass 1", "mass 2"]);
        let chain = [("crank", 0), ("crank", 1), ("rod", 0), ("rod", 1), ("rod", 2)];
        assert_eq!(names(&chain), ["crank node 1", "rod node 1", "rod node 2"], "a link begins at a pin that is there already");
    }

    #[test]
    fn prop_a_shadow_has_its_own_time() {
        let mut seen = Seen::default();
        let shadow = Shadow { stamp: at(1.25, 125, 0), model: "modal".to_owned(), angle_rad: 1e-3, ..Shadow::default() };
        seen.shadow = Some(shadow);
        let block = seen.block();
        assert_eq!(block.signals().get("shadow.sim_time_s"), Some(&1.25));
        assert!(block.lines().iter().any(|line| line.ends_with(" m   at t 1.250 s")), "{:?}", block.lines());
    }
}
