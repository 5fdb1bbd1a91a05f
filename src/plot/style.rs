//! The look of figures: colours that colour-blind people can distinguish, and dashes and markers that distinguish the curves in
//! black and white.

use plotters::style::RGBColor;

/// Blue, vermillion, green, purple, orange, sky blue, black: the palette of Okabe & Ito (2008), darkest contrasts first.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// Colours of a map's categories, the best first: blue, orange, red, grey, purple, black, green. They also differ in lightness,
/// for readers who see no red or no green.
const CATEGORIES: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(240, 168, 48),
    RGBColor(192, 24, 32),
    RGBColor(190, 190, 190),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(0, 158, 115),
];

/// Lengths of strokes and gaps in turn, px; none for an unbroken line.
const DASHES: [&[f64]; 6] =
    [&[], &[9.0, 4.0], &[11.0, 3.5, 2.0, 3.5], &[2.5, 3.0], &[18.0, 4.0], &[11.0, 3.0, 2.0, 3.0, 2.0, 3.0]];

const MARKERS: [Marker; 6] = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Down, Marker::Cross];

/// Ink of frame, ticks and text.
pub(super) const INK: RGBColor = RGBColor(30, 30, 30);
/// Grid lines.
pub(super) const GRID: RGBColor = RGBColor(222, 222, 222);
/// Minor grid lines of logarithmic axes.
pub(super) const FINE_GRID: RGBColor = RGBColor(240, 240, 240);
/// Width of curves, px.
pub(super) const CURVE_WIDTH: f64 = 1.9;
/// Half the size of a marker, px.
pub(super) const MARKER_RADIUS: f64 = 4.0;

/// Sizes of text: the em, px.
pub(super) mod text {
    pub(in crate::plot) const TITLE: f64 = 17.0;
    pub(in crate::plot) const LABEL: f64 = 14.0;
    pub(in crate::plot) const TICK: f64 = 12.5;
    pub(in crate::plot) const LEGEND: f64 = 13.5;
}

/// Shape of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Marker {
    Circle,
    Square,
    Triangle,
    Diamond,
    Down,
    Cross,
}

/// Colour, dash and marker of a curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Style {
    pub colour: RGBColor,
    pub dash: &'static [f64],
    pub marker: Marker,
}

impl Style {
    /// The style of the curve at `place` in the legend. Colours and dashes have no common period, so 42 curves differ.
    pub fn of(place: usize) -> Self {
        Style {
            colour: COLOURS[place % COLOURS.len()],
            dash: DASHES[place % DASHES.len()],
            marker: MARKERS[place % MARKERS.len()],
        }
    }

    /// The colour of category `place` of a map.
    pub fn category(place: usize) -> RGBColor {
        CATEGORIES[place % CATEGORIES.len()]
    }
}
