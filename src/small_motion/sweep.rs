//! Modes over a sweep: each one followed by its shape, its crossings with others told.

use super::mode::{Kind, Mode};
use super::shape::likeness;

/// Least likeness of two shapes that are one mode.
const ALIKE: f64 = 0.2;
/// Least likeness of two shapes that are one mode beyond doubt.
const SURELY_ALIKE: f64 = 0.8;
/// Part of its likeness that the shape of what does not vibrate loses at most to another rate of the same sign: less than would be doubt.
const OTHER_RATE: f64 = 0.15;

/// One mode along a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// Its name where it is first seen.
    pub name: String,
    /// Its kind there.
    pub kind: Kind,
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

/// A branch that is a mode of another kind at some points than at its first.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherKind {
    /// The number of the branch.
    pub branch: usize,
    /// The mode's name and share where that share is largest.
    pub title: String,
    /// The first and the last of every row of such points.
    pub runs: Vec<[usize; 2]>,
}

/// Follows every mode along the points of a sweep, by the likeness of shapes, the lowest first. A point without
/// modes interrupts them.
pub fn follow(points: &[Vec<Mode>]) -> Vec<Branch> {
    let mut branches: Vec<Branch> = Vec::new();
    for (number, modes) in points.iter().enumerate() {
        let newest = |branch: &Branch| branch.places.iter().zip(points).rev().find_map(|(place, modes)| modes.get((*place)?));
        let newest: Vec<Option<&Mode>> = branches.iter().map(newest).collect();
        let taken: Vec<Option<usize>> = matches(&newest, modes).into_iter().map(|found| found.map(|(place, _)| place)).collect();
        for (branch, place) in branches.iter_mut().zip(&taken) {
            branch.places.push(*place);
        }
        for (place, mode) in modes.iter().enumerate().filter(|(place, _)| !taken.contains(&Some(*place))) {
            let mut places = vec![None; number];
            places.push(Some(place));
            let taken = branches.iter().any(|branch| branch.name == mode.name());
            let name = if taken { format!("{} (again)", mode.name()) } else { mode.name() };
            branches.push(Branch { name, kind: mode.kind, places });
        }
    }
    // Those that are seen at most points, and whatever only grows or decays, or grows at all; of these the lowest. A mechanism that
    // stands on end may grow on a short part of a sweep.
    let seen = |branch: &Branch| branch.places.iter().flatten().count();
    let most = branches.iter().map(seen).max().unwrap_or(0);
    let modes_of = |branch: &Branch| -> Vec<&Mode> {
        branch.places.iter().zip(points).filter_map(|(place, modes)| modes.get((*place)?)).collect()
    };
    let falls = |branch: &Branch| {
        modes_of(branch).into_iter().any(|mode| mode.grows() || mode.eigenvalue.im == 0.0 && mode.eigenvalue.re != 0.0)
    };
    branches.retain(|branch| 2 * seen(branch) > most || falls(branch));
    let mean = |branch: &Branch| {
        let sum: f64 = modes_of(branch).into_iter().map(|mode| mode.eigenvalue.norm()).sum();
        sum / seen(branch) as f64
    };
    branches.sort_by(|one, other| mean(one).total_cmp(&mean(other)));
    branches
}

/// Whether one of the `count` lowest modes is not found beyond doubt among those of the next point: a point between them would help.
pub fn is_uncertain(before: &[Mode], after: &[Mode], count: usize) -> bool {
    let known: Vec<Option<&Mode>> = before.iter().map(Some).collect();
    let found = matches(&known, after);
    let lost = |found: &Option<(usize, f64)>| found.is_none_or(|(_, alike)| alike < SURELY_ALIKE);
    !before.is_empty() && !after.is_empty() && found.iter().take(count).any(lost)
}

/// The part of the likeness of two shapes that is left by their rates, if neither vibrates: what falls away from rest, or turns freely
/// under a damper, has one shape in both of its motions.
fn alike_in_rate(one: &Mode, other: &Mode) -> f64 {
    let [one, other] = [one, other].map(|mode| mode.eigenvalue);
    match (one.im == 0.0 && other.im == 0.0, one.re * other.re < 0.0) {
        (false, _) => 1.0,
        (true, true) => 0.5,
        (true, false) if one.re == other.re => 1.0,
        (true, false) => 1.0 - OTHER_RATE * (one.re - other.re).abs() / one.re.abs().max(other.re.abs()),
    }
}

/// Place and likeness among `modes` of each that is known: pairs in the order of their likeness, each mode taken once.
fn matches(known: &[Option<&Mode>], modes: &[Mode]) -> Vec<Option<(usize, f64)>> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (k, before) in known.iter().enumerate().filter_map(|(k, before)| Some((k, (*before)?))) {
        for (place, mode) in modes.iter().enumerate() {
            let alike = match before.kind {
                Kind::Masses => f64::from(u8::from(before.number == mode.number)),
                _ => alike_in_rate(before, mode) * likeness(&before.links, &mode.links),
            };
            pairs.push((alike, k, place));
        }
    }
    pairs.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut taken: Vec<Option<(usize, f64)>> = vec![None; known.len()];
    for (alike, k, place) in pairs {
        let is_free = !taken.iter().flatten().any(|(other, _)| *other == place);
        if alike >= ALIKE && taken[k].is_none() && is_free {
            taken[k] = Some((place, alike));
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

/// Where branches are modes of other kinds than at their first points: one entry for each branch and kind.
pub fn other_kinds(points: &[Vec<Mode>], branches: &[Branch]) -> Vec<OtherKind> {
    let share = |mode: &Mode| mode.shares.first().map_or(0.0, |share| share.share);
    let mut found = Vec::new();
    for (number, branch) in branches.iter().enumerate() {
        // Of each kind the mode with the largest share, and the points.
        let mut kinds: Vec<(&Mode, Vec<[usize; 2]>)> = Vec::new();
        for (point, (place, modes)) in branch.places.iter().zip(points).enumerate() {
            let mode = place.and_then(|place| modes.get(place));
            let Some(mode) = mode.filter(|mode| mode.kind != branch.kind) else { continue };
            let Some((clearest, runs)) = kinds.iter_mut().find(|(other, _)| other.kind == mode.kind) else {
                kinds.push((mode, vec![[point; 2]]));
                continue;
            };
            if share(mode) > share(clearest) {
                *clearest = mode;
            }
            match runs.last_mut() {
                Some(run) if run[1] + 1 == point => run[1] = point,
                _ => runs.push([point; 2]),
            }
        }
        let other = |(mode, runs): (&Mode, Vec<[usize; 2]>)| OtherKind { branch: number, title: mode.title(), runs };
        found.extend(kinds.into_iter().map(other));
    }
    found
}

#[cfg(test)]
mod tests {
    use nalgebra::{Complex, DVector};

    use super::super::{Part, Share};
    use super::*;
    use crate::scene::LinkName;

    fn mode(part: Part, share: f64) -> Mode {
        Mode {
            kind: Kind::Vibration(part),
            number: 1,
            eigenvalue: Complex::new(0.0, 1.0),
            shape: DVector::zeros(0),
            shares: vec![Share { part, share }],
            rigid_part: 0.0,
            links: Vec::new(),
            rounding: 0.0,
        }
    }

    #[test]
    fn prop_a_branch_that_is_another_kind_only_between_is_told() {
        let [bends, stretches] = [Part::Bending(LinkName::Crank), Part::Stretching(LinkName::Rod)];
        let along = [(stretches, 0.6), (bends, 0.7), (bends, 0.99), (stretches, 0.6), (bends, 0.8), (stretches, 0.6)];
        let points: Vec<Vec<Mode>> = along.iter().map(|(part, share)| vec![mode(*part, *share)]).collect();
        let branch = Branch { name: "rod stretching 1".to_owned(), kind: Kind::Vibration(stretches), places: vec![Some(0); 6] };
        let told = OtherKind { branch: 0, title: "crank bending 1 (99 %)".to_owned(), runs: vec![[1, 2], [4, 4]] };
        assert_eq!(other_kinds(&points, std::slice::from_ref(&branch)), [told]);
        assert!(other_kinds(&points[..1], &[branch]).is_empty());
    }
}
