//! Drive of the pivot: torque, as its mean over each step and its slope, or a prescribed motion.

use std::f64::consts::PI;

use super::load::SHORTEST_PART;
use crate::mechanics::Input;
use crate::scene::{Drive, Motion, Scene, Start};

/// The drive as the models see it at any instant of the present step.
#[derive(Debug, Clone)]
pub(super) struct DriveLaw {
    /// The torque during the present step.
    pub torque: Torque,
    motion: Option<MotionLaw>,
    /// The present step, from one time to another, s, of which a prescribed acceleration that jumps has one side; `None` before the first.
    pub step_s: Option<[f64; 2]>,
}

/// A torque `mean + rise (t − middle)` over a step: with the exact mean and rise of a smooth one it gives the same angular impulse
/// and the same first moment of it, so what is left out acts in fourth order of the step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Torque {
    /// N·m.
    pub mean_nm: f64,
    /// N·m/s; 0 for an integrator that needs its loads constant during the step.
    pub rise_nm_per_s: f64,
    /// The step's middle, s.
    pub middle_s: f64,
    /// The times of which it is the mean, s.
    pub over_s: [f64; 2],
}

impl Torque {
    /// One that does not change.
    pub(super) fn constant(mean_nm: f64) -> Self {
        Torque { mean_nm, ..Torque::default() }
    }

    fn at(&self, t_s: f64) -> f64 {
        self.mean_nm + self.rise_nm_per_s * (t_s - self.middle_s)
    }
}

/// An instant from which the crank turns at constant speed, as prescribed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MotionOrigin {
    /// Simulated time, s.
    pub time_s: f64,
    /// The angle there, rad.
    pub angle_rad: f64,
}

/// A prescribed angle as a function of time.
#[derive(Debug, Clone)]
enum MotionLaw {
    Speed {
        origin: MotionOrigin,
        speed: f64,
        /// The angle at t = 0.
        start_rad: f64,
    },
    Ramp {
        start_rad: f64,
        from: f64,
        to: f64,
        over_s: f64,
    },
    /// Rows `(time, angle, second derivative)` of a cubic spline.
    Spline(Vec<[f64; 3]>),
}

impl DriveLaw {
    pub(super) fn new(drive: &Drive, start: &Start) -> Self {
        let motion = match drive {
            Drive::Torque { .. } => None,
            Drive::Motion(motion) => Some(MotionLaw::new(motion, start)),
        };
        DriveLaw { torque: Torque::default(), motion, step_s: None }
    }

    /// Goes on where `before` is at `t_s`; a changed speed begins there, from the present angle.
    pub(super) fn go_on_from(&mut self, before: &DriveLaw, t_s: f64) {
        let (Some(own), Some(motion)) = (&mut self.motion, &before.motion) else { return };
        if let (MotionLaw::Speed { origin, speed, .. }, MotionLaw::Speed { origin: from, speed: before, .. }) = (own, motion) {
            let [angle_rad, ..] = motion.at(t_s, None);
            *origin = if speed == before { *from } else { MotionOrigin { time_s: t_s, angle_rad } };
        }
    }

    /// The instant from which the prescribed speed holds, if a constant speed is prescribed.
    pub(super) fn origin(&self) -> Option<MotionOrigin> {
        match self.motion {
            Some(MotionLaw::Speed { origin, .. }) => Some(origin),
            _ => None,
        }
    }

    /// Sets that instant; `None` for the start of the scene.
    pub(super) fn set_origin(&mut self, given: Option<MotionOrigin>) {
        if let Some(MotionLaw::Speed { origin, start_rad, .. }) = &mut self.motion {
            *origin = given.unwrap_or(MotionOrigin { time_s: 0.0, angle_rad: *start_rad });
        }
    }

    /// Sets the torque and the step, from one time to another, s, during which it acts.
    pub(super) fn during(&mut self, torque: Torque, step_s: [f64; 2]) {
        self.torque = torque;
        self.step_s = Some(step_s);
    }

    /// Sets the torque at the start.
    pub(super) fn begin(&mut self, torque: Torque) {
        self.torque = torque;
        self.step_s = None;
    }

    /// The first time between the two at which a prescribed acceleration jumps, s.
    pub(super) fn edge_within(&self, from_s: f64, to_s: f64) -> Option<f64> {
        let Some(MotionLaw::Spline(rows)) = &self.motion else { return None };
        jumps_s(rows).find(|edge_s| from_s < *edge_s && *edge_s < to_s)
    }

    /// Largest rate of a prescribed motion, rad/s; 0 under a torque.
    pub(super) fn largest_rate_rad_per_s(&self) -> f64 {
        match &self.motion {
            None => 0.0,
            Some(MotionLaw::Speed { speed, .. }) => speed.abs(),
            Some(MotionLaw::Ramp { from, to, .. }) => from.abs().max(to.abs()),
            Some(MotionLaw::Spline(rows)) => {
                let middles = rows.windows(2).map(|pair| 0.5 * (pair[0][0] + pair[1][0]));
                let times = rows.iter().map(|[time_s, ..]| *time_s).chain(middles);
                times.map(|time_s| within(rows, time_s)[1].abs()).fold(0.0, f64::max)
            }
        }
    }

    pub(super) fn is_motion(&self) -> bool {
        self.motion.is_some()
    }

    pub(super) fn input(&self, t_s: f64) -> Input {
        Input { time_s: t_s, torque_nm: self.torque.at(t_s), motion: self.motion.as_ref().map(|law| law.at(t_s, self.step_s)) }
    }
}

/// Torque, or prescribed motion, with which a scene starts.
pub fn drive_at_start(scene: &Scene) -> Input {
    let start = scene.chain().map(|chain| chain.start).unwrap_or_default();
    let law = DriveLaw::new(&scene.drive, &start);
    match scene.drive {
        Drive::Torque { constant_nm, .. } => Input { torque_nm: constant_nm, ..law.input(0.0) },
        Drive::Motion(_) => law.input(0.0),
    }
}

impl MotionLaw {
    fn new(motion: &Motion, start: &Start) -> Self {
        let (start_rad, from) = (start.angle_rad, start.rate_rad_per_s);
        match motion {
            Motion::Speed(speed) => {
                MotionLaw::Speed { origin: MotionOrigin { time_s: 0.0, angle_rad: start_rad }, speed: *speed, start_rad }
            }
            Motion::Ramp { to_rad_per_s, over_s } => MotionLaw::Ramp { start_rad, from, to: *to_rad_per_s, over_s: *over_s },
            Motion::Table(rows) => MotionLaw::Spline(cubic_spline(rows)),
        }
    }

    /// Angle (rad), rate and acceleration at a time of a step.
    fn at(&self, t_s: f64, step_s: Option<[f64; 2]>) -> [f64; 3] {
        match self {
            MotionLaw::Speed { origin, speed, .. } => [origin.angle_rad + speed * (t_s - origin.time_s), *speed, 0.0],
            MotionLaw::Ramp { start_rad, from, to, over_s } => {
                // ω = from + (to − from)(1 − cos πs)/2 with s = t/over up to 1.
                let (s, rise) = ((t_s / over_s).min(1.0), to - from);
                let turned =
                    from * t_s + 0.5 * rise * (s * over_s - over_s / PI * (PI * s).sin()) + rise * (t_s - over_s).max(0.0);
                let bend = if s < 1.0 { 0.5 * rise * PI / over_s * (PI * s).sin() } else { 0.0 };
                [start_rad + turned, from + 0.5 * rise * (1.0 - (PI * s).cos()), bend]
            }
            MotionLaw::Spline(rows) => spline_at(rows, t_s, step_s),
        }
    }
}

/// Second derivatives of the cubic spline through `(x, y)` rows, by the tridiagonal system
/// `h₀ m₀ + 2 (h₀ + h₁) m₁ + h₁ m₂ = 6 (slope₁ − slope₀)`. It is natural, with zero at its ends, but at an end whose two rows have one y: there
/// its slope is 0, which `2 m₀ + m₁ = 0` says.
fn cubic_spline(rows: &[[f64; 2]]) -> Vec<[f64; 3]> {
    let n = rows.len();
    let mut spline: Vec<[f64; 3]> = rows.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
    let mut upper = vec![0.0; n];
    let rests = |one: usize, other: usize| rows[one][1] == rows[other][1];
    upper[0] = if rests(0, 1) { 0.5 } else { 0.0 };
    for i in 1..n.saturating_sub(1) {
        let (h0, h1) = (rows[i][0] - rows[i - 1][0], rows[i + 1][0] - rows[i][0]);
        let bend = 6.0 * ((rows[i + 1][1] - rows[i][1]) / h1 - (rows[i][1] - rows[i - 1][1]) / h0);
        let pivot = 2.0 * (h0 + h1) - h0 * upper[i - 1];
        upper[i] = h1 / pivot;
        spline[i][2] = (bend - h0 * spline[i - 1][2]) / pivot;
    }
    if rests(n - 2, n - 1) {
        spline[n - 1][2] = -spline[n - 2][2] / (2.0 - upper[n - 2]);
    }
    for i in (0..n - 1).rev() {
        spline[i][2] -= upper[i] * spline[i + 1][2];
    }
    spline
}

/// The ends of a spline at which its second derivative jumps, as it rests beyond them: those that do not end naturally.
fn jumps_s(rows: &[[f64; 3]]) -> impl Iterator<Item = f64> {
    let ends = [rows.first(), rows.last()].into_iter().flatten();
    ends.filter(|[_, _, bend]| *bend != 0.0).map(|[x, ..]| *x)
}

/// Value, slope and second derivative; beyond either end the last slope goes on.
///
/// At an end where the second derivative jumps, it is that of the side where the step is. In a step around such an end it is its mean
/// there, as that of a torque is: then it changes the slope by as much as the spline does.
fn spline_at(rows: &[[f64; 3]], t: f64, step: Option<[f64; 2]>) -> [f64; 3] {
    let (first, last) = (rows[0][0], rows[rows.len() - 1][0]);
    let Some([from, to]) = step.filter(|_| jumps_s(rows).next().is_some()) else {
        return if (first..=last).contains(&t) { within(rows, t) } else { beyond(rows, t) };
    };
    let margin = SHORTEST_PART * (to - from);
    if jumps_s(rows).any(|edge| from + margin < edge && edge < to - margin) {
        let slope_at = |t: f64| spline_at(rows, t, None)[1];
        let [value, slope, _] = spline_at(rows, t, None);
        return [value, slope, (slope_at(to) - slope_at(from)) / (to - from)];
    }
    if (first..=last).contains(&(0.5 * (from + to))) { within(rows, t) } else { beyond(rows, t) }
}

/// The cubic of the interval at t, or of the nearest one.
fn within(rows: &[[f64; 3]], t: f64) -> [f64; 3] {
    let i = rows.partition_point(|row| row[0] <= t).clamp(1, rows.len() - 1);
    let ([x0, y0, m0], [x1, y1, m1]) = (rows[i - 1], rows[i]);
    let (h, u, w) = (x1 - x0, x1 - t, t - x0);
    let value = (m0 * u.powi(3) + m1 * w.powi(3)) / (6.0 * h) + (y0 / h - m0 * h / 6.0) * u + (y1 / h - m1 * h / 6.0) * w;
    let slope = (m1 * w * w - m0 * u * u) / (2.0 * h) + (y1 - y0) / h - (m1 - m0) * h / 6.0;
    [value, slope, (m0 * u + m1 * w) / h]
}

/// The straight line on which the nearest end goes on.
fn beyond(rows: &[[f64; 3]], t: f64) -> [f64; 3] {
    let end = t.clamp(rows[0][0], rows[rows.len() - 1][0]);
    let [value, slope, _] = within(rows, end);
    [value + slope * (t - end), slope, 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_motions_are_consistent_with_their_derivatives() {
        let start = Start { angle_rad: 0.3, rate_rad_per_s: 2.0, static_equilibrium: false };
        let motions = [
            Motion::Speed(5.0),
            Motion::Ramp { to_rad_per_s: -7.0, over_s: 0.8 },
            Motion::Table(vec![[0.0, 0.3], [0.4, 1.0], [0.9, 0.2], [1.5, 2.0]]),
            Motion::Table(vec![[0.0, 0.3], [0.2, 0.3], [0.9, 0.2], [1.3, 2.0], [1.5, 2.0]]),
        ];
        let h = 1e-4;
        for motion in motions {
            let law = MotionLaw::new(&motion, &start);
            assert!((law.at(0.0, None)[0] - 0.3).abs() < 1e-15);
            for t in [0.05, 0.3, 0.65, 1.2, 1.7] {
                let (before, here, after) = (law.at(t - h, None), law.at(t, None), law.at(t + h, None));
                for k in [0, 1] {
                    let difference = (after[k] - before[k]) / (2.0 * h);
                    assert!((difference - here[k + 1]).abs() < 1e-5, "{motion:?} at {t}: {difference} {here:?}");
                }
            }
        }
    }

    /// Such a table ended at a tenth of its speed, backwards.
    #[test]
    fn regress_a_table_rests_at_an_end_whose_rows_have_one_angle() {
        let rows = |table: &[[f64; 2]]| MotionLaw::new(&Motion::Table(table.to_vec()), &Start::default());
        let law = rows(&[[0.0, 1.0], [0.02, 1.0], [0.12, 4.0], [0.22, 7.0], [0.24, 7.0]]);
        for (t_s, angle_rad) in [(-1.0, 1.0), (0.0, 1.0), (0.24, 7.0), (9.0, 7.0)] {
            let [angle, rate, _] = law.at(t_s, None);
            assert!((angle - angle_rad).abs() < 1e-12 && rate.abs() < 1e-12, "{t_s} s: {angle} rad, {rate} rad/s");
        }
        for (t_s, angle_rad) in [(0.02, 1.0), (0.12, 4.0), (0.22, 7.0)] {
            assert!((law.at(t_s, None)[0] - angle_rad).abs() < 1e-12, "{t_s} s");
            let [before, after] = [-1e-9, 1e-9].map(|off| law.at(t_s + off, None)[2]);
            assert!((before - after).abs() < 1e-3, "{t_s} s: {before} and {after} rad/s²");
        }
        // A natural end keeps its rate, which follows from the two intervals before it.
        let [.., rate, _] = rows(&[[0.25, 1.0], [0.75, 1.0], [1.25, 9.0]]).at(2.0, None);
        assert!((rate - 144.0 / 7.0).abs() < 1e-12, "{rate}");
        assert_eq!(rows(&[[0.0, 2.0], [1.0, 2.0]]).at(0.3, None), [2.0, 0.0, 0.0]);
    }
}
