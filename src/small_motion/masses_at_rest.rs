//! Where the masses of an oscillator rest.

use nalgebra::{DMatrix, DVector};

use crate::scene::{Oscillator, Spring};

/// Forces on free masses that add up to this part of themselves are balanced.
const BALANCED: f64 = 1e-12;
/// Corrections of a solution by what it leaves.
const REFINEMENTS: u32 = 3;

/// The displacements at which springs balance forces, `K x = F`, m. Masses that no spring joins to ground, and whose forces balance, rest
/// anywhere: they are moved from their start as little as possible. `None` where forces move masses on and on.
pub(super) fn masses_at_rest(oscillator: &Oscillator) -> Option<Vec<f64>> {
    let mut at_rest_m = oscillator.start_m.clone();
    for masses in joined(oscillator) {
        let found_m = at_rest(oscillator, &masses)?;
        masses.iter().zip(found_m).for_each(|(mass, found_m)| at_rest_m[*mass] = found_m);
    }
    Some(at_rest_m)
}

/// The places of masses that springs join to one another, set by set.
fn joined(oscillator: &Oscillator) -> Vec<Vec<usize>> {
    let mut sets: Vec<Vec<usize>> = (0..oscillator.masses_kg.len()).map(|mass| vec![mass]).collect();
    for Spring { ends: [one, other], .. } in stiff(oscillator).filter(|spring| !is_to_ground(spring)) {
        let of = |sets: &[Vec<usize>], number: usize| sets.iter().position(|set| set.contains(&(number - 1)));
        let (Some(to), Some(from)) = (of(&sets, one), of(&sets, other)) else { continue };
        if to != from {
            let moved = std::mem::take(&mut sets[from]);
            sets[to].extend(moved);
        }
    }
    sets.retain(|set| !set.is_empty());
    sets
}

fn stiff(oscillator: &Oscillator) -> impl Iterator<Item = Spring> {
    oscillator.springs.iter().copied().filter(|spring| spring.stiffness_n_per_m > 0.0)
}

fn is_to_ground(spring: &Spring) -> bool {
    spring.ends.contains(&0)
}

/// The displacements of joined masses.
fn at_rest(oscillator: &Oscillator, masses: &[usize]) -> Option<Vec<f64>> {
    let place = |number: usize| masses.iter().position(|mass| mass + 1 == number);
    let mut stiffness = DMatrix::zeros(masses.len(), masses.len());
    let mut is_grounded = false;
    for Spring { ends, stiffness_n_per_m } in stiff(oscillator) {
        let [one, other] = ends.map(place);
        one.into_iter().chain(other).for_each(|end| stiffness[(end, end)] += stiffness_n_per_m);
        match (one, other) {
            (Some(one), Some(other)) => {
                stiffness[(one, other)] -= stiffness_n_per_m;
                stiffness[(other, one)] -= stiffness_n_per_m;
            }
            (None, None) => {}
            _ => is_grounded = true,
        }
    }
    let forces_n = DVector::from_iterator(masses.len(), masses.iter().map(|mass| oscillator.forces_n[*mass]));
    if is_grounded {
        return solved(&stiffness, &forces_n);
    }
    if forces_n.sum().abs() > BALANCED * forces_n.iter().map(|force_n| force_n.abs()).sum::<f64>() {
        return None;
    }
    // The first mass is held, and then all move to where they stay nearest to their start.
    let others = masses.len() - 1;
    let held = solved(&stiffness.view((1, 1), (others, others)).into_owned(), &forces_n.rows(1, others).into_owned())?;
    let beside_m: Vec<f64> = std::iter::once(0.0).chain(held).collect();
    let starts_m = masses.iter().map(|mass| oscillator.start_m[*mass]);
    let shift_m = starts_m.zip(&beside_m).map(|(start_m, beside_m)| start_m - beside_m).sum::<f64>() / masses.len() as f64;
    Some(beside_m.iter().map(|beside_m| beside_m + shift_m).collect())
}

/// `K⁻¹ F`.
fn solved(stiffness: &DMatrix<f64>, forces_n: &DVector<f64>) -> Option<Vec<f64>> {
    // A mass alone.
    if forces_n.is_empty() {
        return Some(Vec::new());
    }
    let factors = stiffness.clone().lu();
    let mut found_m = DVector::zeros(forces_n.len());
    for _ in 0..=REFINEMENTS {
        found_m += factors.solve(&(forces_n - stiffness * &found_m))?;
    }
    Some(found_m.iter().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::masses_at_rest;
    use crate::scene::{Oscillator, Spring};

    fn at_rest(springs: &[(usize, usize, f64)], forces_n: &[f64], start_m: &[f64]) -> Option<Vec<f64>> {
        let spring = |&(one, other, stiffness_n_per_m): &(usize, usize, f64)| Spring { ends: [one, other], stiffness_n_per_m };
        masses_at_rest(&Oscillator {
            masses_kg: vec![1.0; forces_n.len()],
            springs: springs.iter().map(spring).collect(),
            forces_n: forces_n.to_vec(),
            start_m: start_m.to_vec(),
        })
    }

    /// Springs of very unlike stiffness: a residual beside forces, or beside those at the start, told nothing.
    #[test]
    fn val_masses_rest_where_springs_balance_forces() {
        for (springs, forces_n, start_m, expected) in [
            (&[(1, 0, 1.0), (1, 2, 1e8)][..], &[0.0, 1.0][..], &[0.0, 0.0][..], Some(&[1.0, 1.0][..])),
            (&[(1, 2, 1e12), (1, 0, 1.0)], &[0.0, 0.0], &[1.0, 0.0], Some(&[0.0, 0.0])),
            (&[(1, 2, 1e9), (1, 0, 1.0)], &[0.0, 0.5], &[0.01, 0.0], Some(&[0.5, 0.5])),
            (&[(1, 0, 1e14), (2, 0, 1.0)], &[0.0, 1.0], &[0.0, 0.0], Some(&[0.0, 1.0])),
            (&[(2, 3, 100.0)], &[0.0, 1.0, -1.0], &[0.3, 0.0, 0.5], Some(&[0.3, 0.255, 0.245])),
            (&[], &[0.0], &[0.3], Some(&[0.3])),
            (&[], &[1.0], &[0.3], None),
            (&[(1, 2, 1e9)], &[0.0, 0.005], &[0.01, 0.0], None),
            (&[(1, 0, 1e12), (2, 3, 1.0)], &[0.0, 1.0, 0.0], &[1.0, 0.0, 0.0], None),
        ] {
            let found = at_rest(springs, forces_n, start_m);
            let is_right = match (&found, expected) {
                (Some(found), Some(expected)) => {
                    found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6)
                }
                (None, None) => true,
                _ => false,
            };
            assert!(is_right, "{springs:?}: {found:?} for {expected:?}");
        }
    }
}
