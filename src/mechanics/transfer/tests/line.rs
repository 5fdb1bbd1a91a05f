//! The models as lines in motion agree with their own equations.

use super::Kind::{Elements, Modal as Modes, Rigid};
use super::pairs::of;
use super::*;
use crate::mechanics::Weights;

const KINDS: [Kind; 6] = [Rigid, Modes(1), Modes(3), Elements(1), Elements(2), Elements(5)];
const SCENES: [(&str, &[&str]); 8] = [
    ("crank-slider", &[]),
    ("crank-slider", &["crank.rigid=true"]),
    ("crank-slider", &["rod.rigid=true"]),
    ("crank-slider", &["crank.rigid=true", "rod.rigid=true"]),
    ("crank-slider", &["pulse=[]", "drive.speed_rad_per_s=8"]),
    ("ref-r5", &["beam.second_moment_m4=1e-7", "beam.area_m2=1e-3", "pulse.0.torque_nm=40"]),
    ("two free links", &[]),
    ("lumped rod", &[]),
];

fn places(links: usize) -> Vec<Place> {
    (0..links).flat_map(|link| [0.0, 0.3, 0.5, 0.77, 1.0].map(|xi| Place { link, xi })).collect()
}

/// Every model of every scene, in motion.
fn each(mut check: impl FnMut(&str, &mut Moving)) -> Tested {
    for (name, overrides) in SCENES {
        for kind in KINDS {
            let mut moving = Moving::after(60, &of(name, overrides)?, kind)?;
            check(&format!("{name} {overrides:?} {kind:?}"), &mut moving);
        }
    }
    Ok(())
}

/// Central differences of the places by each coordinate.
#[test]
fn val_pulled_back_vectors_are_derivatives_of_the_places() -> Tested {
    each(|case, moving| {
        let (places, n) = (places(moving.chain.links.len()), moving.q.len());
        let vectors: Vec<[f64; 2]> = (0..places.len()).map(|k| [(3 * k + 1) as f64, 4.0 - k as f64]).collect();
        let (input, q) = (moving.input, moving.q.clone());
        let mut pulled = vec![0.0; n];
        moving.line().pull_back(&input, &q, &places, &vectors, &mut pulled);
        let scale = pulled.iter().fold(1.0, |most: f64, p| most.max(p.abs()));
        for (j, pulled) in pulled.iter().enumerate() {
            let mut work = |step: f64| -> f64 {
                moving.q.copy_from_slice(&q);
                moving.q[j] += step;
                let points = moving.points(&places);
                points.iter().zip(&vectors).map(|(point, f)| dot(&point.position_m, f)).sum()
            };
            let difference = (work(1e-5) - work(-1e-5)) / 2e-5;
            assert!((difference - pulled).abs() < 1e-7 * scale, "{case} {j}: {pulled} for {difference}");
        }
        moving.q.copy_from_slice(&q);
    })
}

/// Kinetic energy is of second degree in the velocities: central differences are exact.
#[test]
fn val_momenta_are_derivatives_of_kinetic_energy() -> Tested {
    each(|case, moving| {
        let (n, v) = (moving.q.len(), moving.v.clone());
        let (input, q) = (moving.input, moving.q.clone());
        let mut momentum = vec![0.0; n];
        moving.line().momentum(&input, &q, &v, &mut momentum);
        let kinetic = moving.energies()[0];
        for (j, p) in momentum.iter().enumerate() {
            let step = 0.1;
            let mut at = |by: f64| {
                moving.v.copy_from_slice(&v);
                moving.v[j] += by;
                moving.energies()[0]
            };
            let difference = (at(step) - at(-step)) / (2.0 * step);
            assert!((difference - p).abs() < 1e-12 * (kinetic + p.abs()), "{case} {j}: {p} for {difference}");
        }
        moving.v.copy_from_slice(&v);
    })
}

/// The momentum is `M v` with the mass matrix of the tangent, unless motion is prescribed.
#[test]
fn val_momenta_are_those_of_the_mass_matrix() -> Tested {
    each(|case, moving| {
        let (input, q, v) = (moving.input, moving.q.clone(), moving.v.clone());
        if input.motion.is_some() {
            return;
        }
        let (mut momentum, mut product) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        moving.line().momentum(&input, &q, &v, &mut momentum);
        let mass = Weights { acceleration: 1.0, velocity: 0.0, position: 0.0 };
        moving.mechanism.tangent(&input, &q, &v, &v, mass, &mut |i, j, entry| product[i] += entry * v[j]);
        for (p, product) in momentum.iter().zip(&product) {
            assert!((p - product).abs() < 1e-12 * (1.0 + p.abs()), "{case}: {p} for {product}");
        }
    })
}

/// The part of a turn is `M c/(c·M c)`, from positions alone, and the next factorization and residual are what they were.
#[test]
fn val_the_part_of_a_turn_is_its_momentum_over_its_inertia() -> Tested {
    each(|case, moving| {
        let (input, q, v) = (moving.input, moving.q.clone(), moving.v.clone());
        let (mut turn, mut momentum, mut part) = (vec![0.0; q.len()], vec![0.0; q.len()], vec![0.0; q.len()]);
        let weights = Weights { acceleration: 1.0, velocity: 3.0, position: 5.0 };
        let all = |mechanism: &mut dyn Mechanism| {
            let mut found = vec![0.0; q.len()];
            mechanism.residual(&input, &q, &v, &v, &mut found);
            mechanism.tangent(&input, &q, &v, &v, weights, &mut |_, _, entry| found.push(entry));
            found
        };
        let before = all(&mut *moving.mechanism);
        for link in 0..2 {
            let found = moving.mechanism.turn_part(&input, &q, &v, &v, link, &mut part);
            assert!(before == all(&mut *moving.mechanism), "{case}");
            assert_eq!(found, moving.line().turn(&input, &q, link, &mut turn), "{case}");
            if found {
                moving.line().momentum(&input, &q, &turn, &mut momentum);
                let inertia: f64 = turn.iter().zip(&momentum).map(|(c, p)| c * p).sum();
                for (part, p) in part.iter().zip(&momentum) {
                    assert!((part - p / inertia).abs() < 1e-12 * (1.0 + part.abs()), "{case}: {part} for {}", p / inertia);
                }
            }
        }
    })
}

/// In a turn of link i its points move as those of a rigid body that turns by 1 rad/s, and a free link's neighbours do not turn.
#[test]
fn val_a_turn_strains_no_link() -> Tested {
    each(|case, moving| {
        let (input, q, links) = (moving.input, moving.q.clone(), moving.chain.links.len());
        let still = Input { motion: input.motion.map(|[angle, ..]| [angle, 0.0, 0.0]), ..input };
        for turned in 0..2 {
            let mut v = vec![0.0; q.len()];
            let swings = links == 2 && matches!(moving.chain.end, End::Free { .. });
            let free = if turned == 0 { input.motion.is_none() } else { swings };
            assert_eq!(moving.line().turn(&still, &q, turned, &mut v), free, "{case} {turned}");
            if !free {
                continue;
            }
            moving.v.copy_from_slice(&v);
            let points = moving.points(&places(links));
            for (link, points) in points.chunks_exact(5).enumerate() {
                let by =
                    |k: usize, of: fn(&PlacePoint) -> [f64; 2]| [0, 1].map(|axis| of(&points[k])[axis] - of(&points[0])[axis]);
                let rate = |k: usize| {
                    let (r, u) = (by(k, |point| point.position_m), by(k, |point| point.velocity_m_per_s));
                    assert!(dot(&r, &u).abs() < 1e-13, "{case} {link} {k}");
                    (r[0] * u[1] - r[1] * u[0]) / dot(&r, &r)
                };
                assert!((1..5).all(|k| (rate(k) - rate(4)).abs() < 1e-12), "{case} {link}");
                if link == turned || swings {
                    let expected = if link == turned { 1.0 } else { 0.0 };
                    assert!((rate(4) - expected).abs() < 1e-12, "{case} {link}");
                }
            }
        }
    })
}
