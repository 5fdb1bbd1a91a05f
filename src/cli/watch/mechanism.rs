//! The mechanism to scale, with bent links.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Rectangle};
use ratatui::widgets::{Block, Borders};

use super::state::View;
use crate::wire::{self, NodeState};

/// Colours of the links, from the pivot outwards.
const LINKS: [Color; 3] = [Color::Cyan, Color::Yellow, Color::Green];
/// Margin around the mechanism, relative to its size.
const MARGIN: f64 = 0.06;

/// The drawn region in metres: left, right, bottom, top.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Field {
    x: [f64; 2],
    y: [f64; 2],
}

pub(super) fn draw(frame: &mut Frame, area: Rect, view: &View) {
    let factor = view.magnification.factor;
    let how = if view.magnification.automatic { " (automatic)" } else { "" };
    let block = Block::new().borders(Borders::TOP);
    let inner = block.inner(area);
    let nodes = view.displacements.as_ref().map_or(&[][..], |all| &all.nodes);
    let Some(shown) = reach(nodes).and_then(|reach| reach.to_scale(inner)) else {
        frame.render_widget(block.title(" nothing to draw yet "), area);
        return;
    };
    let block = block.title(format!(" bending drawn {factor} times{how} "));
    let canvas = Canvas::default().block(block).x_bounds(shown.x).y_bounds(shown.y).paint(|context| {
        let dot = (shown.x[1] - shown.x[0]) / (2.0 * f64::from(inner.width.max(1)));
        if nodes.first().is_some_and(|node| node.link == "mass") {
            masses(context, nodes, dot);
        } else {
            chain(context, nodes, factor, view.signals.has_slider, dot);
        }
    });
    frame.render_widget(canvas, area);
}

fn chain(context: &mut Context, nodes: &[NodeState], factor: f64, has_slider: bool, dot: f64) {
    for (link, colour) in wire::by_link(nodes).zip(LINKS.into_iter().cycle()) {
        let line = wire::bent_line(link, factor);
        for pair in line.windows(2) {
            segment(context, pair[0], pair[1], colour);
        }
    }
    context.layer();
    for (place, link) in wire::by_link(nodes).enumerate() {
        if let Some(pin) = link.first() {
            pin_at(context, pin, if place == 0 { 3.0 } else { 1.5 } * dot);
        }
    }
    let Some(end) = nodes.last() else { return };
    if has_slider {
        let (width, height) = (10.0 * dot, 6.0 * dot);
        let (x, y) = (end.x_m - 0.5 * width, end.y_m - 0.5 * height);
        if x.is_finite() && y.is_finite() {
            context.draw(&Rectangle { x, y, width, height, color: Color::White });
        }
    } else {
        pin_at(context, end, 1.5 * dot);
    }
}

/// The masses of an oscillator on a line, with springs between.
fn masses(context: &mut Context, nodes: &[NodeState], dot: f64) {
    for pair in nodes.windows(2) {
        segment(context, [pair[0].x_m, 0.0], [pair[1].x_m, 0.0], Color::DarkGray);
    }
    context.layer();
    for (node, color) in nodes.iter().zip(LINKS.into_iter().cycle()) {
        let (width, height) = (8.0 * dot, 8.0 * dot);
        if node.x_m.is_finite() {
            context.draw(&Rectangle { x: node.x_m - 0.5 * width, y: -0.5 * height, width, height, color });
        }
    }
}

fn segment(context: &mut Context, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], color: Color) {
    if [x1, y1, x2, y2].iter().all(|number| number.is_finite()) {
        context.draw(&Line { x1, y1, x2, y2, color });
    }
}

fn pin_at(context: &mut Context, node: &NodeState, radius: f64) {
    if node.x_m.is_finite() && node.y_m.is_finite() {
        context.draw(&Circle { x: node.x_m, y: node.y_m, radius, color: Color::White });
    }
}

/// The region that the mechanism can reach; `None` if it has no size.
fn reach(nodes: &[NodeState]) -> Option<Field> {
    let lengths: Vec<f64> = wire::by_link(nodes).filter_map(length).collect();
    let [x0, y0] = nodes.first().map(|node| [node.x_m, node.y_m])?;
    let reach = match lengths[..] {
        // Masses on a line: their range, and as much again.
        _ if nodes[0].link == "mass" => {
            let far = nodes.iter().map(|node| node.x_m.abs()).fold(0.0, f64::max);
            let far = 10_f64.powf(far.max(1e-12).log10().ceil());
            Field { x: [-far, far], y: [-0.5 * far, 0.5 * far] }
        }
        [crank, rod] => Field { x: [x0 - crank, x0 + crank + rod], y: [y0 - crank, y0 + crank] },
        _ => {
            let all: f64 = lengths.iter().sum();
            Field { x: [x0 - all, x0 + all], y: [y0 - all, y0 + all] }
        }
    };
    let size = (reach.x[1] - reach.x[0]).max(reach.y[1] - reach.y[0]);
    (size.is_finite() && size > 0.0).then(|| reach.grown(MARGIN * size))
}

fn length(link: &[NodeState]) -> Option<f64> {
    let (first, last) = (link.first()?, link.last()?);
    let length = (last.x_m - first.x_m).hypot(last.y_m - first.y_m);
    length.is_finite().then_some(length)
}

impl Field {
    fn grown(self, by: f64) -> Self {
        let grow = |[low, high]: [f64; 2]| [low - by, high + by];
        Field { x: grow(self.x), y: grow(self.y) }
    }

    /// Extends the region in one direction so that metres are equal in x and y: a cell has two dots by four.
    fn to_scale(self, area: Rect) -> Option<Self> {
        let dots = [2.0 * f64::from(area.width) - 1.0, 4.0 * f64::from(area.height) - 1.0];
        if dots[0] < 1.0 || dots[1] < 1.0 {
            return None;
        }
        let span = |[low, high]: [f64; 2]| high - low;
        let per_dot = (span(self.x) / dots[0]).max(span(self.y) / dots[1]);
        let about = |[low, high]: [f64; 2], dots: f64| {
            let (middle, half) = (0.5 * (low + high), 0.5 * per_dot * dots);
            [middle - half, middle + half]
        };
        Some(Field { x: about(self.x, dots[0]), y: about(self.y, dots[1]) })
    }
}
