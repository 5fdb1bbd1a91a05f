//! Limits of the trials: corrections in a stage, and tolerances of a step.

/// Most corrections in a stage, and the number that stands for a converged iteration.
pub(super) const MOST_CORRECTIONS: usize = 20;
/// Largest tolerance of a scene.
pub(super) const LARGEST_TOLERANCE: f64 = 1e-2;
/// The most that a step of the trials may leave.
pub(super) const MOST_LEFT: f64 = 0.25 * LARGEST_TOLERANCE;
/// Smallest tolerance that is asked of a step of fixed cost.
pub(super) const SMALLEST_TOLERANCE: f64 = 1e-9;
