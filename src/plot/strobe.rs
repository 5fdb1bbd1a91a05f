//! A mechanism as a stroboscope shows it: its positions at even instants in one picture.

use super::canvas::{Align, Canvas, Lettering};
use super::mechanism::{Motion, Scale};
use super::style::{Colour, GREY, GRID, INK, WHITE, sheet, text};

/// Margin left and right of the mechanism, above it, and under it for the caption, px.
const MARGIN: f64 = 60.0;
/// Opacity of the first position; the last is opaque.
const PALEST: f64 = 0.2;

/// Draws the positions of a motion, the earliest palest.
pub(super) fn draw(title: &str, caption: &str, motion: &Motion, lettering: Lettering) -> String {
    let scale = Scale::fitting(motion, [MARGIN, MARGIN], sheet::WIDTH - 2.0 * MARGIN);
    let (middle, room, bottom) = (sheet::WIDTH / 2.0, sheet::WIDTH - 2.0 * sheet::EDGE, MARGIN + scale.height);
    let mut canvas = Canvas::new(title, [sheet::WIDTH, bottom + MARGIN], lettering);
    canvas.fitted(title, [middle, 22.0], Align::Centre, text::TITLE, room);
    let pivot = scale.at([0.0, 0.0]);
    if motion.links.iter().any(|link| scale.slides(link)) {
        canvas.line(&[[sheet::EDGE, pivot[1]], [sheet::WIDTH - sheet::EDGE, pivot[1]]], GRID, 1.0, "6 5");
    }
    for instant in 0..motion.instants {
        let opacity = PALEST + (1.0 - PALEST) * (instant + 1) as f64 / motion.instants as f64;
        canvas.element(format_args!("<g opacity=\"{opacity:.2}\">"));
        for (index, link) in motion.links.iter().enumerate() {
            let (path, colour) = (scale.curve(&link.instants[instant]), Colour::curve(index));
            canvas.element(format_args!(
                "<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"3.5\" stroke-linecap=\"round\"/>"
            ));
        }
        for link in &motion.links {
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
    canvas.fitted(caption, [middle, bottom + 38.0], Align::Centre, text::TICK, room);
    canvas.finish()
}
