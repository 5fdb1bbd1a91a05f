//! `watch`: shows a service in the terminal, as a picture or as lines.
//!
//! [`state::View`] holds the state, [`draw`] draws it; this module handles bus, keys and terminal.

mod bending;
mod chart;
mod chosen;
mod draw;
mod mechanism;
mod plain;
mod samples;
mod signals;
mod state;
mod strip;
#[cfg(test)]
mod tests;

use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use clap_complete::engine::ArgValueCandidates;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event};

use super::async_runtime::runtime;
use super::client_args::ClientArgs;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::replies::{format_reply, fresh_id};
use super::signals::{Interruption, interrupted};
use super::values::{GivenDuration, pulse_duration, torque};
use crate::bus::{self, Name, Session, Topic, TopicQueue, client};
use crate::scene::PulseShape;
use crate::simulation::PulseRequest;
use crate::wire::{self, CommandReply, Control, Message, control};
use state::{KeyRequest, View};

/// Time between two frames: short enough to look smooth, long enough for a slow connection.
const FRAME: Duration = Duration::from_millis(66);
/// Topics that are shown.
const TOPICS: &[Topic] = &[Topic::Displacements, Topic::Angles, Topic::Loads, Topic::Energies, Topic::Shadow, Topic::Status];

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank watch crank
  flexcrank watch crank --signals crank.rate_rad_per_s,slider.x_m,pivot.fx_n
  flexcrank watch crank --torque -2 --duration 0.5        what the key p sends
  flexcrank watch ghost                                   a replay, as well
  flexcrank watch crank --plain | tee log.txt
  flexcrank watch crank --plain --signals crank.rate_rad_per_s,kinetic_j

Keys: space pauses and resumes, r resets, p sends a pulse; Tab goes to the next chart, up and down choose its signal, left and \
    right what the charts span; + and - change how much bending is magnified, a lets it be chosen; q quits.

The second line shows the real-time factor (rtf), how late steps begin (half of them, 99 % of them, the worst), missed deadlines \
    (overruns), and the energy balance: energy that the computation lost or gained, which should be near 0. With `run --shadow`, the \
    first line shows the difference of the crank's angle, and shadow.angle_rad can be a chart.";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Name of the service.
    #[arg(default_value = "crank", add = ArgValueCandidates::new(completions::services))]
    pub name: Name,
    /// Draw these signals over time, or with --plain print only these: named as by export, with or without the name of the list.
    /// Of nodes, places and deflections are there; `watch --plain --json` prints all signals by name.
    /// slider.x_m and slider.vx_m_per_s are names of watch alone, for the last node of the rod.
    #[arg(long, value_name = "SIGNAL", value_delimiter = ',')]
    pub signals: Vec<String>,
    /// Mean torque of the pulse that the key p sends, N·m.
    #[arg(long, value_name = "NM", default_value = "5", value_parser = torque)]
    pub torque: f64,
    /// Duration of that pulse.
    #[arg(long, value_name = "TIME", default_value = "0.1", value_parser = pulse_duration)]
    pub duration: GivenDuration,
    /// Print lines, as without a terminal: no charts, no keys. With --signals, one line a second: state, time and these.
    #[arg(long, conflicts_with_all = ["torque", "duration"])]
    pub plain: bool,
    /// With --plain, print one JSON object a second: state, sim_time_s, real_time_factor, message, ended (true in the last line,
    /// once the service has ended), and in an object signals all signals at that time, or those of --signals, by name.
    #[arg(long, requires = "plain", conflicts_with_all = ["torque", "duration"])]
    pub json: bool,
    #[command(flatten)]
    pub client: ClientArgs,
}

pub(super) fn watch(args: &Args) -> CommandResult {
    args.duration.suspect_pulse("--duration").iter().for_each(|warning| say!("warning: {warning}"));
    let plain = args.plain || !std::io::stdout().is_terminal() || !std::io::stdin().is_terminal();
    // While it waits for the service, it ends as other commands.
    let waiting = Interruption::watch()?;
    let session = args.client.open_to_read(&args.name)?;
    drop(waiting);
    let watched = show(&session, args, plain);
    bus::close(&session)?;
    watched
}

fn show(session: &Session, args: &Args, plain: bool) -> CommandResult {
    let queue = TopicQueue::subscribe(session, &args.name, TOPICS)?;
    if plain {
        plain::print(&queue, client::snapshot(session, &args.name).unwrap_or_default(), args)?;
        return Ok(ExitStatus::Success);
    }
    let mut view = View::new(args.name.clone(), args.signals.clone());
    view.snapshot(client::snapshot(session, &args.name).unwrap_or_default());
    let pulse = PulseRequest {
        torque_nm: args.torque,
        duration_s: args.duration.duration_s,
        delay_s: 0.0,
        shape: PulseShape::Rectangular,
    };
    let (requests, said) = speaker(session.clone(), args.name.clone(), pulse)?;
    // Signals are handled as long as the runtime lives.
    let signals = runtime()?;
    let over = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&over);
    signals.spawn(async move {
        interrupted().await;
        told.store(true, Ordering::Relaxed);
    });
    super::log::mute();
    let mut terminal = Screen::open()?;
    let events = listener()?;
    let mut heard = Instant::now();
    while !over.load(Ordering::Relaxed) {
        if take(&queue, &mut view) {
            heard = Instant::now();
        }
        view.silence = heard.elapsed();
        view.said = said.try_iter().last().unwrap_or(view.said);
        let drawn = terminal.0.draw(|frame| draw::draw(frame, &mut view)).map(drop);
        if is_gone() {
            // The terminal is gone, so it cannot be restored.
            std::mem::forget(terminal);
            break;
        }
        drawn?;
        if keys(&events, &mut view, &requests)? {
            break;
        }
    }
    Ok(ExitStatus::Success)
}

/// Whether the terminal is gone: its window was closed, or its connection lost.
fn is_gone() -> bool {
    rustix::termios::tcgetattr(std::io::stdin()).is_err()
}

/// A terminal in drawing mode. Dropping it restores the terminal; a panic restores it before its message is printed.
struct Screen(DefaultTerminal);

impl Screen {
    fn open() -> std::io::Result<Self> {
        // Undoes the changes to the terminal if one of them failed.
        ratatui::try_init().map(Screen).inspect_err(|_| ratatui::restore())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// Adds new messages to the view. Returns whether a status arrived.
fn take(queue: &TopicQueue, view: &mut View) -> bool {
    let mut heard = false;
    for message in queue.new_messages() {
        heard |= matches!(message, Message::Status(_));
        view.message(message);
    }
    heard
}

/// Reads terminal events on a thread of its own: on a terminal that is gone, reading returns its end forever.
fn listener() -> std::io::Result<Receiver<Event>> {
    let (events, heard) = channel();
    std::thread::Builder::new().name("keyboard".to_owned()).spawn(move || {
        while let Ok(event) = event::read()
            && events.send(event).is_ok()
        {}
    })?;
    Ok(heard)
}

/// Handles keys until the next frame is due; returns whether to quit.
fn keys(events: &Receiver<Event>, view: &mut View, requests: &Sender<KeyRequest>) -> CommandResult<bool> {
    let due = Instant::now() + FRAME;
    loop {
        let event = match events.recv_timeout(due.saturating_duration_since(Instant::now())) {
            Ok(event) => event,
            Err(RecvTimeoutError::Timeout) => return Ok(false),
            Err(RecvTimeoutError::Disconnected) => return Err(Failure::Failed("the terminal cannot be read".to_owned())),
        };
        let Event::Key(key) = event else { continue };
        match view.key(key) {
            Some(KeyRequest::Quit) => return Ok(true),
            Some(ask) => {
                "…".clone_into(&mut view.said);
                requests.send(ask).map_err(|_| Failure::Failed("commands can no longer be sent".to_owned()))?;
            }
            None => {}
        }
    }
}

/// Sends requests to the service on a thread of its own, because replies take time.
fn speaker(session: Session, name: Name, pulse: PulseRequest) -> std::io::Result<(Sender<KeyRequest>, Receiver<String>)> {
    let (requests, asked) = channel::<KeyRequest>();
    let (answers, said) = channel();
    std::thread::Builder::new().name("speaker".to_owned()).spawn(move || {
        for ask in asked {
            if answers.send(obey(&session, &name, ask, &pulse)).is_err() {
                return;
            }
        }
    })?;
    Ok((requests, said))
}

fn obey(session: &Session, name: &Name, ask: KeyRequest, pulse: &PulseRequest) -> String {
    let control = |action| client::control(session, name, &Control { id: fresh_id(), action: Some(action) });
    let (word, reply) = match ask {
        KeyRequest::Quit => return String::new(),
        KeyRequest::Pulse => ("pulse", client::pulse(session, name, &wire::pulse_message(&fresh_id(), pulse))),
        KeyRequest::Pause => ("pause", control(control::Action::Pause(wire::Pause {}))),
        KeyRequest::Resume => ("resume", control(control::Action::Resume(wire::Resume {}))),
        KeyRequest::Reset => ("reset", control(control::Action::Reset(wire::Reset {}))),
    };
    let reply = reply.map_or_else(|error| error.to_string(), |reply| format_reply(&CommandReply { id: String::new(), ..reply }));
    format!("{word} {reply}")
}
