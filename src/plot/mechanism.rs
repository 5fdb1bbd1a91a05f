//! A mechanism from recorded displacements: where its links are at chosen instants, and how they are drawn.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use super::error::PlotError;
use super::session_time::{self, SESSION_TIME, follows_reset};
use crate::study::Table;

/// Links by their names in recordings.
pub(super) const LINKS: [&str; 3] = ["crank", "rod", "beam"];
/// Bending is drawn magnified until it reaches this part of the link's length.
const BENDING: f64 = 0.12;
/// Bending of less than this part of the length is rounding, as of rigid links.
const ROUNDING: f64 = 1e-9;
/// The factors of magnification.
const FACTORS: [f64; 10] = [1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0, 500.0, 1000.0];

/// A mechanism at several instants, its bending magnified.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Motion {
    pub links: Vec<Link>,
    /// Number of instants.
    pub instants: usize,
    /// Whether the rod's end may be a slider.
    has_slider: bool,
    /// The factor by which bending is magnified; `None` if no link bends.
    pub magnified: Option<f64>,
}

/// One link: the positions of its nodes at every instant, m.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Link {
    pub name: &'static str,
    pub instants: Vec<Vec<[f64; 2]>>,
}

/// Times of the first epoch, s: simulated ones, or since the recording began if that has resets.
pub(super) fn times(displacements: &Table) -> &[f64] {
    let times = session_time::times(displacements).unwrap_or_default();
    let follows_reset = follows_reset(displacements);
    let end = (0..times.len()).find(|row| follows_reset(*row)).unwrap_or(times.len());
    &times[..end]
}

/// Time of the reset that ends the first epoch, in a recording with resets, s.
pub(super) fn reset_s(displacements: &Table) -> Option<f64> {
    displacements.column(SESSION_TIME)?.get(times(displacements).len()).copied()
}

/// The turning of the first link from the first row up to every row of the first epoch, rad; empty if there is no link.
pub(super) fn turning_rad(displacements: &Table) -> Vec<f64> {
    let rows: Vec<f64> = (0..times(displacements).len()).map(|row| row as f64).collect();
    let Some(link) = LINKS.iter().find_map(|link| link_at(displacements, link, &rows)) else { return Vec::new() };
    let angles = link.instants.iter().filter_map(|nodes| {
        let (first, last) = (nodes.first()?, nodes.last()?);
        Some((last[1] - first[1]).atan2(last[0] - first[0]))
    });
    let (mut before, mut sum) = (None, 0.0_f64);
    let turning = angles.map(|angle| {
        let step = angle - before.replace(angle).unwrap_or(angle);
        sum += step - TAU * (step / TAU).round();
        sum
    });
    turning.collect()
}

/// Bending of the links in every row of the first epoch: the offset from the chord, over its length, of the node that bends most.
pub(super) fn bending(displacements: &Table) -> Vec<(&'static str, Vec<f64>)> {
    let rows = times(displacements).len();
    let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let bending_of = |link: &'static str| {
        let nodes = nodes(displacements, link);
        let (first, last) = (nodes.first()?, nodes.last()?);
        let at = |[x, y]: &Node<'_>, row: usize| Some([*x.get(row)?, *y.get(row)?]);
        let in_row = |node: &Node<'_>, row: usize| Some(offset(at(node, row)?, at(first, row)?, at(last, row)?));
        let in_all_rows = |node: &Node<'_>| (0..rows).map(|row| in_row(node, row)).collect::<Option<Vec<f64>>>();
        let bent = nodes.iter().filter_map(in_all_rows);
        Some((link, bent.max_by(|one, other| largest(one).total_cmp(&largest(other)))?))
    };
    LINKS.into_iter().filter_map(bending_of).collect()
}

/// The row in which a link has turned once; none if it does not.
pub(super) fn turned(turning_rad: &[f64]) -> Option<usize> {
    turning_rad.iter().position(|turned_rad| turned_rad.abs() >= TAU)
}

/// The refusal of a recording without links.
pub(super) fn no_link(place: &str) -> PlotError {
    PlotError::Request(format!("{place}: no link to animate"))
}

impl Motion {
    /// The mechanism at these places between the rows of the topic `displacements`.
    ///
    /// # Errors
    /// [`PlotError::Request`] when no link is recorded.
    pub fn new(place: &str, displacements: &Table, places: &[f64], has_slider: bool) -> Result<Self, PlotError> {
        let links: Vec<Link> = LINKS.iter().filter_map(|link| link_at(displacements, link, places)).collect();
        if places.is_empty() || links.is_empty() {
            return Err(no_link(place));
        }
        let bent = links.iter().flat_map(|link| &link.instants).flat_map(|nodes| offsets(nodes));
        let worst = bent.fold(0.0, |most: f64, offset| most.max(offset.abs()));
        let mut motion = Motion { links, instants: places.len(), has_slider, magnified: None };
        if worst > ROUNDING {
            motion.magnify(FACTORS.into_iter().rev().find(|factor| factor * worst <= BENDING).unwrap_or(1.0));
        }
        Ok(motion)
    }

    /// Magnifies the recorded bending by a factor, whatever it was magnified by before.
    pub fn magnify(&mut self, factor: f64) {
        let more = factor / self.magnified.replace(factor).unwrap_or(1.0);
        self.links.iter_mut().flat_map(|link| &mut link.instants).for_each(|nodes| magnify(nodes, more));
    }

    /// The magnification in words, after other words.
    pub fn magnification(&self) -> String {
        let magnified = self.magnified.filter(|factor| *factor > 1.0);
        magnified.map_or(String::new(), |factor| format!(", bending from the chord drawn {factor} times as large"))
    }
}

/// The columns `x_m` and `y_m` of a node.
type Node<'a> = [&'a [f64]; 2];

/// The nodes of a link, from its first pin to its last.
fn nodes<'a>(table: &'a Table, link: &str) -> Vec<Node<'a>> {
    let node = |index: usize| {
        let column = |axis: &str| table.column(&format!("nodes.{link}.{index}.{axis}_m"));
        Some([column("x")?, column("y")?])
    };
    (0..).map_while(node).collect()
}

fn link_at(table: &Table, name: &'static str, places: &[f64]) -> Option<Link> {
    let nodes = nodes(table, name);
    if nodes.len() < 2 {
        return None;
    }
    let position =
        |[x, y]: &Node<'_>, place: f64| Some([between(x, place)?, between(y, place)?]).filter(|[x, y]| (x + y).is_finite());
    let instant = |&place: &f64| nodes.iter().map(|node| position(node, place)).collect::<Option<Vec<_>>>();
    Some(Link { name, instants: places.iter().map(instant).collect::<Option<_>>()? })
}

/// The value at a place between rows: at 3.5, the mean of rows 3 and 4.
pub(super) fn between(values: &[f64], place: f64) -> Option<f64> {
    let (low, high) = (values.get(place.floor() as usize)?, values.get(place.ceil() as usize)?);
    Some(low + place.fract() * (high - low))
}

/// Offsets of the nodes from the chord, over its length.
fn offsets(nodes: &[[f64; 2]]) -> Vec<f64> {
    let (Some(&first), Some(&last)) = (nodes.first(), nodes.last()) else { return Vec::new() };
    nodes.iter().map(|node| offset(*node, first, last)).collect()
}

/// Offset of a node from the chord between a link's first and last node, over its length.
fn offset(node: [f64; 2], first: [f64; 2], last: [f64; 2]) -> f64 {
    let chord = [last[0] - first[0], last[1] - first[1]];
    let square = chord[0].powi(2) + chord[1].powi(2);
    (chord[0] * (node[1] - first[1]) - chord[1] * (node[0] - first[0])) / square
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
pub(super) struct Scale {
    left_m: f64,
    top_m: f64,
    px_per_m: f64,
    origin: [f64; 2],
    has_slider: bool,
    pub height: f64,
}

impl Scale {
    /// Fits a motion and its pivot into `width` px from `origin` on.
    pub fn fitting(motion: &Motion, origin: [f64; 2], width: f64) -> Self {
        let all = || motion.links.iter().flat_map(|link| &link.instants).flatten().chain([&[0.0, 0.0]]);
        let least = |axis: usize| all().map(|node| node[axis]).fold(f64::INFINITY, f64::min);
        let most = |axis: usize| all().map(|node| node[axis]).fold(f64::NEG_INFINITY, f64::max);
        let px_per_m = width / (most(0) - least(0)).max(most(1) - least(1)).max(1e-12);
        let height = (most(1) - least(1)) * px_per_m;
        Scale { left_m: least(0), top_m: most(1), px_per_m, origin, has_slider: motion.has_slider, height }
    }

    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.origin[0] + (x - self.left_m) * self.px_per_m, self.origin[1] + (self.top_m - y) * self.px_per_m]
    }

    /// Positions of a link's end, px.
    pub fn ends(&self, link: &Link) -> Vec<[f64; 2]> {
        link.instants.iter().filter_map(|nodes| nodes.last()).map(|end| self.at(*end)).collect()
    }

    /// Whether a link's end slides along the horizontal through the pivot.
    pub fn slides(&self, link: &Link) -> bool {
        let pivot = self.at([0.0, 0.0]);
        self.has_slider && link.name == "rod" && self.ends(link).iter().all(|end| (end[1] - pivot[1]).abs() < 0.5)
    }

    /// A smooth curve through the nodes, as path data: Catmull and Rom's spline, as cubic Béziers.
    pub fn curve(&self, nodes: &[[f64; 2]]) -> String {
        let at = |index: usize| self.at(nodes[index.min(nodes.len() - 1)]);
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
}
