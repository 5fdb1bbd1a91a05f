//! A figure laid out on its sheet: title, panels with their legends, the list of numbered points.

use super::canvas::{Align, Canvas, Lettering};
use super::figure::{Axis, Figure, Panel, Scale};
use super::frame::{Frame, Span, left_room};
use super::legend::{Legend, SAMPLE};
use super::numbered;
use super::output::Picture;
use super::style::sheet::{BELOW, EDGE, RIGHT, TOP, WIDTH};
use super::style::{Colour, GREY, text};
use super::{band, curve};

/// Height of the frame of one panel, least height of one of several, and the height that several share, px.
const HEIGHT: f64 = 370.0;
const LEAST_HEIGHT: f64 = 170.0;
const SHARED_HEIGHT: f64 = 440.0;
/// Room between panels, px.
const BETWEEN: f64 = 18.0;
/// Most room that a frame of equal aspect gets, and least it takes, px.
const EQUAL_MOST: [f64; 2] = [600.0, 520.0];
const EQUAL_LEAST: [f64; 2] = [240.0, 150.0];
/// Part of its length that a span is longer than its values on either side, and that for numbers beside points.
const MARGIN: f64 = 0.04;
const NUMBERS_MARGIN: f64 = 0.08;

impl Picture for Figure {
    fn title(&self) -> &str {
        &self.title
    }

    fn draw(&self, lettering: Lettering) -> String {
        let panels = self.drawn_panels();
        let mut labels: Vec<&str> = self.files.iter().map(String::as_str).collect();
        for series in panels.iter().flat_map(|panel| &panel.series) {
            if !labels.contains(&series.label.as_str()) {
                labels.push(&series.label);
            }
        }
        let colour = |label: &str| Colour::curve(labels.iter().position(|other| *other == label).unwrap_or_default());
        let (mut frames, mut legends) = (self.frames(&panels), Vec::new());
        let (mut top, mut before) = (TOP, Vec::new());
        let explained: Vec<&str> = self.explained.iter().map(|(_, label)| label.as_str()).collect();
        let mut of_all_panels = [self.shown_files(&panels), band::labels(&self.bands), explained].concat();
        for (panel, frame) in panels.iter().zip(&mut frames) {
            let mut own: Vec<&str> = panel.series.iter().map(|series| series.label.as_str()).collect();
            own.dedup();
            let shown = if self.files.is_empty() && own.len() > 1 && own != before { own.as_slice() } else { &[] };
            // The legend of the first panel explains files, bands and marks of all.
            let shown = [shown, &std::mem::take(&mut of_all_panels)].concat();
            let legend = Legend::new(&shown, frame.left, WIDTH - EDGE);
            frame.top = top + legend.height();
            top = frame.top + frame.height + BETWEEN;
            legends.push((legend, shown));
            before = own;
        }
        let mut canvas = Canvas::new(&self.title, [WIDTH, top - BETWEEN + BELOW + EDGE], lettering);
        canvas.fitted(&self.title, [WIDTH / 2.0, 22.0], Align::Centre, text::TITLE, WIDTH - 2.0 * EDGE);
        for (number, ((panel, frame), (legend, shown))) in panels.iter().zip(&frames).zip(&legends).enumerate() {
            let last = number + 1 == panels.len();
            band::draw(&mut canvas, frame, &self.bands);
            frame.draw(&mut canvas, (&self.x, last), &panel.y);
            for series in &panel.series {
                curve::draw(&mut canvas, frame, series, colour(&series.label));
            }
            legend.draw(&mut canvas, frame.top - legend.height() - 4.0, |canvas, entry, at| {
                let mut curves = panel.series.iter().chain(panels.iter().flat_map(|panel| &panel.series));
                let explained = self.explained.iter().find(|(_, label)| label == shown[entry]);
                match (curves.find(|series| series.label == shown[entry]), explained) {
                    (Some(series), _) => curve::draw_sample(canvas, at, SAMPLE, series.mark, colour(&series.label)),
                    (None, Some((mark, _))) => curve::draw_sample(canvas, at, SAMPLE, *mark, GREY),
                    (None, None) => band::draw_sample(canvas, at, &self.bands, shown[entry]),
                }
            });
        }
        if let Some(frame) = frames.first().filter(|_| !self.numbered.is_empty()) {
            numbered::draw(&mut canvas, frame, &self.numbered);
        }
        canvas.finish()
    }
}

impl Figure {
    /// The files that have a curve in one of the panels.
    fn shown_files(&self, panels: &[Panel]) -> Vec<&str> {
        let is_shown = |file: &&str| panels.iter().flat_map(|panel| &panel.series).any(|series| series.label == *file);
        self.files.iter().map(String::as_str).filter(is_shown).collect()
    }

    /// The frames of panels, one under the other.
    fn frames(&self, panels: &[Panel]) -> Vec<Frame> {
        let shown = |point: &[f64; 2]| point.iter().all(|value| value.is_finite());
        let points = |panel: &Panel| panel.series.iter().flat_map(|series| series.points()).filter(shown).collect::<Vec<_>>();
        let all: Vec<Vec<[f64; 2]>> = panels.iter().map(points).collect();
        let listed = !self.numbered.is_empty();
        let margin = if listed { NUMBERS_MARGIN } else { MARGIN };
        let x_margin = if self.equal_aspect || self.x.scale == Scale::Log { margin } else { 0.0 };
        let x = Span::of(all.iter().flatten().map(|[x, _]| *x), self.x.scale, x_margin);
        let spans = all.iter().zip(panels);
        let spans: Vec<Span> =
            spans.map(|(points, panel)| Span::of(points.iter().map(|[_, y]| *y), panel.y.scale, margin)).collect();
        // Equal lengths a unit mean nothing where lengths are ratios.
        if let ([panel], [y], true) = (panels, spans.as_slice(), self.equal_aspect && self.x.scale != Scale::Log)
            && panel.y.scale != Scale::Log
        {
            return vec![equal(&panel.y, x, *y)];
        }
        let height = match panels.len() {
            0 | 1 => HEIGHT.max(numbered::ROW * self.numbered.len() as f64),
            count => LEAST_HEIGHT.max(SHARED_HEIGHT / count as f64),
        };
        let room = spans.iter().zip(panels).map(|(y, panel)| left_room(&panel.y, y, height)).fold(0.0, f64::max);
        let right = if listed { numbered::WIDTH } else { RIGHT };
        let frame = |y: Span| Frame { left: room, top: TOP, width: WIDTH - room - right, height, x, y, room };
        spans.into_iter().map(frame).collect()
    }
}

/// A frame in which both axes have the same measure.
fn equal(axis: &Axis, x: Span, y: Span) -> Frame {
    let lengths = [x.high - x.low, y.high - y.low];
    let px_per_unit = (EQUAL_MOST[0] / lengths[0]).min(EQUAL_MOST[1] / lengths[1]);
    let wanted = lengths.map(|length| length * px_per_unit);
    let [width, height] = [0, 1].map(|axis| wanted[axis].max(EQUAL_LEAST[axis]));
    let (x, y) = (x.stretched(width / wanted[0]), y.stretched(height / wanted[1]));
    let room = left_room(axis, &y, height);
    // Centred, ticks' texts included.
    let left = room + ((WIDTH - room - RIGHT - width) / 2.0).max(0.0);
    Frame { left, top: TOP, width, height, x, y, room }
}
