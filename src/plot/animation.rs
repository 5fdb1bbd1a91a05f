//! A mechanism in motion: an SVG that moves by itself in a browser or a README, drawn from recorded displacements.

use super::canvas::{Canvas, Lettering};
use super::error::PlotError;
use super::mechanism::{Link, Motion, Scale, times, turned};
use super::style::{Colour, FINE_GRID, GRID, INK, WHITE};
use crate::study::Table;

/// Pictures per second of playing; the viewer moves evenly from one to the next.
const PICTURES_HZ: f64 = 15.0;
/// Longest time of playing, s: a file in a README should stay small.
const LONGEST_S: f64 = 10.0;
/// Time in which a turn can be followed by eye, s.
const TURN_S: f64 = 2.0;
/// Width of the picture and margin around the mechanism, px.
const WIDTH: f64 = 640.0;
const MARGIN: f64 = 28.0;

/// A mechanism in motion, as an SVG.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// The file's text.
    pub svg: String,
    /// The factor by which bending is magnified.
    pub magnified: f64,
    /// Recorded time that it plays, s.
    pub recorded_s: f64,
}

/// Animates the topic `displacements` at `speed` recorded seconds per second.
///
/// # Errors
/// [`PlotError::NoLink`] when no link is recorded.
pub fn animation(name: &str, displacements: &Table, speed: f64) -> Result<Animation, PlotError> {
    let times = times(displacements);
    let rows = pictures(times, speed);
    let motion = Motion::new(name, displacements, &rows)?;
    let recorded_s = rows.last().map_or(0.0, |last| times[*last] - times[0]);
    Ok(Animation { svg: svg(name, &motion, recorded_s / speed), magnified: motion.magnified, recorded_s })
}

/// The highest of the usual speeds at which a turn takes two seconds or more; real time for mechanisms that do not turn.
pub fn speed_to_follow(displacements: &Table) -> f64 {
    let times = times(displacements);
    let turn_s = turned(displacements).map_or(TURN_S, |row| times[row] - times[0]);
    [1.0, 0.5, 0.25, 0.1, 0.05, 0.025].into_iter().find(|speed| turn_s / speed >= TURN_S).unwrap_or(0.01)
}

/// The rows that are shown, evenly in time.
fn pictures(times: &[f64], speed: f64) -> Vec<usize> {
    let Some(start) = times.first() else { return Vec::new() };
    let row = |picture: u32| {
        let at = start + f64::from(picture) * speed / PICTURES_HZ;
        times.partition_point(|time| *time < at - 1e-9)
    };
    (0..=(LONGEST_S * PICTURES_HZ) as u32).map(row).take_while(|row| *row < times.len()).collect()
}

fn svg(name: &str, motion: &Motion, playing_s: f64) -> String {
    let scale = Scale::fitting(motion, [MARGIN, MARGIN], WIDTH - 2.0 * MARGIN);
    let height = (scale.height + 2.0 * MARGIN).ceil();
    let title = format!("{name}, bending drawn {} times as large", motion.magnified);
    let mut canvas = Canvas::new(&title, [WIDTH, height], Lettering::Text);
    let pivot = scale.at([0.0, 0.0]);
    canvas.line(&[[0.0, pivot[1]], [WIDTH, pivot[1]]], GRID, 1.0, "6 5");
    for (index, link) in motion.links.iter().enumerate() {
        if link.name == "crank" {
            canvas.line(&scale.ends(link), FINE_GRID, 1.5, "");
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A beam of length 2 that turns once in a second, bent to the left by 1 % of its length.
    fn turning() -> Table {
        let times: Vec<f64> = (0..=100).map(|k| 0.01 * f64::from(k)).collect();
        let mut table = Table::default();
        table.push("stamp.sim_time_s".to_owned(), times.clone());
        for (index, [along, aside]) in [[0.0, 0.0], [1.0, 0.02], [2.0, 0.0]].into_iter().enumerate() {
            let angle = |time: &f64| std::f64::consts::TAU * time;
            let x = times.iter().map(|t| along * angle(t).cos() - aside * angle(t).sin()).collect();
            let y = times.iter().map(|t| along * angle(t).sin() + aside * angle(t).cos()).collect();
            table.push(format!("nodes.beam.{index}.x_m"), x);
            table.push(format!("nodes.beam.{index}.y_m"), y);
        }
        table
    }

    #[test]
    fn prop_bending_is_magnified_and_the_time_kept() {
        let animation = animation("turning", &turning(), 0.5).unwrap();
        assert_eq!(animation.magnified, 10.0, "1 % of the length is drawn as 10 %");
        assert!((animation.recorded_s - 1.0).abs() < 1e-9);
        assert!(animation.svg.contains("dur=\"2.00s\""), "a second at half speed");
        let values = animation.svg.split("attributeName=\"d\"").nth(1).and_then(|rest| rest.split("values=").nth(1)).unwrap();
        assert_eq!(values.split('"').nth(1).unwrap().split(';').count(), 31, "15 pictures a second, both ends included");
    }

    #[test]
    fn prop_a_table_without_links_is_refused() {
        assert!(animation("nothing", &Table::default(), 1.0).is_err_and(|error| error.is_usage()));
    }
}
