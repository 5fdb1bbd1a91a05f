//! Keyboard control of a replay: single keys, without Enter.

use std::io::IsTerminal as _;
use std::sync::mpsc::Sender;

use ratatui::crossterm::event::{self, KeyCode};
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcgetpgrp, tcsetattr};

use crate::service::{ReplayAction, ReplayCommand};

/// Recorded time that an arrow key skips, s.
const SKIP_S: f64 = 5.0;
/// Factor by which an arrow key changes the rate.
const FASTER: f64 = 1.1;

/// A terminal in single-key mode; dropping it restores the terminal.
pub(super) struct Keyboard {
    before: Termios,
}

impl Keyboard {
    /// Starts to turn keys into commands; `None` if standard input is not a terminal, or another program uses it.
    ///
    /// Only line buffering and echo are off: signals and output stay as they are, unlike in the raw mode of the library.
    pub(super) fn listen(commands: &Sender<ReplayCommand>) -> Option<Self> {
        let stdin = std::io::stdin();
        let ours = stdin.is_terminal() && tcgetpgrp(&stdin).is_ok_and(|group| group == rustix::process::getpgrp());
        if !ours {
            return None;
        }
        let before = tcgetattr(&stdin).ok()?;
        let mut keys = before.clone();
        keys.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        tcsetattr(&stdin, OptionalActions::Now, &keys).ok()?;
        let keyboard = Keyboard { before };
        let commands = commands.clone();
        std::thread::Builder::new().name("keyboard".to_owned()).spawn(move || read_keys(&commands)).ok()?;
        say!("space: pause, resume   left, right: 5 s   up, down: rate   n: next   Home: start   q: end");
        Some(keyboard)
    }
}

impl Drop for Keyboard {
    fn drop(&mut self) {
        if let Err(error) = tcsetattr(std::io::stdin(), OptionalActions::Now, &self.before) {
            tracing::warn!(%error, "could not restore the terminal: `stty sane` does");
        }
    }
}

/// Reads keys until the input or the replay ends.
fn read_keys(commands: &Sender<ReplayCommand>) {
    while let Ok(event) = event::read() {
        let Some(action) = event.as_key_press_event().and_then(|key| action(key.code)) else { continue };
        if commands.send(ReplayCommand::quiet(action)).is_err() {
            return;
        }
    }
}

/// The action of a key, if it has one.
fn action(key: KeyCode) -> Option<ReplayAction> {
    Some(match key {
        KeyCode::Up => ReplayAction::Faster(FASTER),
        KeyCode::Down => ReplayAction::Faster(1.0 / FASTER),
        KeyCode::Right => ReplayAction::Skip(SKIP_S),
        KeyCode::Left => ReplayAction::Skip(-SKIP_S),
        KeyCode::Home => ReplayAction::Seek(0.0),
        KeyCode::Char(' ') => ReplayAction::Toggle,
        KeyCode::Char('n') => ReplayAction::Next(1),
        KeyCode::Char('q') => ReplayAction::Stop,
        _ => return None,
    })
}
