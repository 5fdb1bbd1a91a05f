//! A mechanism as a stroboscope shows it: its positions at even instants in one picture.

use super::canvas::{Align, Canvas, Lettering};
use super::error::PlotError;
use super::mechanism::{Motion, Scale, times, turned};
use super::style::{Colour, GREY, GRID, INK, WHITE, sheet, text};
use crate::study::Table;

/// Number of positions.
pub const POSITIONS: usize = 12;
/// Margin left and right of the mechanism, and largest width of it, px.
const MARGIN: f64 = 60.0;
/// Height of the texts under the mechanism, px.
const BELOW: f64 = 62.0;
/// Opacity of the first position; the last is opaque.
const PALEST: f64 = 0.2;

/// A mechanism at several instants.
#[derive(Debug, Clone, PartialEq)]
pub struct Strobe {
    /// Title of the picture.
    pub title: String,
    /// Instants and magnification, in words.
    pub caption: String,
    motion: Motion,
}

impl Strobe {
    /// Positions of the topic `displacements` at even instants of its first turn, or of its whole time if nothing turns.
    ///
    /// # Errors
    /// [`PlotError::NoLink`] when no link is recorded.
    pub fn new(place: &str, displacements: &Table) -> Result<Self, PlotError> {
        let times = times(displacements);
        let turn = turned(displacements);
        let (Some(start), Some(end)) = (times.first(), turn.map_or(times.last(), |row| times.get(row))) else {
            return Err(PlotError::NoLink(place.to_owned()));
        };
        // After a turn the mechanism is where it was.
        let steps = if turn.is_some() { POSITIONS } else { POSITIONS - 1 };
        let row =
            |number: usize| times.partition_point(|time| *time < start + (end - start) * number as f64 / steps as f64 - 1e-9);
        let mut rows: Vec<usize> = (0..POSITIONS).map(row).filter(|row| *row < times.len()).collect();
        rows.dedup();
        let motion = Motion::new(place, displacements, &rows)?;
        let last = rows.last().map_or(*start, |row| times[*row]);
        let during = if turn.is_some() { "one turn" } else { "the recorded time" };
        let magnified =
            if motion.magnified > 1.0 { format!("; bending drawn {} times as large", motion.magnified) } else { String::new() };
        let caption = format!(
            "{} positions in {during}, from {start:.3} s (pale) to {last:.3} s (dark), {:.3} s apart{magnified}",
            rows.len(),
            (end - start) / steps as f64
        );
        Ok(Strobe { title: format!("{place}: the mechanism in motion"), caption, motion })
    }

    pub(super) fn drawn(&self, lettering: Lettering) -> String {
        let Motion { links, .. } = &self.motion;
        let scale = Scale::fitting(&self.motion, [MARGIN, sheet::TOP + 16.0], sheet::WIDTH - 2.0 * MARGIN);
        let bottom = sheet::TOP + 16.0 + scale.height;
        let mut canvas = Canvas::new(&self.title, [sheet::WIDTH, bottom + BELOW], lettering);
        let middle = sheet::WIDTH / 2.0;
        let room = sheet::WIDTH - 2.0 * sheet::EDGE;
        canvas.fitted(&self.title, [middle, 22.0], Align::Centre, text::TITLE, room);
        let pivot = scale.at([0.0, 0.0]);
        if links.iter().any(|link| scale.slides(link)) {
            canvas.line(&[[sheet::EDGE, pivot[1]], [sheet::WIDTH - sheet::EDGE, pivot[1]]], GRID, 1.0, "6 5");
        }
        let count = links.iter().map(|link| link.instants.len()).max().unwrap_or(0);
        for instant in 0..count {
            let opacity = PALEST + (1.0 - PALEST) * (instant + 1) as f64 / count as f64;
            canvas.element(format_args!("<g opacity=\"{opacity:.2}\">"));
            for (index, link) in links.iter().enumerate() {
                let (path, colour) = (scale.curve(&link.instants[instant]), Colour::curve(index));
                canvas.element(format_args!(
                    "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"3.5\" stroke-linecap=\"round\"/>"
                ));
            }
            for link in links {
                let [x, y] = scale.ends(link)[instant];
                if scale.slides(link) {
                    canvas.outline([x - 13.0, y - 9.0], [x + 13.0, y + 9.0], GREY);
                }
                canvas.circle([x, y], 4.0, INK);
                canvas.circle([x, y], 2.5, WHITE);
            }
            canvas.element(format_args!("</g>"));
        }
        canvas.circle(pivot, 6.0, INK);
        canvas.fitted(&self.caption, [middle, bottom + 38.0], Align::Centre, text::TICK, room);
        canvas.finish()
    }
}
