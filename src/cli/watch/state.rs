//! The state of the view, and the effect of keys on it. No terminal, no bus, no clock.

use std::time::Duration;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::bending::Magnification;
use super::signals::Signals;
use crate::bus::Name;
use crate::wire::{self, Angles, Displacements, Energies, Loads, Message, Shadow, Snapshot, Stamp, Status, status::State};

/// Time spans of the charts, s.
const WINDOWS_S: [f64; 4] = [1.0, 3.0, 10.0, super::strip::KEPT_S];

/// A request that a key sends to the service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum KeyRequest {
    Quit,
    Pause,
    Resume,
    Reset,
    Pulse,
}

/// Everything that is drawn.
pub(super) struct View {
    pub name: Name,
    pub status: Option<Status>,
    /// Stamp of the newest sample.
    sampled: Option<Stamp>,
    pub displacements: Option<Displacements>,
    /// The newest difference of a second model or the best level.
    pub shadow: Option<Shadow>,
    pub signals: Signals,
    pub magnification: Magnification,
    /// Signals in the charts; the defaults until the user chooses.
    chosen: Vec<String>,
    /// Index of the chart that the arrow keys change.
    pub focus: usize,
    /// Number of charts in the last frame.
    pub charts_drawn: usize,
    window: usize,
    /// Time since the last message.
    pub silence: Duration,
    /// The last reply to a command, or its state.
    pub said: String,
}

impl View {
    pub(super) fn new(name: Name, chosen: Vec<String>) -> Self {
        View {
            name,
            status: None,
            sampled: None,
            displacements: None,
            shadow: None,
            signals: Signals::default(),
            magnification: Magnification::default(),
            chosen,
            focus: 0,
            charts_drawn: 1,
            window: 2,
            silence: Duration::ZERO,
            said: String::new(),
        }
    }

    /// Sets the state from a snapshot, loads first, because they show whether there is a slider.
    pub(super) fn snapshot(&mut self, snapshot: Snapshot) {
        let Snapshot { displacements, angles, loads, energies, status, .. } = snapshot;
        loads.iter().for_each(|loads| self.loads(loads));
        energies.iter().for_each(|energies| self.energies(energies));
        angles.iter().for_each(|angles| self.angles(angles));
        displacements.into_iter().for_each(|displacements| self.displacements(displacements));
        status.into_iter().for_each(|status| self.status(status));
    }

    /// Adds a message.
    pub(super) fn message(&mut self, message: Message) {
        match message {
            Message::Displacements(displacements) => self.displacements(*displacements),
            Message::Angles(angles) => self.angles(&angles),
            Message::Loads(loads) => self.loads(&loads),
            Message::Energies(energies) => self.energies(&energies),
            Message::Shadow(shadow) => self.shadow(*shadow),
            Message::Status(status) => self.status(*status),
            _ => {}
        }
    }

    pub(super) fn angles(&mut self, angles: &Angles) {
        self.sampled = angles.stamp;
        self.signals.angles(angles);
    }

    pub(super) fn loads(&mut self, loads: &Loads) {
        self.sampled = loads.stamp;
        self.signals.loads(loads);
    }

    pub(super) fn energies(&mut self, energies: &Energies) {
        self.sampled = energies.stamp;
        self.signals.energies(energies);
    }

    pub(super) fn displacements(&mut self, displacements: Displacements) {
        self.sampled = displacements.stamp;
        self.signals.displacements(&displacements);
        let bending = wire::by_link(&displacements.nodes).map(wire::bending).fold(0.0, f64::max);
        self.magnification.look(bending);
        self.displacements = Some(displacements);
    }

    pub(super) fn shadow(&mut self, shadow: Shadow) {
        self.signals.shadow(&shadow);
        self.shadow = Some(shadow);
    }

    pub(super) fn status(&mut self, status: Status) {
        self.signals.status(&status);
        self.status = Some(status);
    }

    /// Simulated time of the newest sample, or of a status that is newer; of a replay, its place in the recording, s.
    pub(super) fn time_s(&self) -> Option<f64> {
        let status = self.status.as_ref()?;
        let sampled = self.sampled.filter(|_| status.replay.is_none());
        let newest = [status.stamp, sampled].into_iter().flatten().max_by_key(|stamp| (stamp.epoch, stamp.step))?;
        Some(newest.sim_time_s)
    }

    /// Signals in the charts, from the top.
    pub(super) fn charts(&self) -> Vec<String> {
        if self.chosen.is_empty() { self.signals.defaults() } else { self.chosen.clone() }
    }

    /// Time span of the charts, s.
    pub(super) fn window_s(&self) -> f64 {
        WINDOWS_S[self.window]
    }

    /// Applies a key; returns the request that it sends, if any.
    pub(super) fn key(&mut self, key: KeyEvent) -> Option<KeyRequest> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return (key.code == KeyCode::Char('c')).then_some(KeyRequest::Quit);
        }
        match key.code {
            KeyCode::Char('q') => return Some(KeyRequest::Quit),
            KeyCode::Char(' ') => return Some(if self.is_paused() { KeyRequest::Resume } else { KeyRequest::Pause }),
            KeyCode::Char('r') => return Some(KeyRequest::Reset),
            KeyCode::Char('p') => return Some(KeyRequest::Pulse),
            KeyCode::Char('+' | '=') => self.magnification.change(true),
            KeyCode::Char('-') => self.magnification.change(false),
            KeyCode::Char('a') => self.magnification.automatic(),
            KeyCode::Tab => self.focus = (self.focus + 1) % self.charts_drawn.max(1),
            KeyCode::Up => self.turn(-1),
            KeyCode::Down => self.turn(1),
            KeyCode::Left => self.window = self.window.saturating_sub(1),
            KeyCode::Right => self.window = (self.window + 1).min(WINDOWS_S.len() - 1),
            _ => {}
        }
        None
    }

    fn is_paused(&self) -> bool {
        self.status
            .as_ref()
            .is_some_and(|status| status.state() == State::Paused || status.replay.as_ref().is_some_and(|replay| replay.paused))
    }

    /// Moves the chart in focus `by` places in the list of signals.
    fn turn(&mut self, by: isize) {
        self.chosen = self.charts();
        let names: Vec<&str> = self.signals.names().collect();
        let Some(shown) = self.chosen.get_mut(self.focus).filter(|_| !names.is_empty()) else { return };
        let place = names.iter().position(|name| name == shown).unwrap_or(0);
        let length = isize::try_from(names.len()).unwrap_or(isize::MAX);
        let next = (isize::try_from(place).unwrap_or(0) + by).rem_euclid(length);
        names[next.unsigned_abs()].clone_into(shown);
    }
}
