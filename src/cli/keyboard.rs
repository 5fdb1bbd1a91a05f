//! Keyboard control of a replay: single keys, without Enter.

use std::io::{IsTerminal as _, Read as _};
use std::sync::mpsc::Sender;

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
    /// Signals keep working: Ctrl-C interrupts.
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
        std::thread::Builder::new().name("keyboard".to_owned()).spawn(move || hear(&commands)).ok()?;
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
fn hear(commands: &Sender<ReplayCommand>) {
    let mut keys = Keys::default();
    for byte in std::io::stdin().lock().bytes() {
        let Ok(byte) = byte else { return };
        if let Some(action) = keys.key(byte)
            && commands.send(ReplayCommand::quiet(action)).is_err()
        {
            return;
        }
    }
}

/// State of the parser of arrow keys: escape, `[` or `O`, a letter.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
enum Keys {
    #[default]
    Plain,
    Escape,
    Letter,
}

impl Keys {
    fn key(&mut self, byte: u8) -> Option<ReplayAction> {
        let (next, action) = match (*self, byte) {
            (_, 0x1b) => (Keys::Escape, None),
            (Keys::Escape, b'[' | b'O') => (Keys::Letter, None),
            (Keys::Letter, b'A') => (Keys::Plain, Some(ReplayAction::Faster(FASTER))),
            (Keys::Letter, b'B') => (Keys::Plain, Some(ReplayAction::Faster(1.0 / FASTER))),
            (Keys::Letter, b'C') => (Keys::Plain, Some(ReplayAction::Skip(SKIP_S))),
            (Keys::Letter, b'D') => (Keys::Plain, Some(ReplayAction::Skip(-SKIP_S))),
            (Keys::Letter, b'H') => (Keys::Plain, Some(ReplayAction::Seek(0.0))),
            (Keys::Plain, b' ') => (Keys::Plain, Some(ReplayAction::Toggle)),
            (Keys::Plain, b'n') => (Keys::Plain, Some(ReplayAction::Next(1))),
            (Keys::Plain, b'q') => (Keys::Plain, Some(ReplayAction::Stop)),
            _ => (Keys::Plain, None),
        };
        *self = next;
        action
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn actions(bytes: &[u8]) -> Vec<ReplayAction> {
        let mut keys = Keys::default();
        bytes.iter().filter_map(|byte| keys.key(*byte)).collect()
    }

    #[test]
    fn val_keys_and_arrows_in_both_modes_of_a_terminal() {
        let expected = [
            ReplayAction::Toggle,
            ReplayAction::Next(1),
            ReplayAction::Skip(5.0),
            ReplayAction::Skip(-5.0),
            ReplayAction::Faster(1.1),
            ReplayAction::Stop,
        ];
        assert_eq!(actions(b" n\x1b[C\x1bOD\x1b[Aq"), expected);
    }

    #[test]
    fn prop_what_is_no_key_is_nothing() {
        assert_eq!(
            actions(b"x\n\x1b[Zq\x1b\x1b[Bn"),
            [ReplayAction::Stop, ReplayAction::Faster(1.0 / 1.1), ReplayAction::Next(1)]
        );
        assert_eq!(actions(&[0, 255, 0x1b]), []);
    }
}
