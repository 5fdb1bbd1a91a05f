//! Growth of a small difference along the motion of a scene, by the mechanism itself.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, Dyn};

use super::loaded::Loaded;
use super::scheme::Scheme;
use super::subject::Subject;
use super::variation::Trajectory;
use crate::integrate::{NewtonSettings, StepError};
use crate::mechanics::Weights;
use crate::scene::Scene;
use crate::simulation::Loads;

/// A difference that grows by less than this does not keep a scheme from staying right: 1e-5 of the motion becomes 1 % of it.
pub const BOUND: f64 = 1000.0;
/// Steps of the coarsest trajectory.
const FEWEST_STEPS: u32 = 64;
/// Steps of the finest trajectory.
const MOST_STEPS: u32 = 1 << 12;
/// Most unknowns times steps of one trajectory.
const MOST_WORK: u32 = 1 << 14;
/// Turning of the crank in a step that resolves it, rad.
const TURN_RAD: f64 = 0.15;
/// Phase of the slowest vibration in a step that resolves it, rad.
const PHASE_RAD: f64 = 0.5;
/// Vibrations this many times as fast as the crank are not excited by its turning.
const FAST: f64 = 10.0;
/// Fewest times at which the growth is looked at.
const LOOKS: u32 = 32;
/// Times at which the growth of one unknown is looked at; a look at n unknowns costs n³.
const LOOKS_OF_ONE: u32 = 2048;
/// The first steps, after each of which it is looked at too.
const EARLY: u32 = 4;
/// Growth of two trajectories that agree differs by no more than this factor.
const AGREE: f64 = 1.5;
/// Growth by so many times the bound need not agree any further.
const BEYOND_DOUBT: f64 = 10.0;
/// Part of a time by which two trajectories that end at the same time may differ.
const SAME_TIME: f64 = 0.05;
const NEWTON: NewtonSettings = NewtonSettings { tolerance: 1e-9, max_iterations: 50 };

/// The largest growth up to a time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Look {
    time_s: f64,
    /// Over what a crank's turning explains; see [`Growth`].
    growth: f64,
}

/// Growth along one trajectory.
#[derive(Debug, Clone, PartialEq)]
struct Along {
    looks: Vec<Look>,
    /// Whether the trajectory reached its end.
    whole: bool,
    /// Steps that resolve the crank's turning, and the slowest vibration if turning may excite it.
    needed_steps: f64,
}

/// Growth of small differences along the motion from a scene's start under its loads:
///
/// ```text
/// G(t) = max over δ and t' ≤ t of |Φ(t') δ| / |δ|      |δ|² = δvᵀ M δv + δqᵀ (K + M/T²) δq
/// ```
///
/// Φ is the exact tangent of ESDIRK's steps, M the mass and K the stiffness of the links at rest in the shape they have then, without its
/// negative part; a displacement counts as the velocity that covers it in the time followed, T. (Finite-time growth in an energy norm:
/// Schmid, *Nonmodal Stability Theory*, Annu. Rev. Fluid Mech. 39, 2007.) A small difference in speed alone moves a free crank further with
/// every turn, so G is divided by the number of turns where there is more than one.
///
/// The step is halved until G no longer changes by a factor of 1.5, or both are beyond [`BOUND`], or both are not and the finer is smaller.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    coarse: Along,
    fine: Along,
    /// Time followed, s.
    pub over_s: f64,
    /// Steps of the finer trajectory.
    pub steps: u32,
}

/// The judgement of a mechanism's growth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Judged {
    /// G is beyond [`BOUND`].
    Grows(f64),
    /// G is not.
    Stays(f64),
    /// No two trajectories reached the time and agree.
    Unknown,
}

impl Growth {
    /// Computes the growth of a scene's mechanism over the time given. Returns `None` for a model without a tangent or without a start, and if
    /// too many steps were needed.
    pub fn along(scene: &Scene, over_s: f64) -> Option<Self> {
        let subject = Subject::new(scene, None).ok()?;
        let unknowns = u32::try_from(subject.mechanism().degrees_of_freedom()).ok()?;
        let most = (MOST_WORK / unknowns.max(1)).clamp(FEWEST_STEPS, MOST_STEPS);
        let mut coarse = follow(scene, &subject, over_s, FEWEST_STEPS)?;
        if coarse.needed_steps > f64::from(most) {
            return None;
        }
        // Half of the steps needed, a power of two.
        let half = (0.5 * coarse.needed_steps).clamp(1.0, f64::from(most / 2)) as u32;
        let mut steps = half.next_power_of_two().clamp(FEWEST_STEPS, most / 2);
        if steps > FEWEST_STEPS {
            coarse = follow(scene, &subject, over_s, steps)?;
        }
        loop {
            steps *= 2;
            let fine = follow(scene, &subject, over_s, steps)?;
            let growth = Growth { coarse, fine, over_s, steps };
            if growth.at(over_s) != Judged::Unknown || 2 * steps > most {
                return Some(growth);
            }
            coarse = growth.fine;
        }
    }

    /// The judgement over the time up to `time_s`.
    pub fn at(&self, time_s: f64) -> Judged {
        let [(coarse, first), (fine, reached)] = [&self.coarse, &self.fine].map(|along| along.up_to(time_s));
        let ratio = fine / coarse;
        // A step too long to go on says nothing of the motion: both reach the time, or end at the same one.
        let ends_s = [&self.coarse, &self.fine].map(|along| along.looks.last().map_or(0.0, |look| look.time_s));
        let alike = (first && reached) || (ends_s[0] - ends_s[1]).abs() <= SAME_TIME * ends_s[1];
        let near = (1.0 / AGREE..=AGREE).contains(&ratio);
        if alike && coarse > BOUND && fine > BOUND && (near || coarse.min(fine) > BEYOND_DOUBT * BOUND) {
            return Judged::Grows(fine);
        }
        // A growth that is small, and smaller with shorter steps, is theirs.
        let settled = near || fine <= coarse && coarse <= BOUND;
        let agrees = settled && f64::from(self.steps) >= self.fine.needed_steps;
        if agrees && reached && first && fine <= BOUND { Judged::Stays(fine) } else { Judged::Unknown }
    }

    /// Whether neither trajectory comes near [`BOUND`] up to `time_s`, or up to where it ends.
    pub fn is_small(&self, time_s: f64) -> bool {
        [&self.coarse, &self.fine].iter().all(|along| along.up_to(time_s).0 < 0.1 * BOUND)
    }
}

impl Along {
    /// The growth up to a time, between two looks by its exponent, and whether the trajectory reached it.
    fn up_to(&self, time_s: f64) -> (f64, bool) {
        let place = self.looks.partition_point(|look| look.time_s < time_s * (1.0 - 1e-9));
        let reached = place < self.looks.len() || self.whole;
        let (from_s, from) = self.looks[..place].last().map_or((0.0, 1.0), |look| (look.time_s, look.growth));
        let Some(after) = self.looks.get(place) else { return (from, reached) };
        let part = (time_s - from_s) / (after.time_s - from_s);
        (from * (after.growth / from).powf(part.min(1.0)), reached)
    }
}

/// Follows the motion with its tangent as far as it goes; `None` if it has no start.
fn follow(scene: &Scene, subject: &Subject, over_s: f64, steps: u32) -> Option<Along> {
    let mut mechanism = subject.mechanism();
    let n = mechanism.degrees_of_freedom();
    let loads = Loads::new(scene);
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    mechanism.start(&loads.input(0.0), &mut q, &mut v).ok()?;
    let mut walk = Walk::new(Loaded { mechanism: mechanism.as_mut(), loads }, [q, v].concat(), over_s)?;
    let looks = LOOKS.max(LOOKS_OF_ONE / u32::try_from(n.max(1)).ok()?);
    let (h_s, every) = (over_s / f64::from(steps), (steps / looks).max(1));
    let (mut looks, mut most): (Vec<Look>, f64) = (Vec::new(), 1.0);
    let mut whole = true;
    for step in 0..steps {
        whole = walk.step(f64::from(step) * h_s, f64::from(step + 1) * h_s).is_ok();
        if !whole || (step + 1) % every == 0 || step < EARLY || step + 1 == steps {
            let growth = walk.growth();
            whole = whole && growth.is_some();
            most = most.max(growth.unwrap_or(1.0));
            looks.push(Look { time_s: walk.time_s, growth: most });
        }
        if !whole {
            break;
        }
    }
    Some(Along { looks, whole, needed_steps: walk.needed_steps() })
}

/// A motion with its tangent.
struct Walk<'a> {
    system: Loaded<'a>,
    trajectory: Trajectory,
    begun: bool,
    /// Derivative of the present state by the first one, up to the trajectory's beginning.
    map: DMatrix<f64>,
    carried: Vec<f64>,
    /// Factor of the norm at the start.
    start: Norm,
    over_s: f64,
    time_s: f64,
    /// Angle that the crank has turned, rad, and whether it is free.
    turned_rad: f64,
    is_free: bool,
}

impl<'a> Walk<'a> {
    fn new(mut system: Loaded<'a>, carried: Vec<f64>, over_s: f64) -> Option<Self> {
        let n = carried.len() / 2;
        let start = Norm::at(&mut system, 0.0, &carried, over_s)?;
        let trajectory = Trajectory::new(Scheme::Esdirk, n, NEWTON);
        let map = DMatrix::identity(2 * n, 2 * n);
        let is_free = system.loads.input(0.0).motion.is_none();
        Some(Walk { system, trajectory, begun: false, map, carried, start, over_s, time_s: 0.0, turned_rad: 0.0, is_free })
    }

    /// From one time to another, cut at the edges of pulses.
    fn step(&mut self, mut from_s: f64, to_s: f64) -> Result<(), StepError> {
        let least_s = 1e-9 * (to_s - from_s);
        while let Some(edge_s) = self.system.loads.edge_within(from_s + least_s, to_s - least_s) {
            self.part(from_s, edge_s)?;
            from_s = edge_s;
        }
        self.part(from_s, to_s)
    }

    fn part(&mut self, from_s: f64, to_s: f64) -> Result<(), StepError> {
        let jumps = self.system.loads.during(from_s, to_s);
        if jumps || !self.begun {
            // A load that jumps is a new beginning: the scheme takes no other account of it.
            self.map = self.map_so_far();
            self.trajectory.begin(&mut self.system, from_s, &self.carried)?;
            self.begun = true;
        }
        self.trajectory.step(&mut self.system, from_s, to_s - from_s)?;
        let carried = self.trajectory.carried();
        self.turned_rad += match [from_s, to_s].map(|t_s| self.system.loads.input(t_s).motion) {
            [Some(from), Some(to)] => (to[0] - from[0]).abs(),
            // The angle of a free crank is the first coordinate of every model.
            _ => carried.iter().zip(&self.carried).map(|(to, from)| (to - from).abs()).next().unwrap_or(0.0),
        };
        self.carried.copy_from_slice(carried.as_slice());
        self.time_s = to_s;
        Ok(())
    }

    fn map_so_far(&self) -> DMatrix<f64> {
        if self.begun { self.trajectory.map() * &self.map } else { self.map.clone() }
    }

    /// The largest growth to the present; `None` when a number is not finite or the mass is singular.
    fn growth(&mut self) -> Option<f64> {
        let map = self.map_so_far();
        let norm = Norm::at(&mut self.system, self.time_s, &self.carried, self.over_s)?;
        let growth = norm.largest(&map, &self.start)?;
        let turns = if self.is_free { self.turned_rad / TAU } else { 0.0 };
        Some(growth / turns.max(1.0))
    }

    /// See [`Along::needed_steps`].
    fn needed_steps(&self) -> f64 {
        let phase = self.over_s * self.start.slowest_rad_per_s(self.over_s).unwrap_or(0.0);
        let vibration = if phase <= FAST * self.turned_rad { phase / PHASE_RAD } else { 0.0 };
        vibration.max(self.turned_rad / TURN_RAD)
    }
}

/// The energy norm: `|δ|² = |L_qᵀ δq|² + |L_vᵀ δv|²`.
struct Norm {
    /// Cholesky factors of `K⁺ + M/T²` and of M.
    parts: [DMatrix<f64>; 2],
}

impl Norm {
    fn at(system: &mut Loaded<'_>, t_s: f64, carried: &[f64], over_s: f64) -> Option<Self> {
        let n = carried.len() / 2;
        let (q, rest) = (&carried[..n], vec![0.0; n]);
        let mut input = system.loads.input(t_s);
        // A crank that is driven rests, too.
        input.motion = input.motion.map(|[angle_rad, ..]| [angle_rad, 0.0, 0.0]);
        let mut matrix = |acceleration, position| {
            let mut dense = DMatrix::zeros(n, n);
            let w = Weights { acceleration, velocity: 0.0, position };
            system.mechanism.tangent(&input, q, &rest, &rest, w, &mut |row, column, value| dense[(row, column)] += value);
            (&dense + dense.transpose()) * 0.5
        };
        let (mass, stiffness) = (matrix(1.0, 0.0), matrix(0.0, 1.0));
        if !mass.iter().chain(stiffness.iter()).all(|x| x.is_finite()) {
            return None;
        }
        let positive = positive_part(stiffness) + &mass / (over_s * over_s);
        let factor = |matrix: DMatrix<f64>| Cholesky::<f64, Dyn>::new(matrix).map(|factor| factor.l());
        Some(Norm { parts: [factor(positive)?, factor(mass)?] })
    }

    /// The lowest frequency ω of `K⁺ x = ω² M x` that is a vibration of more than one period in `over_s`.
    fn slowest_rad_per_s(&self, over_s: f64) -> Option<f64> {
        let [stiffness, mass] = &self.parts;
        let mut factor = stiffness.clone();
        if factor.is_empty() || !mass.solve_lower_triangular_mut(&mut factor) || !factor.iter().all(|x| x.is_finite()) {
            return None;
        }
        let squares = (&factor * factor.transpose()).symmetric_eigenvalues();
        let vibrates = |omega: &f64| omega * over_s > TAU;
        squares.iter().map(|square| square.sqrt()).filter(vibrates).min_by(f64::total_cmp)
    }

    /// The largest `|Φ δ|` over `|δ|` at the start.
    fn largest(&self, map: &DMatrix<f64>, start: &Norm) -> Option<f64> {
        map.iter().all(|x| x.is_finite()).then_some(())?;
        let n = map.nrows() / 2;
        if n == 0 {
            return Some(1.0);
        }
        let mut scaled = map.clone();
        for (part, factor) in self.parts.iter().enumerate() {
            let rows = factor.transpose() * map.rows(part * n, n);
            scaled.rows_mut(part * n, n).copy_from(&rows);
        }
        // Φ L⁻ᵀ = (L⁻¹ Φᵀ)ᵀ
        let mut columns = scaled.transpose();
        for (part, factor) in start.parts.iter().enumerate() {
            let mut rows = columns.rows(part * n, n).into_owned();
            factor.solve_lower_triangular_mut(&mut rows).then_some(())?;
            columns.rows_mut(part * n, n).copy_from(&rows);
        }
        let size = columns.amax();
        if !size.is_finite() || size == 0.0 {
            return None;
        }
        let scaled = columns / size;
        let square = &scaled * scaled.transpose();
        let largest = square.symmetric_eigenvalues().max();
        Some(size * largest.sqrt())
    }
}

/// A symmetric matrix without its negative eigenvalues.
fn positive_part(matrix: DMatrix<f64>) -> DMatrix<f64> {
    if matrix.is_empty() {
        return matrix;
    }
    let eigen = matrix.symmetric_eigen();
    let values = eigen.eigenvalues.map(|value| value.max(0.0));
    &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose()
}
