//! The look of figures: colours that colour-blind people can distinguish, and sizes.

use std::fmt;

/// A colour: red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Colour(pub u8, pub u8, pub u8);

impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// Blue, vermillion, green, purple, orange, sky blue, black: the palette of Okabe & Ito (2008), darkest contrasts first.
const CURVES: [Colour; 7] = [
    Colour(0, 114, 178),
    Colour(213, 94, 0),
    Colour(0, 158, 115),
    Colour(204, 121, 167),
    Colour(230, 159, 0),
    Colour(86, 180, 233),
    Colour(0, 0, 0),
];

/// Colours of a map's categories, the best first: blue, orange, red, grey, purple, black, green. They also differ in lightness,
/// for readers who see no red or no green.
const CATEGORIES: [Colour; 7] = [
    Colour(0, 114, 178),
    Colour(240, 168, 48),
    Colour(192, 24, 32),
    Colour(190, 190, 190),
    Colour(204, 121, 167),
    Colour(0, 0, 0),
    Colour(0, 158, 115),
];

/// The colour map viridis at even distances.
const VIRIDIS: [Colour; 9] = [
    Colour(68, 1, 84),
    Colour(71, 44, 122),
    Colour(59, 81, 139),
    Colour(44, 113, 142),
    Colour(33, 144, 141),
    Colour(39, 173, 129),
    Colour(92, 200, 99),
    Colour(170, 220, 50),
    Colour(253, 231, 37),
];

/// Ink of frame, ticks and text.
pub(super) const INK: Colour = Colour(30, 30, 30);
/// Ink of text and lines that matter less.
pub(super) const GREY: Colour = Colour(110, 110, 110);
/// Grid lines.
pub(super) const GRID: Colour = Colour(222, 222, 222);
/// Minor grid lines of logarithmic axes.
pub(super) const FINE_GRID: Colour = Colour(240, 240, 240);
pub(super) const WHITE: Colour = Colour(255, 255, 255);
/// Width of curves, px.
pub(super) const CURVE_WIDTH: f64 = 1.9;
/// Radius of a point, px.
pub(super) const POINT_RADIUS: f64 = 3.2;

/// The sheet that figures are laid out on, px.
pub(super) mod sheet {
    /// Width of every figure.
    pub(in crate::plot) const WIDTH: f64 = 760.0;
    /// Room above the frame, right of it, and below it for ticks and label.
    pub(in crate::plot) const TOP: f64 = 44.0;
    pub(in crate::plot) const RIGHT: f64 = 30.0;
    pub(in crate::plot) const BELOW: f64 = 54.0;
    /// Margin at the sheet's edges.
    pub(in crate::plot) const EDGE: f64 = 10.0;
}

/// Sizes of text: the em, px.
pub(super) mod text {
    pub(in crate::plot) const TITLE: f64 = 17.0;
    pub(in crate::plot) const LABEL: f64 = 14.0;
    pub(in crate::plot) const TICK: f64 = 12.5;
    pub(in crate::plot) const LEGEND: f64 = 13.5;
    pub(in crate::plot) const NOTE: f64 = 11.5;
}

impl Colour {
    /// The colour of the curve at `place` in the legend.
    pub fn curve(place: usize) -> Self {
        CURVES[place % CURVES.len()]
    }

    /// The colour of category `place` of a map.
    pub fn category(place: usize) -> Self {
        CATEGORIES[place % CATEGORIES.len()]
    }

    /// The colour of a value on a map, from 0 at the low end of the scale to 1 at the high end.
    pub fn of_value(part: f64) -> Self {
        let place = part.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
        let low = VIRIDIS[place as usize];
        let high = VIRIDIS[(place as usize + 1).min(VIRIDIS.len() - 1)];
        let mixed = |low: u8, high: u8| (f64::from(low) + place.fract() * (f64::from(high) - f64::from(low))).round() as u8;
        Colour(mixed(low.0, high.0), mixed(low.1, high.1), mixed(low.2, high.2))
    }
}
