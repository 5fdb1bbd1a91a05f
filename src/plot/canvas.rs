//! The sheet that everything is drawn on, in px from its upper left corner. It is an SVG that plotters writes; plotters
//! counts in whole numbers, so the sheet is [`UNITS`] times as large inside and scaled down by its `viewBox`.

use std::sync::OnceLock;

use plotters::coord::Shift;
use plotters::prelude::{
    Circle, DrawingArea, IntoDrawingArea as _, IntoFont as _, PathElement, Polygon, Rectangle, SVGBackend, Text,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle, WHITE, register_font};

use super::PlotError;
use super::style::{INK, Marker};

/// Steps a px.
const UNITS: f64 = 8.0;
/// A font's height that plotters asks for, in em of the SVG it writes.
const SIZE_PER_EM: f64 = 1.24;
/// Ascent plus descent of the embedded font, in em: what plotters takes for the size when it measures text.
const HEIGHT_PER_EM: f64 = 1.164;
const FAMILY: &str = "sans-serif";

/// DejaVu Sans, cut down to Latin, Greek and mathematical signs; see `font/README.md`.
pub(super) const FONT: &[u8] = include_bytes!("font/DejaVuSans-subset.ttf");

/// Horizontal alignment of a text; vertically it is always centred.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Centre,
    Right,
    /// Centred, reading upwards.
    Up,
}

/// An SVG in the making.
pub(super) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
    title: &'a str,
}

/// Makes an SVG of `[width, height]` px by what `draw` does.
pub(super) fn svg(
    title: &str,
    size: [f64; 2],
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let mut text = String::new();
    {
        let inside = size.map(|px| (px * UNITS).round() as u32);
        let canvas = Canvas { area: SVGBackend::with_string(&mut text, inside.into()).into_drawing_area(), title };
        canvas.check(canvas.area.fill(&WHITE))?;
        draw(&canvas)?;
        canvas.check(canvas.area.present())?;
    }
    let (_, body) = text.split_once("<svg ").and_then(|(_, rest)| rest.split_once('>')).unwrap_or(("", &text));
    let [width, height] = size;
    let [inner_width, inner_height] = size.map(|px| (px * UNITS).round());
    Ok(format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" \
         height=\"{height}\" viewBox=\"0 0 {inner_width} {inner_height}\" stroke-linejoin=\"round\">\n<title>{}</title>{body}",
        escape(title)
    ))
}

/// Text as XML and HTML need it.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Width of a text whose em is `em_px`, px.
pub(super) fn text_width(text: &str, em_px: f64) -> f64 {
    static REGISTERED: OnceLock<()> = OnceLock::new();
    // A font that does not parse leaves texts unmeasured, which the tests would show.
    REGISTERED.get_or_init(|| register_font(FAMILY, FontStyle::Normal, FONT).unwrap_or_default());
    // Measured large, since plotters rounds to whole px.
    let font = (FAMILY, em_px * HEIGHT_PER_EM * UNITS).into_font();
    font.layout_box(text).map_or(0.0, |((left, _), (right, _))| f64::from(right - left) / UNITS)
}

fn inside(point: [f64; 2]) -> (i32, i32) {
    let [x, y] = point.map(|px| (px * UNITS).round() as i32);
    (x, y)
}

fn stroke(colour: RGBColor, width_px: f64) -> ShapeStyle {
    colour.stroke_width((width_px * UNITS).round() as u32)
}

impl Canvas<'_> {
    fn check<E: std::error::Error + Send + Sync>(
        &self,
        result: Result<(), plotters::drawing::DrawingAreaErrorKind<E>>,
    ) -> Result<(), PlotError> {
        result.map_err(|cause| PlotError::draw(self.title, cause))
    }

    /// A line through points.
    pub fn line(&self, points: &[[f64; 2]], colour: RGBColor, width_px: f64) -> Result<(), PlotError> {
        let mut points: Vec<(i32, i32)> = points.iter().copied().map(inside).collect();
        points.dedup();
        if points.len() < 2 {
            return Ok(());
        }
        self.check(self.area.draw(&PathElement::new(points, stroke(colour, width_px))))
    }

    /// A filled rectangle between two corners.
    pub fn fill(&self, from: [f64; 2], to: [f64; 2], colour: RGBColor) -> Result<(), PlotError> {
        self.check(self.area.draw(&Rectangle::new([inside(from), inside(to)], colour.filled())))
    }

    /// The outline of a rectangle.
    pub fn outline(&self, from: [f64; 2], to: [f64; 2], colour: RGBColor) -> Result<(), PlotError> {
        self.line(&[from, [to[0], from[1]], to, [from[0], to[1]], from], colour, 1.0)
    }

    /// A marker, half as wide as `radius_px`.
    pub fn marker(&self, at: [f64; 2], marker: Marker, radius_px: f64, colour: RGBColor) -> Result<(), PlotError> {
        let r = radius_px;
        let corners: &[[f64; 2]] = match marker {
            Marker::Circle => {
                let circle = Circle::new(inside(at), (0.95 * r * UNITS).round() as i32, colour.filled());
                return self.check(self.area.draw(&circle));
            }
            Marker::Cross => {
                let stroke_from = |dy: f64| [[at[0] - 0.9 * r, at[1] - dy], [at[0] + 0.9 * r, at[1] + dy]];
                self.line(&stroke_from(0.9 * r), colour, 0.5 * r)?;
                return self.line(&stroke_from(-0.9 * r), colour, 0.5 * r);
            }
            Marker::Square => &[[-0.85, -0.85], [0.85, -0.85], [0.85, 0.85], [-0.85, 0.85]],
            Marker::Triangle => &[[0.0, -1.15], [1.1, 0.8], [-1.1, 0.8]],
            Marker::Down => &[[0.0, 1.15], [1.1, -0.8], [-1.1, -0.8]],
            Marker::Diamond => &[[0.0, -1.25], [1.0, 0.0], [0.0, 1.25], [-1.0, 0.0]],
        };
        let corners: Vec<(i32, i32)> = corners.iter().map(|[x, y]| inside([at[0] + r * x, at[1] + r * y])).collect();
        self.check(self.area.draw(&Polygon::new(corners, colour.filled())))
    }

    /// A text made smaller where it would be longer than `room_px`.
    pub fn fitted(&self, text: &str, at: [f64; 2], align: Align, em_px: f64, room_px: f64) -> Result<(), PlotError> {
        let em = em_px * (room_px / text_width(text, em_px).max(1.0)).min(1.0);
        self.text(text, at, align, em, INK)
    }

    /// A text, centred vertically on its point.
    pub fn text(&self, text: &str, at: [f64; 2], align: Align, em_px: f64, colour: RGBColor) -> Result<(), PlotError> {
        if text.is_empty() {
            return Ok(());
        }
        let horizontal = match align {
            Align::Left => HPos::Left,
            Align::Right => HPos::Right,
            Align::Centre | Align::Up => HPos::Center,
        };
        let turn = if align == Align::Up { FontTransform::Rotate270 } else { FontTransform::None };
        let font = (FAMILY, em_px * SIZE_PER_EM * UNITS).into_font().transform(turn);
        let style = TextStyle::from(font).color(&colour).pos(Pos::new(horizontal, VPos::Center));
        self.check(self.area.draw(&Text::new(text.to_owned(), inside(at), style)))
    }
}
