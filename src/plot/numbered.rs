//! Numbered points: a badge beside each in its panel, and the list beside the panel.

use super::canvas::{Align, Canvas};
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
const DIRECTIONS: [f64; 5] = [135.0, 160.0, 110.0, 180.0, 90.0];

/// Draws the points joined by a line, their badges, and the list right of the frame.
pub(super) fn draw(canvas: &mut Canvas, frame: &Frame, list: &[Numbered]) {
    let points: Vec<Option<[f64; 2]>> = list.iter().map(|entry| frame.at(entry.at)).collect();
    let shown: Vec<[f64; 2]> = points.iter().flatten().copied().collect();
    canvas.line(&shown, GREY, 1.2, "");
    let mut badges: Vec<[f64; 2]> = Vec::new();
    let left = frame.left + frame.width + 22.0;
    for (number, (entry, point)) in list.iter().zip(points).enumerate() {
        let colour = Colour::curve(entry.series);
        if let Some(at) = point {
            let badge = place(frame, at, &shown, &badges);
            canvas.line(&[at, badge], colour, 1.0, "");
            canvas.circle(at, POINT_RADIUS + 1.0, colour);
            draw_badge(canvas, badge, number + 1, colour);
            badges.push(badge);
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

/// The nearest free position for the badge of the point `at`.
fn place(frame: &Frame, at: [f64; 2], points: &[[f64; 2]], badges: &[[f64; 2]]) -> [f64; 2] {
    let near = |a: [f64; 2], b: &[f64; 2], distance: f64| (a[0] - b[0]).hypot(a[1] - b[1]) < distance;
    let inside = |[x, y]: [f64; 2]| {
        (frame.left + RADIUS..frame.left + frame.width).contains(&x)
            && (frame.top..frame.top + frame.height - RADIUS).contains(&y)
    };
    let free = |place: &[f64; 2]| {
        inside(*place)
            && !badges.iter().any(|badge| near(*place, badge, 2.0 * RADIUS + 1.0))
            && !points.iter().any(|point| near(*place, point, RADIUS + POINT_RADIUS + 1.0))
    };
    let around = |distance: f64| {
        DIRECTIONS.map(|angle: f64| [at[0] + distance * angle.to_radians().cos(), at[1] + distance * angle.to_radians().sin()])
    };
    let places = (0..12_u8).flat_map(|step| around(16.0 + 5.0 * f64::from(step)));
    places.into_iter().find(free).unwrap_or(at)
}
