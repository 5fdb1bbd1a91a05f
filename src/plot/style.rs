//! The look of figures: colours that colour-blind people can distinguish, and sizes.

use std::fmt;

/// A colour, as red, green and blue: 0xrrggbb; of a curve, also the number of curves before it that have the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Colour {
    rgb: u32,
    alike: usize,
}

impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:06x}", self.rgb)
    }
}

/// Blue, vermillion, green, purple, orange, sky blue, black: the palette of Okabe & Ito (2008), darkest contrasts first.
const CURVES: [u32; 7] = [0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0xe69f00, 0x56b4e9, 0x000000];
/// Colours of a map's categories, the best first: blue, orange, red, grey, purple, black, green. They also differ in lightness,
/// for readers who see no red or no green.
const CATEGORIES: [u32; 7] = [0x0072b2, 0xf0a830, 0xc01820, 0xbebebe, 0xcc79a7, 0x000000, 0x009e73];
/// The colour map viridis at even distances.
const VIRIDIS: [u32; 9] = [0x440154, 0x472c7a, 0x3b518b, 0x2c718e, 0x21908d, 0x27ad81, 0x5cc863, 0xaadc32, 0xfde725];

/// Ink of frame, ticks and text.
pub(super) const INK: Colour = Colour::new(0x1e1e1e);
/// Ink of text and lines that matter less.
pub(super) const GREY: Colour = Colour::new(0x6e6e6e);
/// Grid lines.
pub(super) const GRID: Colour = Colour::new(0xdedede);
pub(super) const WHITE: Colour = Colour::new(0xffffff);
/// Colours of bands behind curves: paper that darkens, so that curves and grid stay visible.
const BANDS: [u32; 4] = [0xfdf3dc, 0xf8e3bd, 0xefcfa0, 0xe3bb88];
/// Width of curves, px.
pub(super) const CURVE_WIDTH: f64 = 1.9;
/// Width of a curve that others may lie on, px, and its opacity.
pub(super) const WIDE_WIDTH: f64 = 5.0;
pub(super) const WIDE_OPACITY: f64 = 0.4;
/// Radius of a point, px.
pub(super) const POINT_RADIUS: f64 = 2.7;

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
    const fn new(rgb: u32) -> Self {
        Colour { rgb, alike: 0 }
    }

    /// The colour of the curve at `place` in the legend.
    pub fn curve(place: usize) -> Self {
        Colour { rgb: CURVES[place % CURVES.len()], alike: place / CURVES.len() }
    }

    /// The number of curves before this one in the legend that have its colour.
    pub fn alike(self) -> usize {
        self.alike
    }

    /// The colour of the bands at `place` in the legend.
    pub fn band(place: usize) -> Self {
        Colour::new(BANDS[place.min(BANDS.len() - 1)])
    }

    /// The colour of category `place` of a map.
    pub fn category(place: usize) -> Self {
        Colour::new(CATEGORIES[place % CATEGORIES.len()])
    }

    /// The colour of a value on a map, from 0 at the low end of the scale to 1 at the high end.
    pub fn of_value(part: f64) -> Self {
        let place = part.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
        let low = VIRIDIS[place as usize].to_be_bytes();
        let high = VIRIDIS[(place as usize + 1).min(VIRIDIS.len() - 1)].to_be_bytes();
        let mixed = |byte: usize| f64::from(low[byte]) + place.fract() * (f64::from(high[byte]) - f64::from(low[byte]));
        Colour::new(u32::from_be_bytes([0, 1, 2, 3].map(|byte| mixed(byte).round() as u8)))
    }
}
