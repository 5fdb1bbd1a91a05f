//! How far the crank turned in a step, in each part of a turn.

use std::f64::consts::TAU;

/// Parts of a turn.
const PARTS: usize = 360;

/// The longest steps of the crank in each part of a turn, as samples showed its speed.
#[derive(Debug, Clone, PartialEq)]
pub struct CrankSteps {
    /// Epoch, angle and turning of the last sample, rad.
    last: Option<(u64, f64, Turning)>,
    parts: Box<[Turning; PARTS]>,
}

/// A turning of the crank; of two, that with the longer step is the greater.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
pub struct Turning {
    /// Angle in one step, rad.
    pub step_rad: f64,
    /// Speed, rad/s.
    pub rad_per_s: f64,
}

impl Turning {
    fn longer(self, other: Self) -> Self {
        if other > self { other } else { self }
    }
}

impl Default for CrankSteps {
    fn default() -> Self {
        CrankSteps { last: None, parts: Box::new([Turning::default(); PARTS]) }
    }
}

impl CrankSteps {
    /// Adds a sample of an epoch: angle, rad, rate, rad/s, and the step, s, with which it was reached.
    pub(super) fn add(&mut self, epoch: u64, [angle_rad, rate_rad_per_s]: [f64; 2], step_s: f64) {
        let rad_per_s = rate_rad_per_s.abs();
        let turning = Turning { step_rad: rad_per_s * step_s, rad_per_s };
        if let Some((of, from_rad, before)) = self.last.replace((epoch, angle_rad, turning))
            && of == epoch
        {
            let longest = before.longer(turning);
            parts([from_rad, angle_rad]).for_each(|part| self.parts[part] = self.parts[part].longer(longest));
        }
    }

    /// The longest step in a range of angles, rad, from the smaller; 0 where the crank was never seen.
    pub fn longest_in(&self, range: [f64; 2]) -> Turning {
        parts(range).fold(Turning::default(), |longest, part| longest.longer(self.parts[part]))
    }
}

/// The parts that lie between two angles, in any order, at most all of them.
fn parts([one_rad, other_rad]: [f64; 2]) -> impl Iterator<Item = usize> {
    let part = |angle_rad: f64| (angle_rad / TAU * PARTS as f64).floor();
    let [first, last] = [part(one_rad.min(other_rad)), part(one_rad.max(other_rad))];
    let count = (last - first + 1.0).min(PARTS as f64) as usize;
    let first = first.rem_euclid(PARTS as f64) as usize;
    (first..first + count).map(|part| part % PARTS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A crank that swings between -0.5 and 0.5 rad, and is reset to 3 rad, where it turns backwards by three turns.
    #[test]
    fn val_each_part_of_a_turn_has_its_longest_step() {
        let mut steps = CrankSteps::default();
        for (epoch, angle_rad, rate_rad_per_s) in [(0, -0.5, 0.0), (0, 0.0, 2.0), (0, 0.5, 0.0), (1, 3.0, -10.0), (1, 2.0, -30.0)]
        {
            steps.add(epoch, [angle_rad, rate_rad_per_s], 1e-3);
        }
        let longest = |range| steps.longest_in(range).rad_per_s;
        assert_eq!(longest([0.1, 0.2]), 2.0);
        // The same range in other turns.
        assert_eq!(longest([0.1 - TAU, 0.2 - TAU]), 2.0);
        assert_eq!(longest([-0.4, 0.4]), 2.0);
        assert_eq!(longest([0.6, 1.9]), 0.0, "between the epochs, nothing was seen");
        assert_eq!(steps.longest_in([2.5, 2.6]), Turning { step_rad: 0.03, rad_per_s: 30.0 });
        assert_eq!(longest([-1.0, 7.0]), 30.0);
        // More than a turn between two samples passes everything; later, slower turns change nothing.
        steps.add(1, [-20.0, -40.0], 1e-3);
        steps.add(1, [-40.0, -5.0], 1e-3);
        assert_eq!(steps.longest_in([0.6, 1.9]).rad_per_s, 40.0);
        // A step twice as long at a lower speed.
        steps.add(1, [-60.0, -30.0], 2e-3);
        assert_eq!(steps.longest_in([1.0, 1.1]), Turning { step_rad: 0.06, rad_per_s: 30.0 });
    }
}
