//! A mechanism in motion: an SVG that moves by itself in a browser or a README.

use super::canvas::{Canvas, Lettering};
use super::mechanism::{Link, Motion, Scale};
use super::style::{Colour, GRID, INK, WHITE};

/// Width of the picture and margin around the mechanism, px.
const WIDTH: f64 = 640.0;
const MARGIN: f64 = 28.0;

/// Draws a motion that lasts `playing_s`.
pub(super) fn draw(title: &str, motion: &Motion, playing_s: f64, lettering: Lettering) -> String {
    let scale = Scale::fitting(motion, [MARGIN, MARGIN], WIDTH - 2.0 * MARGIN);
    let mut canvas = Canvas::new(title, [WIDTH, (scale.height + 2.0 * MARGIN).ceil()], lettering);
    let pivot = scale.at([0.0, 0.0]);
    if motion.links.iter().any(|link| scale.slides(link)) {
        canvas.line(&[[0.0, pivot[1]], [WIDTH, pivot[1]]], GRID, 1.0, "6 5");
    }
    for (index, link) in motion.links.iter().enumerate() {
        if link.name == "crank" {
            canvas.line(&scale.ends(link), GRID, 1.0, "");
        }
        let curves: Vec<String> = link.instants.iter().map(|nodes| scale.curve(nodes)).collect();
        canvas.element(format_args!(
            "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"5\" stroke-linecap=\"round\">{}</path>",
            curves.first().map(String::as_str).unwrap_or_default(),
            Colour::curve(index),
            animate("d", &curves, playing_s)
        ));
    }
    motion.links.iter().for_each(|link| pin(&mut canvas, &scale, link, playing_s));
    canvas.circle(pivot, 6.0, INK);
    canvas.finish()
}

/// The pin at a link's end, and the slider that it may carry.
fn pin(canvas: &mut Canvas, scale: &Scale, link: &Link, playing_s: f64) {
    let ends = scale.ends(link);
    let values = |axis: usize, shift: f64| ends.iter().map(|end| format!("{:.1}", end[axis] - shift)).collect::<Vec<_>>();
    let [x, y] = ends.first().copied().unwrap_or_default();
    if scale.slides(link) {
        canvas.element(format_args!(
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"34\" height=\"22\" rx=\"3\" fill=\"#8a8a8a\" fill-opacity=\"0.8\">{}</rect>",
            x - 17.0,
            y - 11.0,
            animate("x", &values(0, 17.0), playing_s)
        ));
    }
    canvas.element(format_args!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"{WHITE}\" stroke=\"{INK}\" stroke-width=\"2\">{}{}</circle>",
        animate("cx", &values(0, 0.0), playing_s),
        animate("cy", &values(1, 0.0), playing_s)
    ));
}

fn animate(attribute: &str, values: &[String], playing_s: f64) -> String {
    let values = values.join(";");
    format!("<animate attributeName=\"{attribute}\" dur=\"{playing_s:.2}s\" repeatCount=\"indefinite\" values=\"{values}\"/>")
}
