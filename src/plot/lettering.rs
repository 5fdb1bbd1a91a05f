//! The embedded font: widths of texts, and their outlines, so that rasterising needs no font.

use std::fmt::Write as _;
use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, OutlineCurve, Point};

/// DejaVu Sans, cut down to Latin, Greek and mathematical signs; see `font/README.md`. If it did not parse, texts would have no
/// width and no outlines, which the tests would show.
static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(include_bytes!("font/DejaVuSans-subset.ttf")).ok());

/// Width of a text whose em is `em_px`, px.
pub(super) fn text_width(text: &str, em_px: f64) -> f64 {
    let Some(font) = &*FONT else { return 0.0 };
    let advances: f32 = text.chars().map(|letter| font.h_advance_unscaled(font.glyph_id(letter))).sum();
    em_px * f64::from(advances) / units_per_em(font)
}

/// The outlines of a text that begins at `[x, y]` on its base line, as the data of an SVG path.
pub(super) fn outlines(text: &str, [mut x, y]: [f64; 2], em_px: f64) -> String {
    let mut path = String::new();
    let Some(font) = &*FONT else { return path };
    let scale = em_px / units_per_em(font);
    for letter in text.chars() {
        let glyph = font.glyph_id(letter);
        let curves = font.outline(glyph).map(|outline| outline.curves).unwrap_or_default();
        contours(&curves, |point| [x + scale * f64::from(point.x), y - scale * f64::from(point.y)], &mut path);
        x += scale * f64::from(font.h_advance_unscaled(glyph));
    }
    path
}

/// Size of letters with which a text is at most `room_px` long, and at most `em_px`.
pub(super) fn fitted_em(text: &str, em_px: f64, room_px: f64) -> f64 {
    em_px * (room_px / text_width(text, em_px).max(1.0)).min(1.0)
}

fn units_per_em(font: &FontRef<'_>) -> f64 {
    font.units_per_em().map_or(1.0, f64::from)
}

/// Appends curves as path data, a new contour wherever one does not begin where the last has ended.
fn contours(curves: &[OutlineCurve], place: impl Fn(&Point) -> [f64; 2], path: &mut String) {
    let mut end = None;
    for curve in curves {
        let (points, command): (&[&Point], char) = match curve {
            OutlineCurve::Line(from, to) => (&[from, to], 'L'),
            OutlineCurve::Quad(from, by, to) => (&[from, by, to], 'Q'),
            OutlineCurve::Cubic(from, by, then, to) => (&[from, by, then, to], 'C'),
        };
        if end != Some(*points[0]) {
            let [x, y] = place(points[0]);
            let _ = write!(path, "M{x:.2} {y:.2}");
        }
        path.push(command);
        for [x, y] in points[1..].iter().map(|point| place(point)) {
            let _ = write!(path, "{x:.2} {y:.2} ");
        }
        end = points.last().map(|point| **point);
    }
}
