//! Maps: a quantity, or a category, over two axes.

use super::canvas::{Align, Canvas, Lettering};
use super::figure::{Axis, Scale};
use super::frame::{Frame, Span, left_room};
use super::legend::{Legend, SAMPLE};
use super::output::Picture;
use super::style::sheet::{BELOW, EDGE, RIGHT, TOP, WIDTH};
use super::style::{Colour, INK, text};

const HEIGHT: f64 = 400.0;
const BAR: f64 = 18.0;
/// Room right of the frame for the colour bar, its ticks and its label, px.
const BAR_ROOM: f64 = 110.0;
/// Overlap of neighbouring cells, px.
const OVERLAP: f64 = 0.5;
const SHADES: usize = 128;

/// A value for every pair of an x and a y.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Title of the map.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Centres of the cells along the horizontal axis, ascending.
    pub xs: Vec<f64>,
    /// Likewise upwards.
    pub ys: Vec<f64>,
    /// Values, row by row: `values[j][i]` at `xs[i]`, `ys[j]`. What is not finite stays white.
    pub values: Vec<Vec<f64>>,
    /// Kind of the values.
    pub key: Key,
}

/// Kind of a map's values.
#[derive(Debug, Clone, PartialEq)]
pub enum Key {
    /// A quantity, shown by a colour bar.
    Quantity(Axis),
    /// The number of one of these categories, shown by a legend.
    Categories(Vec<String>),
}

impl Picture for HeatMap {
    fn title(&self) -> &str {
        &self.title
    }

    fn draw(&self, lettering: Lettering) -> String {
        let (x_edges, y_edges) = (edges(&self.xs, self.x.scale), edges(&self.ys, self.y.scale));
        let (x, y) = (Span::of(x_edges.iter().copied(), self.x.scale, 0.0), Span::of(y_edges.iter().copied(), self.y.scale, 0.0));
        let room = left_room(&self.y, &y, HEIGHT);
        let (labels, range, right) = match &self.key {
            Key::Quantity(axis) => (Vec::new(), Some(Span::of(self.values.iter().flatten().copied(), axis.scale, 0.0)), BAR_ROOM),
            Key::Categories(names) => (names.iter().map(String::as_str).collect(), None, RIGHT),
        };
        let legend = Legend::new(&labels, room, WIDTH - EDGE);
        let top = TOP + legend.height();
        let frame = Frame { left: room, top, width: WIDTH - room - right, height: HEIGHT, x, y, room };
        let mut canvas = Canvas::new(&self.title, [WIDTH, top + HEIGHT + BELOW + EDGE], lettering);
        canvas.fitted(&self.title, [WIDTH / 2.0, 22.0], Align::Centre, text::TITLE, WIDTH - 2.0 * EDGE);
        frame.draw(&mut canvas, (&self.x, true), &self.y);
        let colour = |value: f64| match range {
            Some(range) => range.part(value).map(Colour::of_value),
            None => (value >= 0.0).then(|| Colour::category(value as usize)),
        };
        for (row, low_high) in self.values.iter().zip(y_edges.windows(2)) {
            for (value, left_right) in row.iter().zip(x_edges.windows(2)) {
                let corners = [frame.at([left_right[0], low_high[1]]), frame.at([left_right[1], low_high[0]])];
                if let ([Some(from), Some(to)], Some(colour)) = (corners, colour(*value)) {
                    // A little under the neighbours drawn next, or hairlines of the ground show between them.
                    let right = (to[0] + OVERLAP).min(frame.left + frame.width);
                    canvas.fill([from[0], (from[1] - OVERLAP).max(frame.top)], [right, to[1]], colour);
                }
            }
        }
        canvas.outline([frame.left, frame.top], [frame.left + frame.width, frame.top + frame.height], INK);
        if let (Key::Quantity(axis), Some(range)) = (&self.key, range) {
            bar(&mut canvas, axis, range, frame.left + frame.width + 16.0);
        }
        legend.draw(&mut canvas, TOP - 6.0, |canvas, entry, [x, y]| {
            canvas.fill([x + SAMPLE - 22.0, y - 6.5], [x + SAMPLE, y + 6.5], Colour::category(entry));
        });
        canvas.finish()
    }
}

/// Borders half way between centres.
fn edges(centres: &[f64], scale: Scale) -> Vec<f64> {
    let log = scale == Scale::Log;
    let at = |value: f64| if log { value.ln() } else { value };
    let back = |value: f64| if log { value.exp() } else { value };
    let (Some(first), Some(last)) = (centres.first(), centres.last()) else { return Vec::new() };
    let mut edges: Vec<f64> = centres.windows(2).map(|pair| (at(pair[0]) + at(pair[1])) / 2.0).collect();
    let half = |inner: Option<&f64>, end: f64| inner.map_or(0.5, |inner| (at(end) - inner).abs());
    let (low, high) = (at(*first) - half(edges.first(), *first), at(*last) + half(edges.last(), *last));
    edges.insert(0, low);
    edges.push(high);
    edges.into_iter().map(back).collect()
}

/// The colour bar at `left`, its axis on its right.
fn bar(canvas: &mut Canvas, axis: &Axis, range: Span, left: f64) {
    let (right, bottom) = (left + BAR, TOP + HEIGHT);
    for number in 0..SHADES {
        let [low, high] = [number, number + 1].map(|number| number as f64 / SHADES as f64);
        let from = [left, (bottom - high * HEIGHT - OVERLAP).max(TOP)];
        canvas.fill(from, [right, bottom - low * HEIGHT], Colour::of_value((low + high) / 2.0));
    }
    canvas.outline([left, TOP], [right, bottom], INK);
    let ticks = range.ticks(8);
    for (value, label) in &ticks.major {
        let Some(part) = range.part(*value) else { continue };
        let y = bottom - part * HEIGHT;
        canvas.line(&[[right, y], [right + 4.0, y]], INK, 1.0, "");
        canvas.text(label, [right + 7.0, y], Align::Left, text::TICK, INK);
    }
    canvas.fitted(&axis.labelled(&ticks), [WIDTH - 14.0, TOP + HEIGHT / 2.0], Align::Up, text::LABEL, HEIGHT);
}
