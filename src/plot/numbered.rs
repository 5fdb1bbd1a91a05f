//! Numbered points: a badge beside each in its panel, and the list beside the panel.

use super::canvas::{Align, Canvas};
use super::curve::draw_marker;
use super::figure::Numbered;
use super::frame::Frame;
use super::lettering::fitted_em;
use super::style::{Colour, GREY, INK, POINT_RADIUS, WHITE, sheet, text};

/// Room for the list, px.
pub(super) const WIDTH: f64 = 240.0;
/// Height of an entry of the list, px.
pub(super) const ROW: f64 = 31.0;
const RADIUS: f64 = 8.5;
/// Directions in which a badge may stand from its point, the best first, °; a front's best points have nothing down and left.
const DIRECTIONS: [f64; 8] = [135.0, 160.0, 110.0, 180.0, 90.0, 70.0, 45.0, 225.0];

/// A badge that is drawn: its point, and its centre; a line joins them.
#[derive(Clone, Copy)]
struct Badge {
    point: [f64; 2],
    centre: [f64; 2],
}

/// Draws the points joined by a line, their badges, and the list right of the frame.
pub(super) fn draw(canvas: &mut Canvas, frame: &Frame, list: &[Numbered]) {
    let points: Vec<Option<[f64; 2]>> = list.iter().map(|entry| frame.at(entry.at)).collect();
    let shown: Vec<[f64; 2]> = points.iter().flatten().copied().collect();
    canvas.line(&shown, GREY, 1.2, "");
    let mut badges: Vec<Badge> = Vec::new();
    let left = frame.left + frame.width + 22.0;
    for (number, (entry, point)) in list.iter().zip(points).enumerate() {
        let colour = Colour::curve(entry.series);
        if let Some(at) = point {
            let centre = place(frame, at, &shown, &badges);
            canvas.line(&[at, centre], colour, 1.0, "");
            draw_marker(canvas, at, POINT_RADIUS + 1.0, entry.mark, colour);
            draw_badge(canvas, centre, number + 1, colour);
            badges.push(Badge { point: at, centre });
        }
        let y = frame.top + ROW * (number as f64 + 0.5);
        draw_badge(canvas, [left, y], number + 1, colour);
        let room = sheet::WIDTH - sheet::EDGE - left - 16.0;
        canvas.fitted(&entry.lines[0], [left + 16.0, y - 7.0], Align::Left, text::TICK, room);
        let em = fitted_em(&entry.lines[1], text::NOTE, room);
        canvas.text(&entry.lines[1], [left + 16.0, y + 7.5], Align::Left, em, GREY);
    }
}

fn draw_badge(canvas: &mut Canvas, at: [f64; 2], number: usize, colour: Colour) {
    canvas.circle(at, RADIUS, colour);
    canvas.circle(at, RADIUS - 1.5, WHITE);
    canvas.text(&number.to_string(), at, Align::Centre, text::NOTE - 1.0, INK);
}

/// The nearest position for the badge of the point `at` whose line keeps clear of other points, badges and lines; failing that, one
/// where the badge itself does.
fn place(frame: &Frame, at: [f64; 2], points: &[[f64; 2]], badges: &[Badge]) -> [f64; 2] {
    let inside = |[x, y]: [f64; 2]| {
        (frame.left + RADIUS..frame.left + frame.width).contains(&x)
            && (frame.top..frame.top + frame.height - RADIUS).contains(&y)
    };
    let free = |centre: &[f64; 2]| {
        inside(*centre)
            && badges.iter().all(|badge| distance(*centre, badge.centre) >= 2.0 * RADIUS + 1.0)
            && points.iter().all(|point| distance(*centre, *point) >= RADIUS + POINT_RADIUS + 1.0)
    };
    let clear = |centre: &[f64; 2]| {
        let line = [at, *centre];
        let others = points.iter().filter(|point| **point != at);
        others.copied().all(|point| distance_to_line(point, line) > POINT_RADIUS + 1.0)
            && badges.iter().all(|badge| {
                distance_to_line(badge.centre, line) > RADIUS
                    && distance_to_line(*centre, [badge.point, badge.centre]) > RADIUS
                    && !cross(line, [badge.point, badge.centre])
            })
    };
    let around = |distance: f64| {
        DIRECTIONS.map(|angle: f64| [at[0] + distance * angle.to_radians().cos(), at[1] + distance * angle.to_radians().sin()])
    };
    let places = || (0..12_u8).flat_map(|step| around(16.0 + 5.0 * f64::from(step))).filter(free);
    places().find(clear).or_else(|| places().next()).unwrap_or(at)
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Distance of a point from the line between two others.
fn distance_to_line(point: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length_squared = along[0].powi(2) + along[1].powi(2);
    let part = ((point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1]) / length_squared.max(f64::MIN_POSITIVE);
    let part = part.clamp(0.0, 1.0);
    distance(point, [a[0] + part * along[0], a[1] + part * along[1]])
}

/// Whether two lines, each between two points, cross: the ends of each lie on either side of the other.
fn cross(one: [[f64; 2]; 2], other: [[f64; 2]; 2]) -> bool {
    let side = |[a, b]: [[f64; 2]; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let apart = |line, [c, d]: [[f64; 2]; 2]| side(line, c) * side(line, d) < 0.0;
    apart(one, other) && apart(other, one)
}

#[cfg(test)]
mod tests {
    use super::super::figure::Scale;
    use super::super::frame::Span;
    use super::*;

    #[test]
    fn regress_lines_of_badges_keep_clear_of_one_another() {
        let span = Span::of([0.0, 1.0].into_iter(), Scale::Linear, 0.0);
        let frame = Frame { left: 100.0, top: 100.0, width: 500.0, height: 400.0, x: span, y: span, room: 0.0 };
        let row: Vec<[f64; 2]> = (0..4).map(|number| [300.0 + 10.0 * f64::from(number), 200.0]).collect();
        let mut badges: Vec<Badge> = Vec::new();
        for &point in &row {
            badges.push(Badge { point, centre: place(&frame, point, &row, &badges) });
        }
        for (index, badge) in badges.iter().enumerate() {
            for other in &badges[..index] {
                assert!(distance_to_line(other.centre, [badge.point, badge.centre]) > RADIUS);
                assert!(!cross([badge.point, badge.centre], [other.point, other.centre]));
            }
        }
    }
}
