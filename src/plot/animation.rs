//! A mechanism in motion: an SVG that moves by itself in a browser or a README, drawn from recorded displacements.

use std::fmt::Write as _;

use super::PlotError;
use super::style::{INK, Style};
use crate::study::Table;

/// Pictures per second of playing; the viewer moves evenly from one to the next.
const PICTURES_HZ: f64 = 15.0;
/// Longest time of playing, s: a file in a README should stay small.
const LONGEST_S: f64 = 10.0;
/// Width of the picture and margin around the mechanism, px.
const WIDTH: f64 = 640.0;
const MARGIN: f64 = 28.0;
/// Bending is drawn magnified until it reaches this part of the link's length.
const BENDING: f64 = 0.12;
/// The factors of magnification.
const FACTORS: [f64; 10] = [1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0, 500.0, 1000.0];

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

/// One link: the positions of its nodes at every picture.
struct Moving {
    name: String,
    pictures: Vec<Vec<[f64; 2]>>,
    worst_bending: f64,
}

/// Animates the topic `displacements` at `speed` recorded seconds per second.
///
/// # Errors
/// [`PlotError::Nothing`] when no link is recorded.
pub fn animation(name: &str, displacements: &Table, speed: f64) -> Result<Animation, PlotError> {
    let nothing = || PlotError::Nothing(format!("{name}: no link to animate"));
    let times = displacements.column("stamp.sim_time_s").ok_or_else(nothing)?;
    let rows = pictures(times, speed);
    let mut links: Vec<Moving> = ["crank", "rod", "beam"].iter().filter_map(|link| moving(displacements, link, &rows)).collect();
    let (Some(&first), Some(&last), false) = (rows.first(), rows.last(), links.is_empty()) else { return Err(nothing()) };
    let worst = links.iter().map(|link| link.worst_bending).fold(0.0, f64::max);
    let magnified = FACTORS.into_iter().rev().find(|factor| factor * worst <= BENDING).unwrap_or(1.0);
    let magnified = if worst > 0.0 { magnified } else { 1.0 };
    links.iter_mut().for_each(|link| link.pictures.iter_mut().for_each(|nodes| magnify(nodes, magnified)));
    let recorded_s = times[last] - times[first];
    Ok(Animation { svg: svg(name, &links, magnified, recorded_s / speed), magnified, recorded_s })
}

/// The rows that are shown, evenly in time, of the first epoch.
fn pictures(times: &[f64], speed: f64) -> Vec<usize> {
    let end = times.windows(2).position(|pair| pair[1] < pair[0]).map_or(times.len(), |last| last + 1);
    let Some(&start) = times.first() else { return Vec::new() };
    let mut rows = Vec::new();
    let count = (LONGEST_S * PICTURES_HZ) as usize;
    for picture in 0..=count {
        let at = start + picture as f64 * speed / PICTURES_HZ;
        let row = times[..end].partition_point(|time| *time < at - 1e-9);
        if row == end {
            break;
        }
        rows.push(row);
    }
    rows
}

fn moving(table: &Table, link: &str, rows: &[usize]) -> Option<Moving> {
    let node = |index: usize| {
        let column = |axis: &str| table.column(&format!("nodes.{link}.{index}.{axis}_m"));
        Some((column("x")?, column("y")?))
    };
    let nodes: Vec<_> = (0..).map_while(node).collect();
    if nodes.len() < 2 {
        return None;
    }
    let place = |(x, y): &(&[f64], &[f64]), row: usize| Some([*x.get(row)?, *y.get(row)?]).filter(|[x, y]| (x + y).is_finite());
    let picture = |&row: &usize| nodes.iter().map(|node| place(node, row)).collect::<Option<Vec<_>>>();
    let pictures: Vec<Vec<[f64; 2]>> = rows.iter().map(picture).collect::<Option<_>>()?;
    let worst_bending = pictures.iter().flat_map(|nodes| offsets(nodes)).fold(0.0, |most: f64, offset| most.max(offset.abs()));
    Some(Moving { name: link.to_owned(), pictures, worst_bending })
}

/// Offsets of the nodes from the chord, over its length.
fn offsets(nodes: &[[f64; 2]]) -> Vec<f64> {
    let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else { return Vec::new() };
    let chord = [last[0] - first[0], last[1] - first[1]];
    let square = chord[0].powi(2) + chord[1].powi(2);
    nodes.iter().map(|node| (chord[0] * (node[1] - first[1]) - chord[1] * (node[0] - first[0])) / square).collect()
}

fn magnify(nodes: &mut [[f64; 2]], factor: f64) {
    let offsets = offsets(nodes);
    let (Some(&first), Some(&last)) = (nodes.first(), nodes.last()) else { return };
    for (node, offset) in nodes.iter_mut().zip(offsets) {
        let more = (factor - 1.0) * offset;
        node[0] -= more * (last[1] - first[1]);
        node[1] += more * (last[0] - first[0]);
    }
}

/// From metres to px, y upwards.
struct Frame {
    left_m: f64,
    top_m: f64,
    px_per_m: f64,
    height: f64,
}

impl Frame {
    fn around(links: &[Moving]) -> Self {
        let all = || links.iter().flat_map(|link| &link.pictures).flatten().chain([&[0.0, 0.0]]);
        let least = |axis: usize| all().map(|node| node[axis]).fold(f64::INFINITY, f64::min);
        let most = |axis: usize| all().map(|node| node[axis]).fold(f64::NEG_INFINITY, f64::max);
        let px_per_m = (WIDTH - 2.0 * MARGIN) / (most(0) - least(0)).max(most(1) - least(1)).max(1e-12);
        Frame { left_m: least(0), top_m: most(1), px_per_m, height: (most(1) - least(1)) * px_per_m + 2.0 * MARGIN }
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [MARGIN + (x - self.left_m) * self.px_per_m, MARGIN + (self.top_m - y) * self.px_per_m]
    }
}

fn svg(name: &str, links: &[Moving], magnified: f64, playing_s: f64) -> String {
    let frame = Frame::around(links);
    let [pivot_x, pivot_y] = frame.at([0.0, 0.0]);
    let ink = hex(INK.0, INK.1, INK.2);
    let title = name.replace('&', "&amp;").replace('<', "&lt;");
    let height = frame.height.ceil();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\">\n\
         <title>{title}, bending drawn {magnified} times as large</title>\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n\
         <line x1=\"0\" x2=\"{WIDTH}\" y1=\"{pivot_y:.1}\" y2=\"{pivot_y:.1}\" stroke=\"#d0d0d0\" stroke-dasharray=\"6 5\"/>\n"
    );
    let mut pins = Vec::new();
    for (index, link) in links.iter().enumerate() {
        let ends = link.pictures.iter().filter_map(|nodes| nodes.last()).map(|end| frame.at(*end)).collect::<Vec<_>>();
        if link.name == "crank" {
            let path: Vec<String> = ends.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(svg, "<polyline points=\"{}\" fill=\"none\" stroke=\"#e4e4e4\"/>", path.join(" "));
        }
        let colour = Style::of(index).colour;
        let curves: Vec<String> = link.pictures.iter().map(|nodes| curve(&frame, nodes)).collect();
        let _ = writeln!(
            svg,
            "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"5\" stroke-linecap=\"round\">{}</path>",
            curves.first().map(String::as_str).unwrap_or_default(),
            hex(colour.0, colour.1, colour.2),
            animate("d", &curves, playing_s)
        );
        pins.push((link.name == "rod", ends));
    }
    for (slides, ends) in &pins {
        let values = |axis: usize, shift: f64| ends.iter().map(|end| format!("{:.1}", end[axis] - shift)).collect::<Vec<_>>();
        let first = ends.first().copied().unwrap_or_default();
        if *slides && ends.iter().all(|end| (end[1] - pivot_y).abs() < 0.5) {
            let _ = writeln!(
                svg,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"34\" height=\"22\" rx=\"3\" fill=\"#8a8a8a\" fill-opacity=\"0.8\">{}</rect>",
                first[0] - 17.0,
                pivot_y - 11.0,
                animate("x", &values(0, 17.0), playing_s)
            );
        }
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"5\" fill=\"white\" stroke=\"{ink}\" stroke-width=\"2\">{}{}</circle>",
            first[0],
            first[1],
            animate("cx", &values(0, 0.0), playing_s),
            animate("cy", &values(1, 0.0), playing_s)
        );
    }
    let _ = writeln!(svg, "<circle cx=\"{pivot_x:.1}\" cy=\"{pivot_y:.1}\" r=\"6\" fill=\"{ink}\"/>\n</svg>");
    svg
}

fn animate(attribute: &str, values: &[String], playing_s: f64) -> String {
    let values = values.join(";");
    format!("<animate attributeName=\"{attribute}\" dur=\"{playing_s:.2}s\" repeatCount=\"indefinite\" values=\"{values}\"/>")
}

/// A smooth curve through the nodes: Catmull and Rom's spline, as cubic Béziers.
fn curve(frame: &Frame, nodes: &[[f64; 2]]) -> String {
    let at = |index: usize| frame.at(nodes[index.min(nodes.len() - 1)]);
    let [x, y] = at(0);
    let mut path = format!("M{x:.1} {y:.1}C");
    for index in 0..nodes.len() - 1 {
        let (before, from, to, after) = (at(index.saturating_sub(1)), at(index), at(index + 1), at(index + 2));
        let one = [0, 1].map(|axis| from[axis] + (to[axis] - before[axis]) / 6.0);
        let other = [0, 1].map(|axis| to[axis] - (after[axis] - from[axis]) / 6.0);
        for [x, y] in [one, other, to] {
            let _ = write!(path, "{x:.1} {y:.1} ");
        }
    }
    path.trim_end().to_owned()
}

fn hex(red: u8, green: u8, blue: u8) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
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
