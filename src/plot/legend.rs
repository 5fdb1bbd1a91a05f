//! The legend, above its panel and so never over the data.

use super::canvas::{Align, Canvas};
use super::lettering::text_width;
use super::style::text;

/// Length of the sample of a curve, px.
pub(super) const SAMPLE: f64 = 26.0;
/// Height of a row, px.
const ROW: f64 = 22.0;
const BEFORE_LABEL: f64 = 7.0;
const BETWEEN: f64 = 26.0;

/// Labels placed in rows: position, row and width of each.
pub(super) struct Legend<'a> {
    entries: Vec<(&'a str, f64, usize, f64)>,
    rows: usize,
}

impl<'a> Legend<'a> {
    /// Places labels in rows from `left` to `right`, px.
    pub fn new(labels: &[&'a str], left: f64, right: f64) -> Self {
        let (mut entries, mut x, mut rows) = (Vec::new(), f64::INFINITY, 0);
        for label in labels {
            let width = (SAMPLE + BEFORE_LABEL + text_width(label, text::LEGEND)).min(right - left);
            if x + width > right {
                (x, rows) = (left, rows + 1);
            }
            entries.push((*label, x, rows - 1, width));
            x += width + BETWEEN;
        }
        Legend { entries, rows }
    }

    pub fn height(&self) -> f64 {
        self.rows as f64 * ROW
    }

    /// Draws the rows from `top`; `sample` draws the sample of an entry from a point rightwards.
    pub fn draw(&self, canvas: &mut Canvas, top: f64, sample: impl Fn(&mut Canvas, usize, [f64; 2])) {
        for (entry, (label, x, row, width)) in self.entries.iter().enumerate() {
            let y = top + ROW * (*row as f64 + 0.5);
            sample(canvas, entry, [*x, y]);
            let at = [x + SAMPLE + BEFORE_LABEL, y];
            canvas.fitted(label, at, Align::Left, text::LEGEND, width - SAMPLE - BEFORE_LABEL);
        }
    }
}
