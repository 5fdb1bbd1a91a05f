//! Steps that begin with accelerations that a state was given, not with those that a step left.

use super::system::{State, System};

/// Accelerations whose residual is above this part of the forces at work, a time t later, are those of vibrations that it does not resolve:
/// of one mass on a spring, from `½ ω² t² = 0.15` on.
const OVERSHOT: f64 = 0.15;

/// Whether a state has accelerations that it was given, which α tells, and these move it so far in `h_s` that other forces result. `scratch`
/// has room for coordinates, velocities and a residual.
pub(super) fn overshoots<S: System>(system: &mut S, (t_s, h_s): (f64, f64), state: &State, scratch: [&mut [f64]; 3]) -> bool {
    if state.alpha != state.a || state.a.iter().all(|a| *a == 0.0) {
        return false;
    }
    let [q, v, residual] = scratch;
    for i in 0..q.len() {
        v[i] = state.v[i] + h_s * state.a[i];
        q[i] = state.q[i] + 0.5 * h_s * (state.v[i] + v[i]);
    }
    system.residual(t_s + h_s, q, v, &state.a, residual);
    let is_small = system.residual_size(residual) <= OVERSHOT;
    !is_small
}
