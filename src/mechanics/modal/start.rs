//! The state at t = 0.

use super::chain::Chain;
use super::tangent::Tangent;
use crate::mechanics::mechanism::{Input, NoEquilibrium, Weights};
use crate::scene;

/// Most Newton iterations for the static equilibrium.
const ITERATIONS: usize = 50;
/// Residual relative to the forces at work at which it is found.
const TOLERANCE: f64 = 1e-12;

/// Straight links moving as rigid bodies, at the angle and rate of the scene or of the prescribed motion; bent as static
/// equilibrium with the tangent at the pivot held asks, where the scene wants that.
pub(super) fn start<const W: usize>(
    scene: &scene::Chain,
    chain: &Chain<W>,
    input: &Input,
    q: &mut [f64],
    v: &mut [f64],
) -> Result<(), NoEquilibrium> {
    let [angle, rate, _] = input.motion.unwrap_or([scene.start.angle_rad, scene.start.rate_rad_per_s, 0.0]);
    for k in 0..q.len() {
        (q[k], v[k]) = if chain.is_angle[k] { (angle, rate) } else { (0.0, 0.0) };
    }
    if scene.start.static_equilibrium {
        let bent = bent::<W>(scene, angle)?;
        let own = q.len() - bent.len();
        q[own..].copy_from_slice(&bent);
        if let [chord] = &mut q[..own] {
            let root = &chain.links[0];
            let turns = root.shapes.root_slope.iter().zip(&bent).map(|(slope, eta)| slope / root.length_m * eta);
            *chord = angle - turns.sum::<f64>();
        }
    }
    Ok(())
}

/// Solves `r(q, 0, 0) = 0` with the tangent at the pivot held, which leaves the chain all coordinates but its first chord angle.
fn bent<const W: usize>(scene: &scene::Chain, angle: f64) -> Result<Vec<f64>, NoEquilibrium> {
    let mut chain = Chain::<W>::new(scene, true);
    let mut tangent = Tangent::new(&chain);
    let still = Input { motion: Some([angle, 0.0, 0.0]), ..Input::default() };
    let zero = vec![0.0; chain.degrees_of_freedom];
    let (mut q, mut r) = (zero.clone(), zero.clone());
    for _ in 0..ITERATIONS {
        chain.residual(&still, &q, &zero, &zero, &mut r);
        chain.add_pivot(&still, &mut r);
        if chain.residual_size(&r) < TOLERANCE {
            return Ok(q);
        }
        tangent.assemble(&mut chain, &zero, Weights { acceleration: 0.0, velocity: 0.0, position: 1.0 });
        tangent.factor().map_err(|_| NoEquilibrium)?;
        tangent.solve(&mut r);
        for (q, r) in q.iter_mut().zip(&r) {
            *q -= r;
        }
    }
    Err(NoEquilibrium)
}
