//! A beginning from which Newton's method finds a periodic motion near resonances, too.

use super::linear::set_torque;
use super::orbit::{Cycle, Guess, OrbitSettings, periodic_orbit};
use super::periodic::PeriodicSystem;
use super::scheme::Scheme;

/// Steps of a period on the way.
const STEPS: [u32; 2] = [64, 128];
/// Steps of a period of the motion that is damped most.
const COARSE: u32 = 32;
/// Weight of implicit Euler, of the trapezoidal rule, and the first change between them.
const DAMPED: f64 = 1.0;
const UNDAMPED: f64 = 0.5;
const CHANGE: f64 = 0.1;
/// The smallest change that is tried.
const LEAST_CHANGE: f64 = 0.01;

/// A periodic motion near the guess, in few steps of ESDIRK: found at once, or by way of damping; `None` where neither finds one.
///
/// Links that begin as they stand at rest ring, and corrections of a ringing motion lead anywhere: rounding decides where. Implicit Euler
/// damps ringing by `h ω²/2`. Its periodic motion has few bends, and is found from afar. The weight θ of its step's end is then lessened
/// until nothing is damped, at 1/2, and each motion begins from the one before (continuation in damping).
///
/// On success the system keeps the torque found; else the one it had.
pub(super) fn coarse_motion<S: PeriodicSystem>(system: &mut S, period_s: f64, guess: &Guess) -> Option<Guess> {
    let given = Begun { guess: guess.clone(), torque_nm: system.torque_nm().copied() };
    let found = STEPS.iter().find_map(|&steps| {
        let mut way = Way { system, cycle: Cycle { period_s, steps } };
        way.follow(Scheme::Esdirk, &given).or_else(|| {
            let undamped = way.by_damping(&given)?;
            way.follow(Scheme::Esdirk, &undamped)
        })
    });
    given.torque_nm.filter(|_| found.is_none()).into_iter().for_each(|torque_nm| set_torque(system, torque_nm));
    found.map(|found| found.guess)
}

/// Where a search begins.
struct Begun {
    guess: Guess,
    torque_nm: Option<f64>,
}

struct Way<'a, S> {
    system: &'a mut S,
    cycle: Cycle,
}

impl<S: PeriodicSystem> Way<'_, S> {
    /// The motion of a scheme, without waiting for vibrations to fade.
    fn follow(&mut self, scheme: Scheme, from: &Begun) -> Option<Begun> {
        if let Some(torque_nm) = from.torque_nm {
            set_torque(self.system, torque_nm);
        }
        let settings = OrbitSettings { max_relaxations: 0, ..OrbitSettings::default() };
        let found = periodic_orbit(self.system, scheme, self.cycle, &from.guess, &settings).ok()?;
        let guess = Guess { q: found.q, v: found.v, advance: Some(found.advance) };
        Some(Begun { guess, torque_nm: found.torque_nm })
    }

    /// The motion of the trapezoidal rule by way of implicit Euler's, or as near to it as there is one.
    fn by_damping(&mut self, from: &Begun) -> Option<Begun> {
        let coarse = Cycle { steps: COARSE, ..self.cycle };
        let begun = Way { system: self.system, cycle: coarse }.follow(Scheme::TwoPoint(DAMPED), from);
        let mut found = self.follow(Scheme::TwoPoint(DAMPED), begun.as_ref().unwrap_or(from)).or(begun)?;
        let (mut weight, mut change) = (DAMPED, CHANGE);
        while weight > UNDAMPED && change >= LEAST_CHANGE {
            let next = (weight - change).max(UNDAMPED);
            match self.follow(Scheme::TwoPoint(next), &found) {
                Some(motion) => (found, weight) = (motion, next),
                None => change *= 0.5,
            }
        }
        Some(found)
    }
}
