//! `watch`: a service's live values in the terminal.

use std::io::{IsTerminal as _, Write as _};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use super::Done;
use super::args::Watch;
use super::live::describe;
use crate::bus::{self, Session, Topic, client};
use crate::wire::{Angles, Displacements, Loads, Status, status::State};

/// Between two looks at what has arrived.
const REFRESH: Duration = Duration::from_millis(100);
/// Between two blocks of lines where there is no terminal.
const PLAIN: Duration = Duration::from_secs(1);
/// A service that is silent for so long is gone.
const GONE: Duration = Duration::from_secs(3);

/// The newest of everything.
#[derive(Default)]
struct Seen {
    angles: Option<Angles>,
    displacements: Option<Displacements>,
    loads: Option<Loads>,
    status: Option<Status>,
}

pub(super) fn watch(args: &Watch) -> anyhow::Result<Done> {
    let session = args.bus.options().open_client()?;
    let watched = client::find(&session, &args.name).map_err(anyhow::Error::from).and_then(|()| show(&session, args));
    bus::close(&session)?;
    watched
}

fn show(session: &Session, args: &Watch) -> anyhow::Result<Done> {
    let subscribe = |topic| client::subscribe(session, &args.name, topic);
    let (angles, displacements) = (subscribe(Topic::Angles)?, subscribe(Topic::Displacements)?);
    let (loads, status) = (subscribe(Topic::Loads)?, subscribe(Topic::Status)?);
    let mut screen = Screen::new()?;
    let mut seen = Seen::default();
    let mut heard = Instant::now();
    while heard.elapsed() < GONE {
        seen.angles = client::newest(&angles).or(seen.angles);
        seen.displacements = client::newest(&displacements).or(seen.displacements);
        seen.loads = client::newest(&loads).or(seen.loads);
        if let Some(status) = client::newest::<Status>(&status) {
            heard = Instant::now();
            let over = [State::Finished, State::Diverged].contains(&status.state());
            seen.status = Some(status);
            if over {
                break;
            }
        }
        screen.show(&seen.lines())?;
        std::thread::sleep(REFRESH);
    }
    screen.close(&seen.lines())?;
    writeln!(std::io::stdout(), "flexcrank/{} has ended", args.name)?;
    Ok(Done::Well)
}

impl Seen {
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
        lines
    }
}

/// Lines that are overwritten on a terminal, and printed once a second elsewhere.
struct Screen {
    all: MultiProgress,
    lines: Vec<ProgressBar>,
    style: ProgressStyle,
    plain: bool,
    printed: Option<Instant>,
}

impl Screen {
    fn new() -> anyhow::Result<Self> {
        let style = ProgressStyle::with_template("{msg}")?;
        let plain = !std::io::stderr().is_terminal();
        Ok(Screen { all: MultiProgress::new(), lines: Vec::new(), style, plain, printed: None })
    }

    fn show(&mut self, lines: &[String]) -> anyhow::Result<()> {
        if self.plain {
            if self.printed.is_none_or(|printed| printed.elapsed() >= PLAIN) && !lines.is_empty() {
                writeln!(std::io::stdout(), "{}", lines.join("\n"))?;
                self.printed = Some(Instant::now());
            }
            return Ok(());
        }
        while self.lines.len() < lines.len() {
            let line = self.all.add(ProgressBar::new_spinner());
            line.set_style(self.style.clone());
            self.lines.push(line);
        }
        for (line, text) in self.lines.iter().zip(lines) {
            line.set_message(text.clone());
        }
        Ok(())
    }

    /// Leaves the last lines standing.
    fn close(self, lines: &[String]) -> anyhow::Result<()> {
        self.all.clear()?;
        writeln!(std::io::stdout(), "{}", lines.join("\n"))?;
        Ok(())
    }
}
