//! The frame of a figure: what interval either axis shows, where a value lies on the sheet, and the drawing of grid, ticks and
//! labels.

use super::canvas::{Align, Canvas};
use super::figure::{Axis, Scale};
use super::lettering::{fitted_em, text_width};
use super::style::{GRID, INK, sheet, text};
use super::ticks::{self, Ticks, superscript};

/// Room between ticks' texts and what is beside them, px.
const GAP: f64 = 8.0;
/// Room a tick takes, px, along x and along y.
const TICK_ROOM: [f64; 2] = [62.0, 36.0];
const X: usize = 0;
const Y: usize = 1;
/// Room a name takes along y, px; along x it takes its width.
const NAME_ROOM: f64 = 17.0;
/// Distance between the two lines of a vertical axis's label, px.
const LABEL_LINE: f64 = 16.0;

/// The interval of an axis, and its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub low: f64,
    pub high: f64,
    scale: Scale,
}

impl Span {
    /// The interval that holds all values that can be shown, and `margin` of its length more on either side.
    pub fn of(values: impl Iterator<Item = f64>, scale: Scale, margin: f64) -> Self {
        let shown = values.filter_map(|value| position(value, scale));
        let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = match scale {
            _ if low > high => (0.0, 1.0),
            Scale::Log if high - low < 0.4 => (low - 0.7, high + 0.7),
            Scale::Log => (low, high),
            Scale::Linear | Scale::Pi => widened(low, high),
        };
        let more = margin * (high - low);
        let back = |place: f64| if scale == Scale::Log { place.exp() } else { place };
        Span { low: back(low - more), high: back(high + more), scale }
    }

    /// The same middle, with the length multiplied by `part`.
    pub fn stretched(self, part: f64) -> Self {
        let (middle, half) = ((self.low + self.high) / 2.0, (self.high - self.low) / 2.0 * part);
        Span { low: middle - half, high: middle + half, ..self }
    }

    /// Relative position of `value`: 0 at the low end, 1 at the high; `None` for a value that cannot be shown.
    pub fn part(&self, value: f64) -> Option<f64> {
        let [low, high] = [position(self.low, self.scale)?, position(self.high, self.scale)?];
        Some((position(value, self.scale)? - low) / (high - low))
    }

    pub fn ticks(&self, most: usize) -> Ticks {
        match self.scale {
            Scale::Linear => ticks::linear(self.low, self.high, most),
            Scale::Pi => ticks::pi(self.low, self.high, most),
            Scale::Log => ticks::log(self.low, self.high, most),
        }
    }

    fn ticks_in_degrees(&self, most: usize) -> Ticks {
        if self.scale == Scale::Linear { ticks::degrees(self.low, self.high, most) } else { self.ticks(most) }
    }
}

/// Largest size, and smallest on a logarithmic axis, of what is shown; beyond, lengths of intervals overflow.
const LARGEST: f64 = 1e300;

/// Position of a value on the axis's even scale.
fn position(value: f64, scale: Scale) -> Option<f64> {
    match scale {
        _ if !value.is_finite() || value.abs() > LARGEST => None,
        Scale::Log if value < LARGEST.recip() => None,
        Scale::Log => Some(value.ln()),
        Scale::Linear | Scale::Pi => Some(value),
    }
}

/// An interval with a length, also where all values are the same but for rounding.
fn widened(low: f64, high: f64) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    if size < LARGEST.recip() {
        return (-1.0, 1.0);
    }
    if high - low > 1e-11 * size { (low, high) } else { (low - 0.1 * size, high + 0.1 * size) }
}

/// Position of the axes on the sheet, px, and their intervals.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    pub x: Span,
    pub y: Span,
    /// Room to the left for the texts of the vertical axis.
    pub room: f64,
}

impl Frame {
    /// Position of a point on the sheet.
    pub fn at(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        Some([self.left + self.width * self.x.part(x)?, self.top + self.height * (1.0 - self.y.part(y)?)])
    }

    /// Draws grid, ticks, texts and labels; those of the horizontal axis only where `labelled`.
    pub fn draw(&self, canvas: &mut Canvas, (x, labelled): (&Axis, bool), y: &Axis) {
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        let (x_ticks, y_ticks) = (x.ticks(&self.x, self.width, X), y.ticks(&self.y, self.height, Y));
        let across = |value: f64| self.x.part(value).map(|part| self.left + part * self.width);
        let up = |value: f64| self.y.part(value).map(|part| bottom - part * self.height);
        let room = (sheet::WIDTH - 2.0 * sheet::EDGE) / x_ticks.major.len().max(1) as f64;
        for (value, label) in &x_ticks.major {
            let Some(at) = across(*value) else { continue };
            canvas.line(&[[at, self.top], [at, bottom]], GRID, 1.0, "");
            canvas.line(&[[at, bottom], [at, bottom + 4.0]], INK, 1.0, "");
            if labelled {
                write_under(canvas, label, [at, bottom + 15.0], room);
            }
        }
        for (value, label) in &y_ticks.major {
            let Some(at) = up(*value) else { continue };
            canvas.line(&[[self.left, at], [right, at]], GRID, 1.0, "");
            canvas.line(&[[self.left - 4.0, at], [self.left, at]], INK, 1.0, "");
            canvas.text(label, [self.left - GAP, at], Align::Right, text::TICK, INK);
        }
        canvas.outline([self.left, self.top], [right, bottom], INK);
        if labelled {
            let under = [self.left + self.width / 2.0, bottom + 38.0];
            let room = 2.0 * under[0].min(right + 20.0 - under[0]);
            canvas.fitted(&x.labelled(&x_ticks), under, Align::Centre, text::LABEL, room);
        }
        let label = y.labelled(&y_ticks);
        let mut beside = [self.left - self.room + 18.0, self.top + self.height / 2.0];
        for line in label_lines(&label, self.height) {
            canvas.fitted(line, beside, Align::Up, text::LABEL, label_room(self.height));
            beside[0] += LABEL_LINE;
        }
    }
}

/// Writes the text of a tick centred under it, or further inwards where the text would leave the sheet.
fn write_under(canvas: &mut Canvas, label: &str, [x, y]: [f64; 2], room: f64) {
    let half = text_width(label, text::TICK).min(room) / 2.0;
    let on_sheet = x.min(sheet::WIDTH - sheet::EDGE - half).max(sheet::EDGE + half);
    canvas.fitted(label, [on_sheet, y], Align::Centre, text::TICK, room);
}

/// Room for the label of a vertical axis of this height, px.
fn label_room(height: f64) -> f64 {
    height + 4.0
}

/// The lines of a vertical axis's label: two, if the letters of one would be smaller than those of notes.
fn label_lines(label: &str, height: f64) -> Vec<&str> {
    let middle = label.len() / 2;
    let space = label.match_indices(' ').map(|(place, _)| place).min_by_key(|place| place.abs_diff(middle));
    match space.map(|place| label.split_at(place)) {
        Some((first, second)) if fitted_em(label, text::LABEL, label_room(height)) < text::NOTE => {
            vec![first, second.trim_start()]
        }
        _ => vec![label],
    }
}

/// Room to the left of a frame of this height for the texts of its vertical axis, px.
pub(super) fn left_room(axis: &Axis, span: &Span, height: f64) -> f64 {
    let ticks = axis.ticks(span, height, Y);
    let widest = ticks.major.iter().map(|(_, label)| text_width(label, text::TICK)).fold(0.0, f64::max);
    let more_lines = label_lines(&axis.labelled(&ticks), height).len() - 1;
    GAP + widest + 34.0 + LABEL_LINE * more_lines as f64
}

impl Axis {
    /// Ticks on `length` px: of a list, its names, as many as there is room for.
    fn ticks(&self, span: &Span, length: f64, along: usize) -> Ticks {
        if self.names.is_empty() {
            let most = ((length / TICK_ROOM[along]) as usize).max(4);
            return if self.unit == "°" { span.ticks_in_degrees(most) } else { span.ticks(most) };
        }
        let widest = self.names.iter().map(|name| text_width(name, text::TICK)).fold(0.0, f64::max);
        let apart = length / (span.high - span.low);
        // An outer name moves inwards by what would leave the sheet.
        let beside = sheet::RIGHT - sheet::EDGE + apart * (-span.low).max(0.0);
        let room = if along == X { widest + (widest / 2.0 - beside).max(0.0) + GAP } else { NAME_ROOM };
        let every = (room / apart).ceil().max(1.0) as usize;
        let shown = |place: usize| (span.low..=span.high).contains(&(place as f64));
        let names = self.names.iter().enumerate().filter(|(place, _)| shown(*place)).step_by(every);
        Ticks { major: names.map(|(place, name)| (place as f64, name.clone())).collect(), ..Ticks::default() }
    }

    /// The axis's label with what its ticks leave out: `displacement − 0.5 m (10⁻⁶ m)`.
    pub(super) fn labelled(&self, ticks: &Ticks) -> String {
        let unit = &self.unit;
        let spaced = |text: &str| if unit.is_empty() { text.to_owned() } else { format!("{text} {unit}") };
        let mut label = self.label.clone();
        if ticks.offset != 0.0 {
            let sign = if ticks.offset < 0.0 { '+' } else { '−' };
            label = format!("{label} {sign} {}", spaced(&ticks.offset.abs().to_string()));
        }
        let bracket = match ticks.exponent {
            0 => unit.clone(),
            exponent => spaced(&format!("10{}", superscript(exponent))),
        };
        if bracket.is_empty() || label.is_empty() { label + &bracket } else { format!("{label} ({bracket})") }
    }
}
