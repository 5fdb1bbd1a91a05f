//! Curves on the sheet: lines with gaps where there is no value, dashes, markers at even distances.

use plotters::style::RGBColor;

use super::PlotError;
use super::canvas::Canvas;
use super::figure::{Mark, Series};
use super::frame::Frame;
use super::style::{CURVE_WIDTH, MARKER_RADIUS, Style};

/// Points nearer than this to the last one drawn are left out, px: thinner than any line.
const RESOLUTION: f64 = 0.4;
/// Least distance between markers along a line, px.
const MARKER_SPACING: f64 = 110.0;
/// Most markers on a line.
const MARKERS: f64 = 12.0;

/// One curve of `count`.
pub(super) struct Curve<'a> {
    pub series: &'a Series,
    pub place: usize,
    pub count: usize,
}

impl Curve<'_> {
    /// Draws it into a frame.
    pub fn draw(&self, canvas: &Canvas<'_>, frame: &Frame) -> Result<(), PlotError> {
        let style = Style::of(self.place);
        if self.series.mark != Mark::Points {
            let runs = runs(self.series, frame);
            for run in &runs {
                stroke(canvas, run, style)?;
            }
            if self.series.mark == Mark::Line && self.count > 1 {
                let length: f64 = runs.iter().map(|run| length(run)).sum();
                let spacing = MARKER_SPACING.max(length / MARKERS);
                let mut next = spacing * (self.place as f64 + 0.5) / self.count as f64;
                for run in &runs {
                    next = along(run, next, spacing, |at| canvas.marker(at, style.marker, MARKER_RADIUS, style.colour))?;
                }
            }
        }
        if self.series.mark != Mark::Line {
            for at in self.series.points().filter_map(|point| frame.at(point)) {
                canvas.marker(at, style.marker, MARKER_RADIUS, style.colour)?;
            }
        }
        Ok(())
    }

    /// Draws what stands for it in the legend: a stroke from `at` of this length.
    pub fn draw_sample(&self, canvas: &Canvas<'_>, [x, y]: [f64; 2], length_px: f64) -> Result<(), PlotError> {
        let style = Style::of(self.place);
        if self.series.mark != Mark::Points {
            stroke(canvas, &[[x, y], [x + length_px, y]], style)?;
        }
        canvas.marker([x + length_px / 2.0, y], style.marker, MARKER_RADIUS, style.colour)
    }
}

/// The parts of a curve without gaps, on the sheet, in points far enough apart to be seen.
fn runs(series: &Series, frame: &Frame) -> Vec<Vec<[f64; 2]>> {
    let mut runs: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut open = false;
    let mut skipped = None;
    for point in series.points() {
        let Some(at) = frame.at(point) else {
            close(&mut runs, skipped.take());
            open = false;
            continue;
        };
        match runs.last_mut().filter(|_| open) {
            None => runs.push(vec![at]),
            Some(run) if run.last().is_some_and(|last| distance(*last, at) < RESOLUTION) => {
                skipped = Some(at);
                continue;
            }
            Some(run) => run.push(at),
        }
        open = true;
        skipped = None;
    }
    close(&mut runs, skipped);
    runs
}

/// Ends the last run at its true end, though that is close to the point before.
fn close(runs: &mut [Vec<[f64; 2]>], end: Option<[f64; 2]>) {
    if let (Some(run), Some(end)) = (runs.last_mut(), end) {
        run.push(end);
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn length(run: &[[f64; 2]]) -> f64 {
    run.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

fn between(a: [f64; 2], b: [f64; 2], part: f64) -> [f64; 2] {
    [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])]
}

/// Calls `visit` at `next`, `next + spacing`, … px along a line; returns what is left to go at its end.
fn along(
    run: &[[f64; 2]],
    mut next: f64,
    spacing: f64,
    mut visit: impl FnMut([f64; 2]) -> Result<(), PlotError>,
) -> Result<f64, PlotError> {
    for pair in run.windows(2) {
        let step = distance(pair[0], pair[1]);
        while next <= step && step > 0.0 {
            visit(between(pair[0], pair[1], next / step))?;
            next += spacing;
        }
        next -= step;
    }
    Ok(next)
}

fn stroke(canvas: &Canvas<'_>, run: &[[f64; 2]], style: Style) -> Result<(), PlotError> {
    match run {
        [] => Ok(()),
        // A value between two gaps has no length, and is there.
        [alone] => canvas.marker(*alone, style.marker, MARKER_RADIUS / 2.0, style.colour),
        run if style.dash.is_empty() => canvas.line(run, style.colour, CURVE_WIDTH),
        run => dashed(canvas, run, style.dash, style.colour),
    }
}

/// Strokes and gaps in turn along a line.
fn dashed(canvas: &Canvas<'_>, run: &[[f64; 2]], pattern: &[f64], colour: RGBColor) -> Result<(), PlotError> {
    let (mut place, mut left) = (0, pattern[0]);
    let mut dash = vec![run[0]];
    for pair in run.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        while distance(from, to) > left {
            from = between(from, to, left / distance(from, to));
            if place % 2 == 0 {
                dash.push(from);
                canvas.line(&dash, colour, CURVE_WIDTH)?;
            }
            dash = vec![from];
            place = (place + 1) % pattern.len();
            left = pattern[place];
        }
        left -= distance(from, to);
        dash.push(to);
    }
    if place % 2 == 0 && dash.len() > 1 { canvas.line(&dash, colour, CURVE_WIDTH) } else { Ok(()) }
}
