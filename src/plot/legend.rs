//! The legend, under the figure and so never over the data.

use super::PlotError;
use super::canvas::{Align, Canvas, text_width};
use super::style::text;

/// Length of the sample of a curve, px.
pub(super) const SAMPLE: f64 = 40.0;
/// Height of a row, px.
pub(super) const ROW: f64 = 22.0;
const BEFORE_LABEL: f64 = 7.0;
const BETWEEN: f64 = 26.0;

/// Entries broken into rows that fit `room_px`, with the width of every entry.
pub(super) struct Legend {
    rows: Vec<Vec<(usize, f64)>>,
    room_px: f64,
}

impl Legend {
    pub fn new(labels: &[&str], room_px: f64) -> Self {
        let mut rows: Vec<Vec<(usize, f64)>> = Vec::new();
        let mut used = f64::INFINITY;
        for (entry, label) in labels.iter().enumerate() {
            let width = (SAMPLE + BEFORE_LABEL + text_width(label, text::LEGEND)).min(room_px);
            match rows.last_mut() {
                Some(row) if used + BETWEEN + width <= room_px => {
                    row.push((entry, width));
                    used += BETWEEN + width;
                }
                _ => {
                    rows.push(vec![(entry, width)]);
                    used = width;
                }
            }
        }
        Legend { rows, room_px }
    }

    pub fn height(&self) -> f64 {
        self.rows.len() as f64 * ROW
    }

    /// Draws the rows centred in the room from `[left, top]`; `sample` draws what stands for an entry from a point rightwards.
    pub fn draw(
        &self,
        canvas: &Canvas<'_>,
        [left, top]: [f64; 2],
        labels: &[&str],
        sample: impl Fn(usize, [f64; 2]) -> Result<(), PlotError>,
    ) -> Result<(), PlotError> {
        for (number, row) in self.rows.iter().enumerate() {
            let width = row.iter().map(|(_, width)| width).sum::<f64>() + BETWEEN * (row.len() - 1) as f64;
            let mut x = left + (self.room_px - width) / 2.0;
            let y = top + ROW * (number as f64 + 0.5);
            for (entry, width) in row {
                sample(*entry, [x, y])?;
                let at = [x + SAMPLE + BEFORE_LABEL, y];
                canvas.fitted(labels[*entry], at, Align::Left, text::LEGEND, width - SAMPLE - BEFORE_LABEL)?;
                x += width + BETWEEN;
            }
        }
        Ok(())
    }
}
