//! The growth of a small error in the angles and rates of a rigid chain.

use super::{Passage, Rigid};
use crate::mechanics::mechanism::ROTATIONS;

/// An error of this many radians says no more than that the angle is unknown.
const MOST_RAD: f64 = 1e6;
/// A larger error is not small: the equation of small motion no longer says how it grows. Its rate is then at most that of the links, and
/// it grows by no more than they turn. In an exchange with unresolved vibrations it grew to 1e6 rad, of a crank that had turned by 235 rad
/// and erred by 2.7.
const SMALL_RAD: f64 = 1.0;
/// M, C and K stand while each link turns by less, in rad, and its rate changes by at most this part.
const STANDS_RAD: f64 = 0.01;
const STANDS_PART: f64 = 0.05;

/// Small motion about the motion of the rigid chain: `M δ̈ + C δ̇ + K δ = 0`, the equation of motion linearised at one state.
///
/// M, C and K change with the crank angle. An error grows where the chain slows down: near a dead centre that it barely passes, and
/// where it turns back.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SmallTurn {
    /// M, kg·m².
    inertia_kg_m2: f64,
    /// C, N·m·s/rad.
    damping_nm_s_per_rad: f64,
    /// K, N·m/rad.
    stiffness_nm_per_rad: f64,
}

impl SmallTurn {
    /// How a small angle and its rate go on over `step_s`. Exact while M, C and K stand:
    ///
    /// ```text
    /// e^{Ah} = e^{−ch/2} (cosh rh · I + (sinh rh)/r · (A + c/2 · I))      c = C/M,  k = K/M,  r² = c²/4 − k
    /// ```
    ///
    /// with `A = [0 1; −k −c]` (Cayley–Hamilton).
    fn carried(&self, step_s: f64) -> Block {
        let (half, k) = (0.5 * self.damping_nm_s_per_rad / self.inertia_kg_m2, self.stiffness_nm_per_rad / self.inertia_kg_m2);
        let square = half * half - k;
        let r = square.abs().sqrt();
        let (even, odd) = if square > 0.0 {
            // Together with e^{−ch/2}, as cosh may overflow where their product does not.
            let [slow, fast] = [((r - half) * step_s).exp(), ((-r - half) * step_s).exp()];
            (0.5 * (slow + fast), 0.5 * (slow - fast) / r)
        } else {
            let fade = (-half * step_s).exp();
            (fade * (r * step_s).cos(), fade * if r > 0.0 { (r * step_s).sin() / r } else { step_s })
        };
        [[even + odd * half, odd], [-odd * k, even - odd * half]]
    }
}

/// How the angle (rad) and rate (rad/s) of one link after a step, rows, depend on those of one link before it, columns.
pub type Block = [[f64; 2]; 2];

/// Small motion over a step. It stands while the links turn by little.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CarriedTurn {
    /// The step, s; 0 if there is none yet.
    pub step_s: f64,
    /// The angle, rad, and rate, rad/s, of the first link, and of a second one that is free.
    pub links: [[f64; 2]; ROTATIONS],
    /// Row i, column j: how link i after the step depends on link j before it.
    pub blocks: [[Block; ROTATIONS]; ROTATIONS],
}

impl CarriedTurn {
    /// Whether it stands for a step of links with these angles (rad) and rates (rad/s).
    pub fn stands(&self, step_s: f64, links: [[f64; 2]; ROTATIONS]) -> bool {
        let same = |([angle, rate], [angle_rad, rate_rad_per_s]): (&[f64; 2], [f64; 2])| {
            (angle_rad - angle).abs() < STANDS_RAD && (rate_rad_per_s - rate).abs() <= STANDS_PART * rate.abs()
        };
        self.step_s == step_s && self.links.iter().zip(links).all(same)
    }

    /// Small angles (rad) and their rates (rad/s) after the step; of a chain of one angle, by its course.
    pub fn after(&self, before: [[f64; 2]; ROTATIONS], course: Option<&Passage>) -> [[f64; 2]; ROTATIONS] {
        let mut after = self.blocks.map(|row| {
            let parts = row.iter().zip(before).map(|(block, small)| times(block, small));
            parts.fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]])
        });
        if let Some(passage) = course {
            after[0] = times(&passage.kept(&self.blocks[0][0], self.step_s), after[0]);
        }
        let fastest = self.links.iter().map(|[_, rate]| rate.abs()).fold(0.0, f64::max);
        std::array::from_fn(|link| {
            let ([angle_rad, rate_rad_per_s], [was_rad, _]) = (after[link], before[link]);
            let most_rad = (was_rad.abs().max(SMALL_RAD) + self.step_s * fastest).min(MOST_RAD);
            match angle_rad.abs() {
                small if small <= SMALL_RAD && rate_rad_per_s.is_finite() => [angle_rad, rate_rad_per_s],
                large if large.is_finite() && rate_rad_per_s.is_finite() => {
                    [angle_rad.clamp(-most_rad, most_rad), rate_rad_per_s.clamp(-fastest, fastest)]
                }
                _ => [MOST_RAD, 0.0],
            }
        })
    }
}

fn times(block: &Block, [angle_rad, rate_rad_per_s]: [f64; 2]) -> [f64; 2] {
    block.map(|row| row[0] * angle_rad + row[1] * rate_rad_per_s)
}

impl Rigid {
    /// Small motion over `step_s` about a crank angle and rate under a torque.
    pub fn carried_turn(&self, step_s: f64, [crank, second]: [[f64; 2]; ROTATIONS], torque_nm: f64) -> CarriedTurn {
        let mut blocks = [[Block::default(); ROTATIONS]; ROTATIONS];
        blocks[0][0] = self.small_turn(crank, torque_nm).carried(step_s);
        CarriedTurn { step_s, links: [crank, second], blocks }
    }

    /// Small motion about a crank angle and rate under a torque, with the acceleration that they have.
    fn small_turn(&self, [theta_rad, rate_rad_per_s]: [f64; 2], torque_nm: f64) -> SmallTurn {
        let pose = self.pose(theta_rad);
        let equation = self.equation(&pose, theta_rad, rate_rad_per_s);
        let acceleration = (torque_nm - equation.rest) / equation.mass;
        SmallTurn {
            inertia_kg_m2: equation.mass,
            damping_nm_s_per_rad: self.viscosity(&pose, rate_rad_per_s),
            stiffness_nm_per_rad: self.stiffness(&pose, theta_rad, rate_rad_per_s, acceleration),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    /// Acceleration at an angle and rate.
    fn acceleration(rigid: &mut Rigid, [theta, rate]: [f64; 2]) -> f64 {
        let equation = rigid.evaluate(theta, rate).equation;
        -equation.rest / equation.mass
    }

    /// A step of the midpoint rule.
    fn moved(rigid: &mut Rigid, [theta, rate]: [f64; 2], h_s: f64) -> [f64; 2] {
        let first = acceleration(rigid, [theta, rate]);
        let middle = [theta + 0.5 * h_s * rate, rate + 0.5 * h_s * first];
        [theta + h_s * middle[1], rate + h_s * acceleration(rigid, middle)]
    }

    /// Two runs that begin 1e-7 rad apart, past dead centres and turning back on a base spring, with friction and weight: carried along
    /// by each step's own motion, and by one that stands for a while.
    #[test]
    fn val_the_difference_of_two_runs_is_carried_along() -> Tested {
        let swings = ["base.torsion_spring_nm_per_rad=3", "base.damper_nm_s_per_rad=0.01", "start.rate_rad_per_s=3"];
        let turns = ["slider.friction_n_s_per_m=0.05", "gravity.y_m_per_s2=-9.81", "start.rate_rad_per_s=9"];
        for (case, given) in [("swings", &swings[..]), ("turns", &turns[..])] {
            let given: Vec<String> = given.iter().chain(&["pulse=[]"]).map(|&key| key.to_owned()).collect();
            let scene = SceneSource::open("crank-slider", &given)?.scene;
            let mut rigid = Rigid::new(scene.chain().ok_or("no chain")?, false);
            let (h_s, apart) = (1e-4, 1e-7);
            let mut one = [0.4, scene.chain().ok_or("no chain")?.start.rate_rad_per_s];
            let mut other = [one[0] + apart, one[1]];
            let mut carried = [[[apart, 0.0], [0.0; 2]]; 2];
            let (mut most, mut wrong, mut standing) = (0.0_f64, [0.0_f64; 2], CarriedTurn::default());
            for _ in 0..30_000 {
                (one, other) = (moved(&mut rigid, one, h_s), moved(&mut rigid, other, h_s));
                let links = [one, [0.0; 2]];
                let present = rigid.carried_turn(h_s, links, 0.0);
                if !standing.stands(h_s, links) {
                    standing = present;
                }
                carried = [present.after(carried[0], None), standing.after(carried[1], None)];
                let difference = other[0] - one[0];
                most = most.max(difference.abs());
                for (wrong, carried) in wrong.iter_mut().zip(carried) {
                    *wrong = wrong.max((carried[0][0] - difference).abs());
                }
            }
            assert!(wrong[0] < 1e-2 * most && wrong[1] < 0.03 * most, "{case}: {wrong:?} of {most:e}");
            assert!(most > 1.5 * apart, "{case}: {most:e}");
        }
        Ok(())
    }

    #[test]
    fn prop_two_steps_are_as_one_of_twice_the_length() {
        for (damping, stiffness) in [(0.3, 2.0), (0.3, -2.0), (5.0, 2.0), (0.0, 0.0), (2.0, 1.0), (1e9, 1.0)] {
            let turn = SmallTurn { inertia_kg_m2: 1.0, damping_nm_s_per_rad: damping, stiffness_nm_per_rad: stiffness };
            let after = |block: Block, [angle, rate]: [f64; 2]| block.map(|row| row[0] * angle + row[1] * rate);
            let [half, whole] = [0.1, 0.2].map(|step_s| turn.carried(step_s));
            let (twice, once) = (after(half, after(half, [1.0, -0.5])), after(whole, [1.0, -0.5]));
            for k in 0..2 {
                assert!((twice[k] - once[k]).abs() < 1e-12 * once[k].abs().max(1e-3), "{turn:?}: {twice:?} {once:?}");
            }
        }
    }

    #[test]
    fn prop_an_error_beyond_all_bounds_stays_finite() {
        let turn = SmallTurn { inertia_kg_m2: 1.0, damping_nm_s_per_rad: 0.0, stiffness_nm_per_rad: -1e12 };
        let mut carried = CarriedTurn::default();
        carried.blocks[0][0] = turn.carried(1.0);
        assert_eq!(carried.after([[f64::NAN, 0.0], [0.0; 2]], None)[0], [MOST_RAD, 0.0]);
        let [angle_rad, rate_rad_per_s] = carried.after([[1e-9, 0.0], [0.0; 2]], None)[0];
        assert!(angle_rad.abs() <= MOST_RAD && rate_rad_per_s.is_finite(), "{angle_rad} rad, {rate_rad_per_s} rad/s");
    }

    /// Beyond a radian an error grows by no more than the links turn.
    #[test]
    fn prop_an_error_that_is_not_small_does_not_grow_by_itself() {
        let turn = SmallTurn { inertia_kg_m2: 1.0, damping_nm_s_per_rad: 0.0, stiffness_nm_per_rad: -1e4 };
        let mut carried = CarriedTurn { step_s: 0.01, links: [[0.3, 20.0], [0.0; 2]], ..CarriedTurn::default() };
        carried.blocks[0][0] = turn.carried(0.01);
        let mut errors = [[1e-6, 0.0], [0.0; 2]];
        for _ in 0..100 {
            errors = carried.after(errors, None);
        }
        let [angle_rad, rate_rad_per_s] = errors[0];
        assert!((10.0..21.0).contains(&angle_rad) && rate_rad_per_s <= 20.0, "{angle_rad} rad, {rate_rad_per_s} rad/s");
    }
}
