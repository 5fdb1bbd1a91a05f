//! The sheet that everything is drawn on, in px from its upper left corner: an SVG in the making.

use std::fmt::{self, Write as _};

use super::lettering::{fitted_em, outlines, text_width};
use super::style::{Colour, INK, WHITE};

/// From a text's middle down to its base line, in em: half the height of a capital.
const HALF_CAPITAL: f64 = 0.36;

/// Horizontal alignment of a text; vertically it is always centred.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Centre,
    Right,
    /// Centred, reading upwards.
    Up,
}

/// The form of texts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lettering {
    /// As texts, in a font that the viewer has.
    Text,
    /// As outlines of the embedded font.
    Outlines,
}

/// An SVG in the making.
pub(super) struct Canvas {
    svg: String,
    lettering: Lettering,
}

/// Text as XML and HTML need it.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A length with no more digits than can be seen, px.
fn px(length: f64) -> f64 {
    (length * 100.0).round() / 100.0
}

impl Canvas {
    /// A white sheet of `[width, height]` px.
    pub fn new(title: &str, [width, height]: [f64; 2], lettering: Lettering) -> Self {
        let (width, height, title) = (px(width), px(height), escape(title));
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             stroke-linejoin=\"round\" font-family=\"'DejaVu Sans', Verdana, sans-serif\">\n<title>{title}</title>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"{WHITE}\"/>\n"
        );
        Canvas { svg, lettering }
    }

    /// The file's text.
    pub fn finish(mut self) -> String {
        self.svg.push_str("</svg>\n");
        self.svg
    }

    /// An element as it is written.
    pub fn element(&mut self, element: fmt::Arguments<'_>) {
        // Writing into a string cannot fail.
        let _ = writeln!(self.svg, "{element}");
    }

    /// A line through points; `dashes` are lengths of strokes and gaps, none for an unbroken line.
    pub fn line(&mut self, points: &[[f64; 2]], colour: Colour, width_px: f64, dashes: &str) {
        let dashes = if dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dashes}\"") };
        self.polyline(points, colour, width_px, &dashes);
    }

    /// A line through points under which the grid stays visible.
    pub fn pale_line(&mut self, points: &[[f64; 2]], colour: Colour, width_px: f64, opacity: f64) {
        self.polyline(points, colour, width_px, &format!(" stroke-opacity=\"{opacity}\""));
    }

    /// A line through points, with more attributes of its stroke.
    fn polyline(&mut self, points: &[[f64; 2]], colour: Colour, width_px: f64, attributes: &str) {
        let points: Vec<String> = points.iter().map(|[x, y]| format!("{},{}", px(*x), px(*y))).collect();
        let points = points.join(" ");
        self.element(format_args!(
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{}\"{attributes}/>",
            px(width_px)
        ));
    }

    /// A filled rectangle between two corners.
    pub fn fill(&mut self, from: [f64; 2], to: [f64; 2], colour: Colour) {
        let [width, height] = [0, 1].map(|axis| px(to[axis] - from[axis]));
        let [x, y] = from.map(px);
        self.element(format_args!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{colour}\"/>"));
    }

    /// The outline of a rectangle.
    pub fn outline(&mut self, from: [f64; 2], to: [f64; 2], colour: Colour) {
        self.line(&[from, [to[0], from[1]], to, [from[0], to[1]], from], colour, 1.0, "");
    }

    /// A filled circle.
    pub fn circle(&mut self, at: [f64; 2], radius_px: f64, colour: Colour) {
        let [x, y] = at.map(px);
        self.element(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius_px}\" fill=\"{colour}\"/>"));
    }

    /// A text made smaller where it would be longer than `room_px`.
    pub fn fitted(&mut self, text: &str, at: [f64; 2], align: Align, em_px: f64, room_px: f64) {
        self.text(text, at, align, fitted_em(text, em_px, room_px), INK);
    }

    /// A text, centred vertically on its point.
    pub fn text(&mut self, text: &str, [x, middle]: [f64; 2], align: Align, em_px: f64, colour: Colour) {
        let y = middle + HALF_CAPITAL * em_px;
        let (anchor, before) = match align {
            Align::Left => ("start", 0.0),
            Align::Right => ("end", 1.0),
            Align::Centre | Align::Up => ("middle", 0.5),
        };
        let turned = match align {
            Align::Up => format!(" transform=\"rotate(-90 {} {})\"", px(x), px(middle)),
            _ => String::new(),
        };
        if self.lettering == Lettering::Outlines {
            let path = outlines(text, [x - before * text_width(text, em_px), y], em_px);
            return self.element(format_args!("<path d=\"{path}\" fill=\"{colour}\"{turned}/>"));
        }
        self.element(format_args!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\" font-size=\"{}\" fill=\"{colour}\"{turned}>{}</text>",
            px(x),
            px(y),
            px(em_px),
            escape(text)
        ));
    }
}
