//! Strip charts of signals.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Stylize as _};
use ratatui::widgets::canvas::{Canvas, Line};
use ratatui::widgets::{Block, Borders};

use super::state::View;
use super::strip::StripEntry;
use crate::nearest::did_you_mean_column;

/// Smallest height of a chart: its title and two rows of curve.
const LEAST_ROWS: u16 = 3;
/// Height of a chart if there is room.
const ROWS: u16 = 5;

/// Draws as many of the chosen charts as fit.
pub(super) fn draw(frame: &mut Frame, area: Rect, view: &mut View) {
    let names = view.charts();
    let room = area.height / if usize::from(area.height / ROWS) >= names.len() { ROWS } else { LEAST_ROWS };
    let count = names.len().min(usize::from(room));
    view.charts_drawn = count;
    view.focus = view.focus.min(count.saturating_sub(1));
    let rows = Layout::vertical(vec![Constraint::Fill(1); count]).split(area);
    for (place, (name, row)) in names.iter().zip(rows.iter()).enumerate() {
        chart(frame, *row, name, view, place == view.focus);
    }
}

fn chart(frame: &mut Frame, area: Rect, name: &str, view: &View, focus: bool) {
    let window_s = view.window_s();
    let block = Block::new().borders(Borders::TOP);
    let Some(strip) = view.signals.find(name) else {
        let hint = did_you_mean_column(name, view.signals.names());
        return frame.render_widget(block.title(format!(" {name}: not there{hint} ")), area);
    };
    let seen: Vec<StripEntry> = strip.last(window_s).collect();
    let [low, high] = range(&seen);
    let title = format!(" {name} {}  in {} to {}, {window_s} s ", number(strip.now), number(low), number(high));
    let title = if focus { title.reversed() } else { title.into() };
    let end_s = strip.end_s();
    let margin = 0.05 * (high - low);
    let canvas = Canvas::default()
        .block(block.title(title))
        .x_bounds([end_s - window_s, end_s])
        .y_bounds([low - margin, high + margin])
        .paint(|context| {
            let mut line = |x1, y1, x2, y2| context.draw(&Line { x1, y1, x2, y2, color: Color::Green });
            for entry in &seen {
                line(entry.time_s, entry.low, entry.time_s, entry.high);
            }
            for pair in seen.windows(2) {
                line(pair[0].time_s, middle(pair[0]), pair[1].time_s, middle(pair[1]));
            }
        });
    frame.render_widget(canvas, area);
}

fn middle(entry: StripEntry) -> f64 {
    0.5 * (entry.low + entry.high)
}

/// The range of the curve, widened around a constant.
fn range(seen: &[StripEntry]) -> [f64; 2] {
    let low = seen.iter().map(|entry| entry.low).fold(f64::INFINITY, f64::min);
    let high = seen.iter().map(|entry| entry.high).fold(f64::NEG_INFINITY, f64::max);
    let size = low.abs().max(high.abs());
    match high - low {
        span if span > 1e-9 * size => [low, high],
        span if span.is_finite() => {
            let around = if size > 0.0 { 0.1 * size } else { 1.0 };
            [low - around, high + around]
        }
        _ => [0.0, 1.0],
    }
}

/// Formats a number in at most nine characters.
fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-3..1e5).contains(&size) { format!("{value:.4}") } else { format!("{value:.2e}") }
}
