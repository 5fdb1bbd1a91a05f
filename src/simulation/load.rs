//! The torque on the pivot: constant torque and pulses of the scene, pulses and setpoints commanded from outside, and the impulse
//! they deliver.

use super::build;
use super::drive::Torque;
use super::error::PulseRefused;
use super::pulses::Pulses;
use super::setpoint::{HeldTorque, LONGEST_HOLD_S, SHORTEST_HOLD_S, SetpointRequest, SetpointState};
use crate::scene::{Commands, Drive, Pulse, PulseShape, Scene};

/// Longest duration and longest delay of a commanded pulse, s.
const HOUR_S: f64 = 3600.0;

/// A commanded pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulseRequest {
    /// Mean torque, N·m.
    pub torque_nm: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Simulated time from now to its start, s.
    pub delay_s: f64,
    /// Shape.
    pub shape: PulseShape,
}

impl PulseRequest {
    /// Refuses numbers that no scene accepts.
    ///
    /// # Errors
    /// [`PulseRefused`] with the number.
    pub fn check(&self) -> Result<(), PulseRefused> {
        let PulseRequest { torque_nm, duration_s, delay_s, .. } = *self;
        if ![torque_nm, duration_s, delay_s].iter().all(|number| number.is_finite()) {
            return Err(PulseRefused::NotFinite);
        }
        if !(duration_s > 0.0 && duration_s <= HOUR_S) {
            return Err(PulseRefused::Duration(duration_s));
        }
        if !(0.0..=HOUR_S).contains(&delay_s) { Err(PulseRefused::Delay(delay_s)) } else { Ok(()) }
    }
}

/// A part of a step is no shorter than this part of it.
pub(super) const SHORTEST_PART: f64 = 1e-6;
/// Largest rounding error of the time of a step, of a start, or of a start plus a duration, over that time.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The largest distance of an edge that counts as at `time_s`, s.
pub(super) fn margin_s(time_s: f64, step_s: f64) -> f64 {
    (SHORTEST_PART * step_s).max(ROUNDING * time_s)
}

/// Angular impulse delivered since the mean torque was last taken.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DeliveredImpulse {
    /// N·m·s.
    pub impulse_nm_s: f64,
    /// Simulated time over which it was delivered, s.
    pub over_s: f64,
}

impl DeliveredImpulse {
    /// Mean torque, N·m; `None` if no time has passed.
    pub(crate) fn mean_nm(self) -> Option<f64> {
        (self.over_s > 0.0).then(|| self.impulse_nm_s / self.over_s)
    }
}

/// The torque of a scene, with all pulses that wait or act.
pub(super) struct Load {
    constant_nm: f64,
    own_pulses: Vec<Pulse>,
    limits: Commands,
    /// Why torque has no effect on this scene, if it has none.
    refuses_torque: Option<PulseRefused>,
    pub pulses: Pulses,
    pub setpoint: SetpointState,
    pub delivered: DeliveredImpulse,
    /// Impulse since the last mark, which no sample ends.
    marked: DeliveredImpulse,
    /// Whether the integrator weighs its stages evenly about the step's middle, so that the torque may rise over the step.
    pub uses_torque_slope: bool,
    /// Whether a step ends at the edge of a torque. Otherwise a torque with an edge inside a step is spread over it.
    pub cuts_steps: bool,
}

impl Load {
    /// The load of a scene, without a pulse yet.
    pub(super) fn new(scene: &Scene) -> Self {
        let (constant_nm, own_pulses) = match &scene.drive {
            Drive::Torque { constant_nm, pulses } => (*constant_nm, pulses.clone()),
            Drive::Motion(_) => (0.0, Vec::new()),
        };
        Load {
            constant_nm,
            pulses: Pulses::with_capacity(scene.commands.pending_limit + own_pulses.len()),
            own_pulses,
            setpoint: SetpointState::default(),
            limits: scene.commands,
            refuses_torque: build::refuses_torque(scene),
            delivered: DeliveredImpulse::default(),
            marked: DeliveredImpulse::default(),
            uses_torque_slope: scene.solver.integrator.order() == 4,
            cuts_steps: scene.solver.integrator.order() == 4 && scene.solver.corrections.is_none(),
        }
    }

    /// Goes on with the pulses and the setpoint that wait or act in `before`, and the impulse it delivered.
    pub(super) fn go_on_from(&mut self, before: &Load) {
        self.pulses.clear();
        before.pulses.iter().for_each(|pulse| self.pulses.push(*pulse));
        (self.setpoint, self.delivered, self.marked) = (before.setpoint, before.delivered, before.marked);
    }

    /// Returns to the scene's own pulses.
    pub(super) fn reset(&mut self) {
        self.replace_pulses(&self.own_pulses.clone());
        self.setpoint = SetpointState::default();
        self.delivered = DeliveredImpulse::default();
    }

    /// Replaces all pulses that wait or act.
    pub(super) fn replace_pulses(&mut self, pulses: &[Pulse]) {
        self.pulses.clear();
        pulses.iter().for_each(|pulse| self.pulses.push(*pulse));
    }

    /// Adds a commanded pulse at `now_s` and returns its start, s.
    pub(super) fn add(&mut self, request: &PulseRequest, now_s: f64) -> Result<f64, PulseRefused> {
        let PulseRequest { torque_nm, duration_s, delay_s, shape } = *request;
        request.check()?;
        self.check_acts()?;
        self.check_limit(torque_nm)?;
        if self.pulses.len() >= self.limits.pending_limit {
            return Err(PulseRefused::Pending(self.limits.pending_limit));
        }
        let start_s = now_s + delay_s;
        self.pulses.push(Pulse { start_s, torque_nm, duration_s, shape });
        Ok(start_s)
    }

    /// Applies a commanded setpoint at `now_s`.
    pub(super) fn set(&mut self, request: &SetpointRequest, now_s: f64) -> Result<(), PulseRefused> {
        let SetpointRequest { torque_nm, hold_s } = *request;
        if hold_s.is_finite() && !(SHORTEST_HOLD_S..=LONGEST_HOLD_S).contains(&hold_s) {
            return Err(PulseRefused::Hold(hold_s));
        }
        self.hold(HeldTorque { start_s: now_s, torque_nm, hold_s, watched: torque_nm != 0.0 })
    }

    /// Replaces the setpoint in force.
    pub(super) fn hold(&mut self, held: HeldTorque) -> Result<(), PulseRefused> {
        if !(held.torque_nm.is_finite() && held.hold_s.is_finite()) {
            return Err(PulseRefused::SetpointNotFinite);
        }
        self.check_acts()?;
        self.check_limit(held.torque_nm)?;
        self.setpoint.replace(held);
        Ok(())
    }

    /// Checks that torque has an effect on this scene.
    fn check_acts(&self) -> Result<(), PulseRefused> {
        self.refuses_torque.clone().map_or(Ok(()), Err)
    }

    fn check_limit(&self, torque_nm: f64) -> Result<(), PulseRefused> {
        let limit_nm = self.limits.torque_limit_nm;
        if torque_nm.abs() > limit_nm { Err(PulseRefused::Torque { torque_nm, limit_nm }) } else { Ok(()) }
    }

    /// Mean torque over `[from_s, to_s]`, N·m.
    fn mean_nm(&self, from_s: f64, to_s: f64) -> f64 {
        let mean_nm = self.constant_nm + self.pulses.mean_nm(from_s, to_s);
        self.setpoint.mean_nm(from_s, to_s).map_or(mean_nm, |setpoint_nm| mean_nm + setpoint_nm)
    }

    /// Rise of the torque over `[from_s, to_s]`, N·m/s.
    fn rise_nm_per_s(&self, from_s: f64, to_s: f64) -> f64 {
        if !self.uses_torque_slope {
            return 0.0;
        }
        // Torque times travel is the work of a step whose torque has no slope: from rest, a slope could take most of it away.
        let margin_s = SHORTEST_PART * (to_s - from_s);
        let spread = !self.cuts_steps && self.edge_within(from_s + margin_s, to_s - margin_s).is_some();
        if spread { 0.0 } else { self.pulses.rise_nm_per_s(from_s, to_s) }
    }

    /// The first time between the two at which a pulse begins or ends, or the setpoint ends, s.
    pub(super) fn edge_within(&self, from_s: f64, to_s: f64) -> Option<f64> {
        let edges = [self.pulses.edge_within(from_s, to_s), self.setpoint.edge_within(from_s, to_s)];
        edges.into_iter().flatten().min_by(f64::total_cmp)
    }

    /// The torque during a step of `h_s` from `from_s` to `to_s`.
    #[inline]
    pub(super) fn during(&self, from_s: f64, to_s: f64, h_s: f64) -> Torque {
        Torque {
            mean_nm: self.mean_nm(from_s, to_s),
            rise_nm_per_s: self.rise_nm_per_s(from_s, to_s),
            middle_s: from_s + 0.5 * h_s,
            over_s: [from_s, to_s],
        }
    }

    /// The torque just before `time_s`, between steps of `step_s`: that of a sample.
    ///
    /// An edge that rounding alone keeps from `time_s`, or less than [`SHORTEST_PART`] of a step, is at `time_s`.
    #[inline]
    pub(super) fn before(&self, time_s: f64, step_s: f64) -> Torque {
        self.at(time_s, time_s - margin_s(time_s, step_s))
    }

    /// The torque just after `time_s`, between steps of `step_s`: that of a scene that begins there. Edges as for [`Load::before`].
    pub(super) fn after(&self, time_s: f64, step_s: f64) -> Torque {
        self.at(time_s, time_s + margin_s(time_s, step_s))
    }

    fn at(&self, time_s: f64, side_s: f64) -> Torque {
        let torque_nm = self.constant_nm + self.pulses.value_nm(time_s, side_s);
        Torque::constant(self.setpoint.value_nm(side_s).map_or(torque_nm, |setpoint_nm| torque_nm + setpoint_nm))
    }

    /// Adds the impulse of a step of `h_s` in which `torque` acted last, and drops the pulses and the setpoint that are over.
    pub(super) fn deliver(&mut self, torque: &Torque, from_s: f64, to_s: f64, h_s: f64) {
        // A step may have been taken in parts.
        let mean_nm = if torque.over_s == [from_s, to_s] { torque.mean_nm } else { self.mean_nm(from_s, to_s) };
        let impulse_nm_s = mean_nm * h_s;
        for delivered in [&mut self.delivered, &mut self.marked] {
            delivered.impulse_nm_s += impulse_nm_s;
            delivered.over_s += h_s;
        }
        self.pulses.retire(to_s);
        self.setpoint.retire(to_s);
    }

    /// Mean torque since this was last called, N·m; `None` if no time has passed.
    pub(super) fn take_mean_nm(&mut self) -> Option<f64> {
        std::mem::take(&mut self.delivered).mean_nm()
    }

    /// Begins the period of [`Load::mean_since_mark_nm`].
    pub(super) fn mark(&mut self) {
        self.marked = DeliveredImpulse::default();
    }

    /// Mean torque since the mark, N·m; `None` if no time has passed.
    pub(super) fn mean_since_mark_nm(&self) -> Option<f64> {
        self.marked.mean_nm()
    }
}

#[cfg(test)]
mod tests {
    use super::PulseRequest;
    use crate::scene::{PulseShape, SceneSource};
    use crate::simulation::Simulation;

    /// It read `1 pulses are waiting or acting already`.
    #[test]
    fn regress_a_full_queue_of_pulses_names_its_limit() {
        let overrides = ["pulse=[]", "commands.pending_limit=1"].map(str::to_owned);
        let scene = SceneSource::open("crank-slider", &overrides).unwrap();
        let mut run = Simulation::new(&scene.scene).unwrap();
        let request = PulseRequest { torque_nm: 1.0, duration_s: 0.1, delay_s: 0.0, shape: PulseShape::Rectangular };
        run.add_pulse(&request).unwrap();
        let refused = run.add_pulse(&request).unwrap_err().to_string();
        assert_eq!(refused, "commands.pending_limit = 1 is reached: it counts the pulses that wait or act");
    }
}
