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

/// Labels broken into rows that fit the room, with the width of every entry.
pub(super) struct Legend<'a> {
    rows: Vec<Vec<(usize, &'a str, f64)>>,
}

impl<'a> Legend<'a> {
    pub fn new(labels: &[&'a str], room_px: f64) -> Self {
        let mut rows: Vec<Vec<(usize, &str, f64)>> = Vec::new();
        let mut used = f64::INFINITY;
        for (entry, label) in labels.iter().enumerate() {
            let width = (SAMPLE + BEFORE_LABEL + text_width(label, text::LEGEND)).min(room_px);
            match rows.last_mut() {
                Some(row) if used + BETWEEN + width <= room_px => {
                    row.push((entry, label, width));
                    used += BETWEEN + width;
                }
                _ => {
                    rows.push(vec![(entry, label, width)]);
                    used = width;
                }
            }
        }
        Legend { rows }
    }

    pub fn height(&self) -> f64 {
        self.rows.len() as f64 * ROW
    }

    /// Draws the rows from `[left, top]`; `sample` draws the sample of an entry from a point rightwards.
    pub fn draw(&self, canvas: &mut Canvas, [left, top]: [f64; 2], sample: impl Fn(&mut Canvas, usize, [f64; 2])) {
        for (number, row) in self.rows.iter().enumerate() {
            let (mut x, y) = (left, top + ROW * (number as f64 + 0.5));
            for (entry, label, width) in row {
                sample(canvas, *entry, [x, y]);
                let at = [x + SAMPLE + BEFORE_LABEL, y];
                canvas.fitted(label, at, Align::Left, text::LEGEND, width - SAMPLE - BEFORE_LABEL);
                x += width + BETWEEN;
            }
        }
    }
}
