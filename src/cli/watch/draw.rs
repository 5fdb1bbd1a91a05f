//! Draws the view: state on top, mechanism and charts in the middle, keys at the bottom.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize as _};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::state::View;
use super::{chart, mechanism};
use crate::shown::figure;
use crate::wire::{Status, status, status::State};

/// From this width on, charts are beside the mechanism instead of below.
const WIDE: u16 = 110;
/// Silence that is displayed, s.
const SILENCE_S: f64 = 2.0;

const KEYS: &str = "space pause  r reset  p pulse  Tab ↑↓ signal  ←→ window  + - a bending  q quit";

/// Most lines of the service's message.
const MESSAGE_LINES: u16 = 4;

/// Draws a frame.
pub(super) fn draw(frame: &mut Frame, view: &mut View) {
    let message = view.status.as_ref().map(|status| status.message.clone()).unwrap_or_default();
    // Words wrap early, so that a line is not full.
    let full = usize::from(frame.area().width * 4 / 5).max(1);
    let lines = u16::try_from(message.chars().count().div_ceil(full)).unwrap_or(MESSAGE_LINES).min(MESSAGE_LINES);
    let message = Paragraph::new(message.yellow()).wrap(Wrap { trim: true });
    let heights = [1, 1, lines].map(Constraint::Length);
    let areas: [Rect; 5] =
        Layout::vertical(heights.into_iter().chain([Constraint::Min(0), Constraint::Length(2)])).areas(frame.area());
    let [first, second, third, middle, last] = areas;
    frame.render_widget(message, third);
    frame.render_widget(headline(view), first);
    frame.render_widget(figures(view.status.as_ref()), second);
    let (drawing, charts) = split(middle);
    mechanism::draw(frame, drawing, view);
    chart::draw(frame, charts, view);
    let [said, keys] = Layout::vertical([Constraint::Length(1), Constraint::Length(1)]).areas(last);
    frame.render_widget(Line::from(view.said.as_str()).bold(), said);
    frame.render_widget(Line::from(KEYS).dim(), keys);
}

fn split(area: Rect) -> (Rect, Rect) {
    let halves = [Constraint::Fill(1), Constraint::Fill(1)];
    let layout = if area.width >= WIDE { Layout::horizontal(halves) } else { Layout::vertical(halves) };
    let [one, other] = layout.areas(area);
    (one, other)
}

/// Name, state and time.
fn headline(view: &View) -> Line<'_> {
    let mut line = Line::from(vec![Span::from(format!("flexcrank/{}  ", view.name)).bold()]);
    let Some(status) = &view.status else {
        line.push_span("waiting for its status");
        return line;
    };
    line.push_span(Span::styled(state(status), Style::new().fg(colour(status.state())).bold()));
    if let Some(time_s) = view.time_s() {
        line.push_span(format!("  t {time_s:.2} s"));
    }
    if view.silence.as_secs_f64() > SILENCE_S {
        line.push_span(format!("  silent for {:.0} s", view.silence.as_secs_f64()).red().bold());
    }
    if !status.level.is_empty() {
        let error = status.level_error_rad.map_or(String::new(), |error| format!(" ({error:.0e} rad)"));
        line.push_span(format!("  level {}{error}", status.level).cyan());
    }
    if let Some(shadow) = &view.shadow {
        line.push_span(format!("  shadow {} {:+.1e} rad", shadow.model, shadow.angle_rad).cyan());
    }
    if let Some(replay) = &status.replay {
        line.push_span(format!(" of {:.2} s at {} times  {}", replay.duration_s, figure(replay.rate), replay.file));
    }
    if let Some(recording) = &status.recording {
        line.push_span(format!("  rec {}", recording.rsplit('/').next().unwrap_or(recording)).dim());
    }
    line
}

fn state(status: &Status) -> &'static str {
    match &status.replay {
        Some(replay) if replay.paused => "REPLAYING, PAUSED",
        _ => status.state().as_str_name(),
    }
}

fn colour(state: State) -> Color {
    match state {
        State::Running | State::Replaying => Color::Green,
        State::Paused => Color::Yellow,
        State::Diverged => Color::Red,
        State::Finished | State::Unspecified => Color::Reset,
    }
}

/// Real-time factor, lateness, losses and energy, as far as known.
fn figures(status: Option<&Status>) -> Line<'static> {
    let Some(status) = status else { return Line::default() };
    let mut parts = Vec::new();
    parts.extend(status.real_time_factor.map(|factor| format!("rtf {factor:.4}")));
    if let (Some(p50), Some(p99), Some(max)) = (status.lateness_p50_s, status.lateness_p99_s, status.lateness_max_s) {
        parts.push(format!("late p50/p99/max {:.2}/{:.2}/{:.1} ms", 1e3 * p50, 1e3 * p99, 1e3 * max));
    }
    parts.push(format!("overruns {}", status.overruns));
    if status.dropped_samples > 0 {
        parts.push(format!("dropped {}", status.dropped_samples));
    }
    if status.pulses_pending > 0 {
        parts.push(format!("pulses {}", status.pulses_pending));
    }
    let mut spans = vec![Span::raw(parts.join("  "))];
    if let Some(error) = status.balance_error_j {
        let style = if status.energy_verdict() == status::EnergyVerdict::Unbalanced {
            Style::new().fg(Color::Red).bold()
        } else {
            Style::new()
        };
        spans.push(Span::styled(format!("  balance {error:+.1e} J"), style));
    }
    Line::from(spans)
}
