//! Curves on the sheet: lines with gaps where there is no value, and points.

use super::canvas::Canvas;
use super::figure::{Mark, Series};
use super::frame::Frame;
use super::style::{CURVE_WIDTH, Colour, POINT_RADIUS, WHITE, WIDE_OPACITY, WIDE_WIDTH};

/// Points nearer than this to the last one drawn are left out, px: thinner than any line.
const RESOLUTION: f64 = 0.4;
/// Strokes and gaps of unbroken lines and of dashed ones, px: of the first curve of a colour, and of later ones.
const LINES: [&str; 4] = ["", "16 3 3 3", "3 3", "16 3 3 3 3 3"];
const DASHES: [&str; 4] = ["6 4", "6 3 1.5 3", "1.5 3", "6 3 1.5 3 1.5 3"];
/// Width of the stroke of hollow markers, px.
const HOLLOW_STROKE: f64 = 1.2;

/// Draws a curve into a frame.
pub(super) fn draw(canvas: &mut Canvas, frame: &Frame, series: &Series, colour: Colour) {
    if matches!(series.mark, Mark::Points | Mark::Rings | Mark::Triangles) {
        let points = series.points().filter_map(|point| frame.at(point));
        points.for_each(|at| draw_marker(canvas, at, POINT_RADIUS, series.mark, colour));
        return;
    }
    for run in runs(series, frame) {
        stroke(canvas, &run, series.mark, colour);
    }
}

/// Draws the sample of a curve in a legend, from `[x, y]` rightwards.
pub(super) fn draw_sample(canvas: &mut Canvas, [x, y]: [f64; 2], length_px: f64, mark: Mark, colour: Colour) {
    match mark {
        Mark::Points | Mark::Rings | Mark::Triangles => {
            draw_marker(canvas, [x + length_px - POINT_RADIUS, y], 1.2 * POINT_RADIUS, mark, colour);
        }
        Mark::Line | Mark::Wide | Mark::Dashes | Mark::Limit => stroke(canvas, &[[x, y], [x + length_px, y]], mark, colour),
    }
}

/// Draws the marker of one point. A dot becomes a ring where another curve's points have its colour.
pub(super) fn draw_marker(canvas: &mut Canvas, at: [f64; 2], radius_px: f64, mark: Mark, colour: Colour) {
    if mark == Mark::Triangles {
        return canvas.line(&triangle(at, radius_px), colour, HOLLOW_STROKE, "");
    }
    canvas.circle(at, radius_px, colour);
    if mark == Mark::Rings || colour.alike() % 2 == 1 {
        canvas.circle(at, radius_px - HOLLOW_STROKE, WHITE);
    }
}

/// A triangle on its tip, some larger than a dot of this radius, as a closed line.
fn triangle([x, y]: [f64; 2], radius_px: f64) -> [[f64; 2]; 4] {
    let [half_width, above, below] = [1.3, 0.9, 1.4].map(|part| part * radius_px);
    let first = [x - half_width, y - above];
    [first, [x + half_width, y - above], [x, y + below], first]
}

fn strokes(mark: Mark, colour: Colour) -> &'static str {
    let strokes = if matches!(mark, Mark::Dashes | Mark::Limit) { DASHES } else { LINES };
    strokes[colour.alike() % strokes.len()]
}

fn stroke(canvas: &mut Canvas, run: &[[f64; 2]], mark: Mark, colour: Colour) {
    let is_wide = mark == Mark::Wide;
    match run {
        // A value between two gaps has no length, and is there.
        [alone] => canvas.circle(*alone, if is_wide { POINT_RADIUS } else { POINT_RADIUS / 2.0 }, colour),
        run if is_wide => canvas.pale_line(run, colour, WIDE_WIDTH, WIDE_OPACITY),
        run => canvas.line(run, colour, CURVE_WIDTH, strokes(mark, colour)),
    }
}

/// The parts of a curve without gaps, on the sheet, in points far enough apart to be seen.
fn runs(series: &Series, frame: &Frame) -> Vec<Vec<[f64; 2]>> {
    let mut runs: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut run: Vec<[f64; 2]> = Vec::new();
    let mut skipped = None;
    for point in series.points().map(|point| frame.at(point)).chain([None]) {
        let Some(at) = point else {
            // The run ends at its true end, though that may be close to the point before. One that goes nowhere is a point.
            run.extend(skipped.take().filter(|_| run.len() > 1));
            runs.extend(Some(std::mem::take(&mut run)).filter(|run| !run.is_empty()));
            continue;
        };
        if run.last().is_some_and(|last| (last[0] - at[0]).hypot(last[1] - at[1]) < RESOLUTION) {
            skipped = Some(at);
        } else {
            run.push(at);
            skipped = None;
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_curves_of_one_colour_have_different_strokes() {
        let mut seen: Vec<(String, &str)> = Vec::new();
        for place in 0..28 {
            for mark in [Mark::Line, Mark::Dashes] {
                let look = (Colour::curve(place).to_string(), strokes(mark, Colour::curve(place)));
                assert!(!seen.contains(&look), "{place}: {look:?}");
                seen.push(look);
            }
        }
    }
}
