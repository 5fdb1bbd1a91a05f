//! How a step is taken: from edge to edge of the loads, and in halves where it fails.

use super::Simulation;
use super::load::SHORTEST_PART;
use crate::integrate::{StepError, Taken};

/// A step that fails is halved this many times before the simulation gives up.
const HALVINGS: u32 = 4;
/// Most parts into which the edges of pulses cut a step: a flood of pulses must not make steps late.
const MOST_PARTS: usize = 5;

impl Simulation {
    /// The first time between the two at which a torque begins or ends, or a prescribed acceleration jumps, s.
    pub(super) fn edge_within(&self, [from_s, to_s]: [f64; 2]) -> Option<f64> {
        let edges = [self.load.edge_within(from_s, to_s), self.law.edge_within(from_s, to_s)];
        edges.into_iter().flatten().min_by(f64::total_cmp)
    }

    /// Takes one step. Where the integrator follows a load within the step, it does so from one edge of a load to the next: one that
    /// begins or ends inside a step would cost it its order.
    pub(super) fn advance_from_edge_to_edge(&mut self, mut from_s: f64, to_s: f64) -> Result<Taken, StepError> {
        let (mut taken, mut h_s) = (Taken::default(), self.grid.step_s);
        let margin_s = SHORTEST_PART * self.grid.step_s;
        for _ in 1..if self.load.cuts_steps { MOST_PARTS } else { 1 } {
            let between_s = [from_s + margin_s, to_s - margin_s];
            let Some(edge_s) = self.edge_within(between_s) else { break };
            taken += self.advance([from_s, edge_s], edge_s - from_s, 0)?;
            (from_s, h_s) = (edge_s, to_s - edge_s);
        }
        taken += self.advance([from_s, to_s], h_s, 0)?;
        Ok(taken)
    }

    /// Goes on by `h_s`; a step that fails is tried in halves, those in halves again, and so on, [`HALVINGS`] deep. Both ends are given:
    /// `from_s + h_s` may round beyond the next step's beginning, and so into a pulse that begins there.
    fn advance(&mut self, [from_s, to_s]: [f64; 2], h_s: f64, depth: u32) -> Result<Taken, StepError> {
        self.law.during(self.load.during(from_s, to_s, h_s), [from_s, to_s]);
        let failed = match self.engine.step(&self.law, from_s, h_s) {
            Err(failed) if depth < self.halvings() => failed,
            taken => {
                self.add_error(to_s, h_s);
                return taken;
            }
        };
        self.retried += 1;
        let half_s = 0.5 * h_s;
        let middle_s = from_s + half_s;
        let mut taken = self.advance([from_s, middle_s], half_s, depth + 1).map_err(|_| failed)?;
        taken += self.advance([middle_s, to_s], half_s, depth + 1).map_err(|_| failed)?;
        Ok(taken)
    }

    /// Adds the error of the part of a step of `h_s` that ended at `to_s` to the estimate.
    fn add_error(&mut self, to_s: f64, h_s: f64) {
        let Some(error) = &mut self.error else { return };
        let Some(terms) = self.engine.local_error(&self.law, to_s, h_s) else { return };
        let links = self.engine.rotations();
        if let Some(links) = links.filter(|links| !error.carried.stands(h_s, *links))
            && let Some(carried) = self.engine.carried_turn(&self.law, to_s, h_s, links)
        {
            error.carried = carried;
        }
        error.add(h_s, &terms, links.is_some());
    }

    /// How deep a step that fails is halved: a step of fixed cost is not tried again.
    fn halvings(&self) -> u32 {
        if self.solver.corrections.is_some() { 0 } else { HALVINGS }
    }
}
