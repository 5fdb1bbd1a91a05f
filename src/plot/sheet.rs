//! A figure laid out on its sheet: title, frame, curves, legend.

use super::PlotError;
use super::canvas::{self, Align};
use super::curve::Curve;
use super::figure::{Axis, Figure, Scale};
use super::frame::{Frame, Span, left_room};
use super::legend::{Legend, SAMPLE};
use super::style::text;

/// Width of every figure, px.
pub(super) const WIDTH: f64 = 760.0;
/// Height of the frame, px.
const HEIGHT: f64 = 370.0;
/// Most room that a frame of equal aspect gets, and least it takes, px.
const EQUAL_MOST: [f64; 2] = [600.0, 520.0];
const EQUAL_LEAST: [f64; 2] = [240.0, 150.0];
/// Room above the frame, right of it, and below it for ticks and label, px.
pub(super) const TOP: f64 = 44.0;
pub(super) const RIGHT: f64 = 30.0;
pub(super) const BELOW: f64 = 54.0;
const EDGE: f64 = 10.0;
/// Part of its length that a span is longer than its values on either side.
const MARGIN: f64 = 0.04;

impl Figure {
    /// The figure as SVG.
    ///
    /// # Errors
    /// [`PlotError::Draw`] when the drawing library refuses.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        let frame = self.frame();
        let labels: Vec<&str> = self.series.iter().map(|series| series.label.as_str()).collect();
        let labels = if labels.len() > 1 { labels } else { Vec::new() };
        let legend = Legend::new(&labels, WIDTH - 2.0 * EDGE);
        let under = frame.top + frame.height + BELOW;
        let curve = |place: usize| Curve { series: &self.series[place], place, count: self.series.len() };
        canvas::svg(&self.title, [WIDTH, under + legend.height() + EDGE], |canvas| {
            canvas.fitted(&self.title, [WIDTH / 2.0, 22.0], Align::Centre, text::TITLE, WIDTH - 2.0 * EDGE)?;
            frame.draw(canvas, &self.x, &self.y)?;
            for place in 0..self.series.len() {
                curve(place).draw(canvas, &frame)?;
            }
            legend.draw(canvas, [EDGE, under], &labels, |entry, at| curve(entry).draw_sample(canvas, at, SAMPLE))
        })
    }

    fn frame(&self) -> Frame {
        let points = || self.series.iter().flat_map(|series| series.points());
        let shown = |point: &[f64; 2]| point.iter().all(|value| value.is_finite());
        let x_margin = if self.equal_aspect || self.x.scale == Scale::Log { MARGIN } else { 0.0 };
        let x = Span::of(points().filter(shown).map(|[x, _]| x), self.x.scale, x_margin);
        let y = Span::of(points().filter(shown).map(|[_, y]| y), self.y.scale, MARGIN);
        // Equal lengths a unit mean nothing where lengths are ratios.
        if self.equal_aspect && self.x.scale != Scale::Log && self.y.scale != Scale::Log {
            return equal(&self.y, x, y);
        }
        let left = left_room(&self.y, &y, HEIGHT);
        Frame { left, top: TOP, width: WIDTH - left - RIGHT, height: HEIGHT, x, y }
    }
}

/// A frame in which both axes have the same measure.
fn equal(axis: &Axis, x: Span, y: Span) -> Frame {
    let lengths = [x.high - x.low, y.high - y.low];
    let px_per_unit = (EQUAL_MOST[0] / lengths[0]).min(EQUAL_MOST[1] / lengths[1]);
    let wanted = lengths.map(|length| length * px_per_unit);
    let [width, height] = [0, 1].map(|axis| wanted[axis].max(EQUAL_LEAST[axis]));
    let (x, y) = (x.stretched(width / wanted[0]), y.stretched(height / wanted[1]));
    let left = left_room(axis, &y, height);
    // Centred, ticks' texts included.
    let left = left + ((WIDTH - left - RIGHT - width) / 2.0).max(0.0);
    Frame { left, top: TOP, width, height, x, y }
}
