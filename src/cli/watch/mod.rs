//! `watch`: a service as a picture in the terminal, or as lines.
//!
//! [`state::View`] is what is known, [`draw`] what is seen of it; the bus, the keys and the terminal are here.

mod bending;
mod chart;
mod draw;
mod feed;
mod mechanism;
mod plain;
mod signals;
mod state;
mod strip;
#[cfg(test)]
mod tests;

use std::io::{IsTerminal as _, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event};

use super::Done;
use super::args::Bus;
use super::clients::{fresh_id, sentence};
use super::live::runtime;
use super::signals::interrupted;
use crate::bus::{self, Name, Session, client};
use crate::scene::PulseShape;
use crate::simulation::PulseRequest;
use crate::wire::{self, CommandReply, Control, control};
use feed::Feed;
use state::{Ask, View};

/// Between two pictures: often enough to look alive, seldom enough for a slow line.
const FRAME: Duration = Duration::from_millis(66);

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank watch crank
  flexcrank watch crank --signals crank.rate_rad_per_s,slider.x_m,pivot.fx_n
  flexcrank watch crank --torque -2 --duration 0.5        what the key p sends
  flexcrank watch ghost                                   a replay, as well
  flexcrank watch crank --plain | tee log.txt

Keys: space pauses and resumes, r resets, p sends a pulse; Tab goes to the next chart, up and down choose its signal, left and \
    right what the charts span; + and - change how much bending is magnified, a lets it be chosen; q quits.";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The service.
    #[arg(default_value = "crank")]
    pub name: Name,
    /// Draw these signals over time: named as by export, with or without the list they are in.
    #[arg(long, value_name = "SIGNAL", value_delimiter = ',')]
    pub signals: Vec<String>,
    /// Mean torque of the pulse that the key p sends, N·m.
    #[arg(long, value_name = "NM", default_value = "5")]
    pub torque: f64,
    /// Its duration, s.
    #[arg(long, value_name = "S", default_value = "0.1")]
    pub duration: f64,
    /// Print lines, as happens where there is no terminal; no signals are drawn, and no keys heard.
    #[arg(long, conflicts_with_all = ["signals", "torque", "duration"])]
    pub plain: bool,
    #[command(flatten)]
    pub bus: Bus,
}

pub(super) fn watch(args: &Args) -> anyhow::Result<Done> {
    let session = args.bus.options().open_client()?;
    let watched = client::wait_for_service(&session, &args.name).map_err(anyhow::Error::from).and_then(|()| show(&session, args));
    bus::close(&session)?;
    watched
}

fn show(session: &Session, args: &Args) -> anyhow::Result<Done> {
    let feed = Feed::subscribe(session, &args.name)?;
    if args.plain || !std::io::stdout().is_terminal() || !std::io::stdin().is_terminal() {
        plain::print(&feed)?;
        writeln!(std::io::stdout(), "flexcrank/{} has ended", args.name)?;
        return Ok(Done::Well);
    }
    let mut view = View::new(args.name.clone(), args.signals.clone());
    view.snapshot(client::snapshot(session, &args.name).unwrap_or_default());
    let pulse = PulseRequest { torque_nm: args.torque, duration_s: args.duration, delay_s: 0.0, shape: PulseShape::Rectangular };
    let (asks, said) = speaker(session.clone(), args.name.clone(), pulse)?;
    // Signals are heard as long as this lives.
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
        if take(&feed, &mut view) {
            heard = Instant::now();
        }
        view.silence = heard.elapsed();
        view.said = said.try_iter().last().unwrap_or(view.said);
        let drawn = terminal.0.draw(|frame| draw::draw(frame, &mut view)).map(drop);
        if is_gone() {
            // Nothing is left that could be put back.
            std::mem::forget(terminal);
            break;
        }
        drawn?;
        if keys(&events, &mut view, &asks)? {
            break;
        }
    }
    Ok(Done::Well)
}

/// Whether the terminal is no more: its window was closed, or its line was cut.
fn is_gone() -> bool {
    rustix::termios::tcgetattr(std::io::stdin()).is_err()
}

/// A terminal that shows the view. It is put back as it was when this is dropped; in a panic, before the panic is told.
struct Screen(DefaultTerminal);

impl Screen {
    fn open() -> std::io::Result<Self> {
        // What was done to the terminal before something failed is undone.
        ratatui::try_init().map(Screen).inspect_err(|_| ratatui::restore())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// Takes what has arrived, loads first: they say what there is. Whether the service has said how it is.
fn take(feed: &Feed, view: &mut View) -> bool {
    feed.loads().for_each(|loads| view.loads(&loads));
    feed.energies().for_each(|energies| view.energies(&energies));
    feed.angles().for_each(|angles| view.angles(&angles));
    feed.displacements().for_each(|displacements| view.displacements(displacements));
    feed.statuses().map(|status| view.status(status)).count() > 0
}

/// What comes from the terminal, read on a thread of its own: of a terminal that is gone, the end is read for ever.
fn listener() -> std::io::Result<Receiver<Event>> {
    let (events, heard) = channel();
    std::thread::Builder::new().name("keyboard".to_owned()).spawn(move || {
        while let Ok(event) = event::read()
            && events.send(event).is_ok()
        {}
    })?;
    Ok(heard)
}

/// Obeys keys until the next picture is due; whether to quit.
fn keys(events: &Receiver<Event>, view: &mut View, asks: &Sender<Ask>) -> anyhow::Result<bool> {
    let due = Instant::now() + FRAME;
    loop {
        let event = match events.recv_timeout(due.saturating_duration_since(Instant::now())) {
            Ok(event) => event,
            Err(RecvTimeoutError::Timeout) => return Ok(false),
            Err(RecvTimeoutError::Disconnected) => anyhow::bail!("the terminal cannot be read"),
        };
        let Event::Key(key) = event else { continue };
        match view.key(key) {
            Some(Ask::Quit) => return Ok(true),
            Some(ask) => {
                "…".clone_into(&mut view.said);
                asks.send(ask)?;
            }
            None => {}
        }
    }
}

/// Says to the service what keys ask for, on a thread of its own: an answer can take its time.
fn speaker(session: Session, name: Name, pulse: PulseRequest) -> std::io::Result<(Sender<Ask>, Receiver<String>)> {
    let (asks, asked) = channel::<Ask>();
    let (answers, said) = channel();
    std::thread::Builder::new().name("speaker".to_owned()).spawn(move || {
        for ask in asked {
            if answers.send(obey(&session, &name, ask, &pulse)).is_err() {
                return;
            }
        }
    })?;
    Ok((asks, said))
}

fn obey(session: &Session, name: &Name, ask: Ask, pulse: &PulseRequest) -> String {
    let control = |action| client::control(session, name, &Control { id: fresh_id(), action: Some(action) });
    let (word, reply) = match ask {
        Ask::Quit => return String::new(),
        Ask::Pulse => ("pulse", client::pulse(session, name, &wire::pulse_message(&fresh_id(), pulse))),
        Ask::Pause => ("pause", control(control::Action::Pause(wire::Pause {}))),
        Ask::Resume => ("resume", control(control::Action::Resume(wire::Resume {}))),
        Ask::Reset => ("reset", control(control::Action::Reset(wire::Reset {}))),
    };
    let reply = reply.map_or_else(|error| error.to_string(), |reply| sentence(&CommandReply { id: String::new(), ..reply }));
    format!("{word} {reply}")
}
