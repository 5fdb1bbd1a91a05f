//! Modes over a sweep: each one followed by its shape, its crossings with others told.

use super::mode::{Kind, Mode};
use super::shape::likeness;

/// Least likeness of two shapes that are one mode.
const ALIKE: f64 = 0.2;

/// One mode along a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// Its name where it is first seen.
    pub name: String,
    /// Its place among the modes of each point; `None` where it was not found.
    pub places: Vec<Option<usize>>,
}

/// Two branches whose frequencies change order between two points that follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crossing {
    /// The branches: the one that is lower before, and the other.
    pub branches: [usize; 2],
    /// The number of the point after which they cross.
    pub after: usize,
}

/// Follows every mode along the points of a sweep, by the likeness of shapes; at most `count` branches, lowest first. A point without
/// modes interrupts them.
pub fn follow(points: &[Vec<Mode>], count: usize) -> Vec<Branch> {
    let mut branches: Vec<Branch> = Vec::new();
    for (number, modes) in points.iter().enumerate() {
        let taken = matches(points, &branches, modes);
        for (branch, place) in branches.iter_mut().zip(&taken) {
            branch.places.push(*place);
        }
        for (place, mode) in modes.iter().enumerate().filter(|(place, _)| !taken.contains(&Some(*place))) {
            let mut places = vec![None; number];
            places.push(Some(place));
            let taken = branches.iter().any(|branch| branch.name == mode.name());
            let name = if taken { format!("{} (again)", mode.name()) } else { mode.name() };
            branches.push(Branch { name, places });
        }
    }
    // Those that are seen at most points, and of these the lowest.
    let seen = |branch: &Branch| branch.places.iter().flatten().count();
    let most = branches.iter().map(seen).max().unwrap_or(0);
    branches.retain(|branch| 2 * seen(branch) > most);
    let mean = |branch: &Branch| {
        let sum: f64 =
            branch.places.iter().zip(points).filter_map(|(place, modes)| Some(modes[(*place)?].eigenvalue.norm())).sum();
        sum / seen(branch) as f64
    };
    branches.sort_by(|one, other| mean(one).total_cmp(&mean(other)));
    branches.truncate(count);
    branches
}

/// The place among `modes` of every branch: pairs in the order of their likeness, each mode taken once.
fn matches(points: &[Vec<Mode>], branches: &[Branch], modes: &[Mode]) -> Vec<Option<usize>> {
    let last = |branch: &Branch| {
        let at = branch.places.iter().zip(points).rev().find_map(|(place, modes)| Some(&modes[(*place)?]));
        at.map(|mode| (mode, mode.kind == Kind::Masses))
    };
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (b, branch) in branches.iter().enumerate() {
        let Some((before, masses)) = last(branch) else { continue };
        for (place, mode) in modes.iter().enumerate() {
            let alike =
                if masses { f64::from(u8::from(before.number == mode.number)) } else { likeness(&before.links, &mode.links) };
            pairs.push((alike, b, place));
        }
    }
    pairs.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut taken = vec![None; branches.len()];
    for (alike, b, place) in pairs {
        if alike >= ALIKE && taken[b].is_none() && !taken.contains(&Some(place)) {
            taken[b] = Some(place);
        }
    }
    taken
}

/// Where branches cross.
pub fn crossings(points: &[Vec<Mode>], branches: &[Branch]) -> Vec<Crossing> {
    let frequency = |branch: &Branch, point: usize| Some(points[point][(*branch.places.get(point)?)?].eigenvalue.im);
    let mut found = Vec::new();
    for (i, one) in branches.iter().enumerate() {
        for (j, other) in branches.iter().enumerate().skip(i + 1) {
            for after in 0..points.len().saturating_sub(1) {
                let difference = |point: usize| Some(frequency(one, point)? - frequency(other, point)?);
                let (Some(before), Some(then)) = (difference(after), difference(after + 1)) else { continue };
                if before * then < 0.0 {
                    found.push(Crossing { branches: if before < 0.0 { [i, j] } else { [j, i] }, after });
                }
            }
        }
    }
    found.sort_by_key(|crossing| crossing.after);
    found
}
