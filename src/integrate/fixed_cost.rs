//! Steps of fixed cost: the same number of residuals, corrections and factorizations in every step.

/// The corrections of a step of fixed cost.
///
/// **Cost of a step to the tolerance.** A step costs its parts, times the stages of a part, times the corrections of a stage, with a
/// factorization for each part and for each stage whose residual falls slowly. Four things make one step dearer than the next:
///
/// | | a step can take | a step of fixed cost |
/// |---|---|---|
/// | corrections | 1 to `max_iterations` in a stage | exactly N |
/// | factorizations | 1 for each correction | 1, at the first prediction |
/// | parts | 5, cut at the edges of pulses | 1: a load with an edge inside is spread over the step |
/// | a jump of the load (ESDIRK) | 8 stages, 2 factorizations | 3 stages of SDIRK3 with the same 5 N corrections |
/// | a step that fails | 31 attempts, in halves | none: it is divergence |
///
/// So the impulse of every pulse stays exact. An edge inside a step moves positions by at most `Δp h²/8M`: second order.
///
/// **Error.** Newton's iteration with one matrix converges linearly, by a factor that falls with the step. The residual that the last
/// correction of a step leaves is evaluated, at constant cost, and reported as a part of the forces at work. The owner compares it
/// with what the scene was rated for. A step that leaves more than [`FixedCost::LOST`] solves nothing, and fails.
///
/// **Jumps.** SDIRK3 over the whole step is of third order. Steps with jumps are few unless a controller changes the torque at
/// every one of them: then the motion is of third order. With an eighth by SDIRK3 and the rest by ESDIRK, eight stages and two matrices,
/// 3 corrections a stage diverged on finite elements at 1 ms (default scene, 20 N·m); three stages over the whole step did not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FixedCost {
    /// Newton corrections in each stage of a step.
    pub corrections: usize,
}

impl FixedCost {
    /// A residual above this part of the forces at work, after the last correction, is divergence.
    pub const LOST: f64 = 0.5;

    /// Corrections of one of `stages` stages, at least 1, where all of them share those of `of` stages.
    pub(super) fn shared(self, stage: usize, stages: usize, of: usize) -> Self {
        let all = self.corrections * of;
        FixedCost { corrections: (all / stages + usize::from(stage < all % stages)).max(1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_three_stages_share_the_corrections_of_five() {
        for corrections in 1..=20 {
            let fixed = FixedCost { corrections };
            let shares = [0, 1, 2].map(|stage| fixed.shared(stage, 3, 5).corrections);
            assert_eq!(shares.iter().sum::<usize>(), 5 * corrections);
            assert!(shares[0] >= shares[1] && shares[1] >= shares[2] && shares[2] >= 1, "{shares:?}");
        }
    }
}
