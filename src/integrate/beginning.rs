//! States to begin from, with accelerations that loads give and no step left.

use super::system::System;

/// Accelerations whose residual is above this part of the forces at work, half a step later, are those of vibrations that steps do not
/// resolve: of a mass on a spring that is let go, from `hω = 1.44` on. At 0.5, stiff chains still found other roots of their equations.
const OVERSHOT: f64 = 0.15;

/// Whether accelerations move a state `[q, v, a]` so far in `h_s` that other forces result. `scratch` has room for coordinates,
/// velocities and a residual.
pub(super) fn overshoots<S: System>(
    system: &mut S,
    (t_s, h_s): (f64, f64),
    [q, v, a]: [&[f64]; 3],
    scratch: [&mut [f64]; 3],
) -> bool {
    let [later_q, later_v, residual] = scratch;
    for i in 0..q.len() {
        later_v[i] = v[i] + h_s * a[i];
        later_q[i] = q[i] + 0.5 * h_s * (v[i] + later_v[i]);
    }
    system.residual(t_s + h_s, later_q, later_v, a, residual);
    let is_small = system.residual_size(residual) <= OVERSHOT;
    !is_small
}
