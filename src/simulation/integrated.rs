//! Models that are second-order systems, advanced by one of the integrators.

use super::drive::DriveLaw;
use super::engine::{Dynamics, Engine, Motion};
use super::error_estimate::{StepTerms, Term};
use crate::integrate::{
    ErrorTerm, Integrator, LocalError, Power, Singular, State, StepError, System, Taken, Weights, solve_acceleration,
};
use crate::mechanics::{
    self, CarriedTurn, Course, Energy, Measure, Mechanism, NoEquilibrium, Observation, Passage, ROTATIONS, RigidChain,
};

/// A mechanism, its integrator and their state.
pub(super) struct Integrated<M> {
    mechanism: M,
    integrator: Integrator,
    state: State,
    start: State,
    /// The chain as if its links were rigid, if its motion is free.
    rigid: Option<RigidChain>,
    /// Slowest decay of what the links do beside turning, 1/s; 0 if there is none.
    fading_per_s: f64,
    /// Angle, rad, and rate, rad/s, of the first link's chord before the last step.
    before: [f64; 2],
    /// The rigid chain's own motion before the last step, and at the present state; `None` where it is not known.
    left: Option<Course>,
    course: Option<Course>,
    /// Rows that tell the part of each link's turn in a small change.
    turns: [Vec<f64>; ROTATIONS],
    /// Accelerations for an observation, and room to solve for them.
    observed: Vec<f64>,
    scratch: Vec<f64>,
}

/// A mechanism under a drive, as the integrators see it.
struct Driven<'a, M> {
    mechanism: &'a mut M,
    law: &'a DriveLaw,
}

impl<M: Mechanism> System for Driven<'_, M> {
    fn degrees_of_freedom(&self) -> usize {
        self.mechanism.degrees_of_freedom()
    }
    #[inline]
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.mechanism.residual(&self.law.input(t_s), q, v, a, r);
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        self.mechanism.residual_size(r)
    }
    #[inline]
    fn factor(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        let weights = mechanics::Weights { acceleration: w.acceleration, velocity: w.velocity, position: w.position };
        self.mechanism.factor(&self.law.input(t_s), q, v, a, weights).map_err(|mechanics::Singular| Singular)
    }
    fn solve(&mut self, x: &mut [f64]) {
        self.mechanism.solve(x);
    }
    fn factor_over_correction(&self) -> f64 {
        self.mechanism.factor_over_correction()
    }
    #[inline]
    fn power(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64]) -> Power {
        let [put_in_w, dissipated_w] = self.mechanism.power(&self.law.input(t_s), q, v, a);
        Power { put_in_w, dissipated_w }
    }
}

impl<M: Mechanism> Integrated<M> {
    pub(super) fn new(
        mut mechanism: M,
        mut integrator: Integrator,
        (rigid, fading_per_s): (Option<RigidChain>, f64),
        (law, step_s): (&DriveLaw, f64),
    ) -> Result<Self, NoEquilibrium> {
        let n = mechanism.degrees_of_freedom();
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        mechanism.start(&law.input(0.0), &mut q, &mut v)?;
        let mut start = State::new(q, v);
        // A start without finite accelerations is refused when it is observed.
        let _ = integrator.begin(&mut Driven { mechanism: &mut mechanism, law }, 0.0, step_s, &mut start);
        Ok(Integrated {
            mechanism,
            integrator,
            rigid,
            fading_per_s,
            state: start.clone(),
            start,
            observed: vec![0.0; n],
            scratch: vec![0.0; n],
            before: [0.0; 2],
            left: None,
            course: None,
            turns: std::array::from_fn(|_| vec![0.0; n]),
        })
    }
}

impl<M: Mechanism> Integrated<M> {
    /// Whether it turns by one angle, and bends or passes corners of a resistance, at which K jumps within a step. Otherwise, the
    /// equation of small errors keeps by itself what a course gives back.
    fn has_course(&self) -> bool {
        let turns_by_one = matches!(self.rigid, Some(RigidChain::OneAngle(_)));
        turns_by_one && (self.bends() || self.rigid.as_ref().is_some_and(RigidChain::has_corners))
    }

    fn bends(&self) -> bool {
        self.state.q.len() > 1
    }

    /// Sets the rows of turns at the present state.
    fn set_turns(&mut self, law: &DriveLaw, t_s: f64) {
        let State { q, v, a, .. } = &self.state;
        let (input, turns) = (law.input(t_s), self.rigid.as_ref().map_or(0, RigidChain::rotations));
        for (link, part) in self.turns.iter_mut().enumerate().take(turns) {
            if !self.mechanism.turn_part(&input, q, v, a, link, part) {
                part.fill(0.0);
            }
        }
    }

    /// The rigid chain's own motion at the present state, whose rows of turns are set. Its rate is that of the velocities' part in which
    /// the chain turns, which vibration does not sway.
    fn present_course(&self) -> Option<Course> {
        if !self.has_course() {
            return None;
        }
        let State { q, v, .. } = &self.state;
        let [angle_rad, chord_rad_per_s] = self.mechanism.chords(q, v)[0];
        let [row, _] = &self.turns;
        let turns = row.iter().any(|part| *part != 0.0);
        self.rigid.as_ref()?.course([angle_rad, if turns { dot(row, v) } else { chord_rad_per_s }])
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<M: Mechanism + 'static> Engine for Integrated<M> {
    fn reset(&mut self) {
        self.state.clone_from(&self.start);
        self.course = None;
    }

    fn step(&mut self, law: &DriveLaw, t_s: f64, h_s: f64) -> Result<Taken, StepError> {
        if self.rigid.as_ref().is_some_and(RigidChain::has_corners) {
            self.before = self.mechanism.chords(&self.state.q, &self.state.v)[0];
        }
        if self.course.is_none() && self.has_course() {
            self.set_turns(law, t_s);
            self.course = self.present_course();
        }
        self.left = self.course.take();
        self.integrator.step(&mut Driven { mechanism: &mut self.mechanism, law }, t_s, h_s, &mut self.state)
    }

    fn local_error(&mut self, law: &DriveLaw, t_s: f64, h_s: f64) -> Option<StepTerms> {
        self.set_turns(law, t_s);
        self.course = self.present_course();
        let course = self.left.take().zip(self.course);
        let (torque_nm, bends) = (law.input(t_s).torque_nm, self.bends());
        let course = course.map(|(before, after)| Passage { ends: [before, after], torque_nm, bends });
        let chords = self.mechanism.chords(&self.state.q, &self.state.v);
        let turns = self.rigid.as_ref().map_or(0, RigidChain::rotations);
        let LocalError { q, v } = self.integrator.local_error(h_s);
        let measured = |vector: &[f64]| -> Option<Measure> {
            let mut parts = [0.0; ROTATIONS];
            parts.iter_mut().zip(&self.turns).take(turns).for_each(|(part, row)| *part = dot(row, vector));
            let turns_rad = self.rigid.as_ref().map_or(parts, |rigid| rigid.turned(chords, parts));
            Some(Measure { turns_rad, ..self.mechanism.measure(&self.state.q, vector)? })
        };
        let of_q = measured(q.vector())?;
        let of_v = if std::ptr::eq(q.vector(), v.vector()) { of_q } else { measured(v.vector())? };
        let terms = [(of_q, q), (of_v, v)].map(|(measure, term)| match term {
            ErrorTerm::Direct(_, factor) => Term { measure, factor, size: None },
            ErrorTerm::Difference(_, factor, size) => Term { measure, factor, size: Some(size) },
        });
        let of_corner = |part| self.integrator.corner_error(part);
        let cornered = self.rigid.as_ref().filter(|rigid| rigid.has_corners());
        let corner = |rigid: &RigidChain| rigid.corner_error(h_s, [self.before, chords[0]], of_corner);
        let moving = self.rigid.as_ref().and_then(|_| self.mechanism.measure(&self.state.q, &self.state.v));
        Some(StepTerms {
            terms,
            corner_rad_per_s: cornered.map_or(0.0, corner),
            course,
            rates: moving.map_or([0.0; 2], |moving| [moving.angle_rad, moving.deflection_m]),
            fading_per_s: self.fading_per_s,
        })
    }

    fn rotations(&self) -> Option<[[f64; 2]; ROTATIONS]> {
        let State { q, v, .. } = &self.state;
        self.rigid.as_ref().map(|_| match self.course {
            Some(course) => [[course.angle_rad, course.rate_rad_per_s], [0.0; 2]],
            None => self.mechanism.chords(q, v),
        })
    }

    fn carried_turn(&self, law: &DriveLaw, t_s: f64, h_s: f64, links: [[f64; 2]; ROTATIONS]) -> Option<CarriedTurn> {
        Some(self.rigid.as_ref()?.carried_turn(h_s, links, law.input(t_s).torque_nm))
    }

    fn unknowns(&self) -> Option<usize> {
        Some(self.mechanism.degrees_of_freedom())
    }

    fn motion(&mut self, law: &DriveLaw, t_s: f64) -> Option<Motion> {
        let State { q, v, .. } = self.state.clone();
        let mut a = vec![0.0; q.len()];
        let system = &mut Driven { mechanism: &mut self.mechanism, law };
        solve_acceleration(system, t_s, &q, &v, &mut a, &mut self.scratch).ok()?;
        Some(Motion { input: law.input(t_s), q, v, a })
    }

    fn energy(&mut self, law: &DriveLaw, t_s: f64) -> Energy {
        let State { q, v, a, .. } = &self.state;
        self.mechanism.energy(&law.input(t_s), q, v, a)
    }

    fn dynamics(&mut self) -> Option<Dynamics<'_>> {
        self.course = None;
        Some(Dynamics { mechanism: &mut self.mechanism, q: &mut self.state.q, v: &mut self.state.v, a: &mut self.state.a })
    }

    fn begin_as_given(&mut self, law: &DriveLaw, t_s: f64) {
        let State { q, v, a, alpha, residual } = &mut self.state;
        alpha.copy_from_slice(a);
        self.mechanism.residual(&law.input(t_s), q, v, a, residual);
    }

    fn begin(&mut self, law: &DriveLaw, t_s: f64, h_s: f64) -> Result<(), StepError> {
        let State { a, alpha, residual, .. } = &mut self.state;
        [a, alpha, residual].into_iter().for_each(|part| part.fill(0.0));
        self.integrator.begin(&mut Driven { mechanism: &mut self.mechanism, law }, t_s, h_s, &mut self.state)
    }

    fn keeps_energy(&self) -> bool {
        true
    }

    fn observe(&mut self, law: &DriveLaw, t_s: f64, out: &mut Observation) -> Result<(), StepError> {
        let State { q, v, .. } = &self.state;
        let mut system = Driven { mechanism: &mut self.mechanism, law };
        solve_acceleration(&mut system, t_s, q, v, &mut self.observed, &mut self.scratch)?;
        self.mechanism.observe(&law.input(t_s), q, v, &self.observed, out);
        Ok(())
    }

    fn save(&self, out: &mut Vec<f64>) {
        let State { q, v, a, alpha, residual } = &self.state;
        [q, v, a, alpha, residual].iter().for_each(|part| out.extend_from_slice(part));
    }

    fn restore(&mut self, saved: &[f64]) -> bool {
        let n = self.state.q.len();
        if saved.len() != 5 * n {
            return false;
        }
        self.course = None;
        let State { q, v, a, alpha, residual } = &mut self.state;
        for (part, saved) in [q, v, a, alpha, residual].into_iter().zip(saved.chunks_exact(n.max(1))) {
            part.copy_from_slice(saved);
        }
        true
    }
}
