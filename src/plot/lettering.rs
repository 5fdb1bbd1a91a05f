//! Texts of an SVG as outlines of the embedded font: what rasterises it needs to know nothing of fonts.

use std::fmt::Write as _;
use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, OutlineCurve, Point};
use resvg::usvg::roxmltree::{Document, Node};

use super::PlotError;
use super::canvas::FONT;

static LETTERS: LazyLock<Option<FontRef<'static>>> = LazyLock::new(|| FontRef::try_from_slice(FONT).ok());

/// Half the height of an x, in em: what a text's `dy` of half an ex is.
const HALF_EX: f32 = 0.25;

/// The SVG with a path for every text.
///
/// # Errors
/// [`PlotError::Draw`] when it is not an SVG as the canvas writes it.
pub(super) fn outlined(title: &str, svg: &str) -> Result<String, PlotError> {
    let document = Document::parse(svg).map_err(|cause| PlotError::draw(title, cause))?;
    let font = LETTERS.as_ref().ok_or_else(|| PlotError::draw(title, "the embedded font does not parse"))?;
    let mut out = String::with_capacity(2 * svg.len());
    let mut done = 0;
    for text in document.descendants().filter(|node| node.has_tag_name("text")) {
        out.push_str(&svg[done..text.range().start]);
        path(font, &text, &mut out);
        done = text.range().end;
    }
    out.push_str(&svg[done..]);
    Ok(out)
}

fn path(font: &FontRef<'static>, text: &Node<'_, '_>, out: &mut String) {
    let number = |name: &str| text.attribute(name).and_then(|value| value.parse::<f32>().ok()).unwrap_or_default();
    let units_per_em = font.units_per_em().unwrap_or(1.0);
    let em = number("font-size");
    let scale = em / units_per_em;
    let words = text.text().unwrap_or_default().trim();
    let width: f32 = words.chars().map(|letter| scale * font.h_advance_unscaled(font.glyph_id(letter))).sum();
    let before = match text.attribute("text-anchor") {
        Some("middle") => 0.5 * width,
        Some("end") => width,
        _ => 0.0,
    };
    let mut origin = Point { x: number("x") - before, y: number("y") + HALF_EX * em };
    let fill = text.attribute("fill").unwrap_or("black");
    let turned = text.attribute("transform").map(|turn| format!(" transform=\"{turn}\"")).unwrap_or_default();
    // Writing into a string cannot fail.
    let _ = write!(out, "<path fill=\"{fill}\"{turned} d=\"");
    for letter in words.chars() {
        let glyph = font.glyph_id(letter);
        let curves = font.outline(glyph).map(|outline| outline.curves).unwrap_or_default();
        contours(&curves, |point| Point { x: origin.x + scale * point.x, y: origin.y - scale * point.y }, out);
        origin.x += scale * font.h_advance_unscaled(glyph);
    }
    out.push_str("\"/>");
}

/// Appends curves as path data, a new contour wherever one does not begin where the last has ended.
fn contours(curves: &[OutlineCurve], place: impl Fn(&Point) -> Point, out: &mut String) {
    let mut end = None;
    for curve in curves {
        let (points, command): (&[&Point], char) = match curve {
            OutlineCurve::Line(from, to) => (&[from, to], 'L'),
            OutlineCurve::Quad(from, by, to) => (&[from, by, to], 'Q'),
            OutlineCurve::Cubic(from, by, then, to) => (&[from, by, then, to], 'C'),
        };
        let mut put = |command: char, point: &Point| {
            let Point { x, y } = place(point);
            let _ = write!(out, "{command}{x:.1} {y:.1} ");
        };
        if end != Some(*points[0]) {
            put('M', points[0]);
        }
        put(command, points[1]);
        points[2..].iter().for_each(|point| put(' ', point));
        end = points.last().map(|point| **point);
    }
}
