//! Two rigid links in an open chain, each with an angle of its own: how a small error in their angles goes on.
//!
//! With the links' angles θ₁ and θ₂, `Δ = θ₁ − θ₂`, lengths L, centres of mass at c, and the tip's mass m at the end,
//!
//! ```text
//! J₁ = I₁ + m₁ c₁² + (m₂ + m) L₁²     J₂ = I₂ + m₂ c₂² + m L₂²     K = L₁ (m₂ c₂ + m L₂)
//! S₁ = m₁ c₁ + (m₂ + m) L₁            S₂ = m₂ c₂ + m L₂
//!
//! J₁ θ̈₁ + K cos Δ θ̈₂ + K sin Δ θ̇₂² + d θ̇₁ + k θ₁ − S₁ g·e′(θ₁) = τ
//! J₂ θ̈₂ + K cos Δ θ̈₁ − K sin Δ θ̇₁²                    − S₂ g·e′(θ₂) = 0
//! ```
//!
//! Lagrange's equations of the kinetic energy `½ J₁ θ̇₁² + ½ J₂ θ̇₂² + K cos Δ θ̇₁ θ̇₂`, with the base's spring k and damper d.

use nalgebra::{Matrix2, Matrix4, Vector2};

use super::small_turn::{Block, CarriedTurn};
use crate::mechanics::mechanism::ROTATIONS;
use crate::scene::{Base, Chain, End};

/// Largest matrix of which the series is taken; its terms, the first of which left out is below 1e-16; and the largest matrix of all.
const SERIES: f64 = 0.25;
const TERMS: u32 = 10;
const LARGEST: f64 = 1e12;

/// The open chain of two links as if they were rigid.
#[derive(Debug, Clone)]
pub struct TwoLinks {
    /// J₁ and J₂, kg·m².
    inertia_kg_m2: [f64; 2],
    /// K, kg·m².
    coupling_kg_m2: f64,
    /// S₁ and S₂, kg·m.
    moment_kg_m: [f64; 2],
    gravity_m_per_s2: [f64; 2],
    base: Base,
}

impl TwoLinks {
    /// `None` of any other chain.
    pub fn new(chain: &Chain) -> Option<Self> {
        let ([first, second], End::Free { tip_mass_kg }) = (chain.links.as_slice(), &chain.end) else { return None };
        let carried_kg = second.mass_kg + tip_mass_kg;
        let own = [first, second].map(|link| link.inertia_kg_m2 + link.mass_kg * link.centre_of_mass_m.powi(2));
        let second_kg_m = second.mass_kg * second.centre_of_mass_m + tip_mass_kg * second.length_m;
        Some(TwoLinks {
            inertia_kg_m2: [own[0] + carried_kg * first.length_m.powi(2), own[1] + tip_mass_kg * second.length_m.powi(2)],
            coupling_kg_m2: first.length_m * second_kg_m,
            moment_kg_m: [first.mass_kg * first.centre_of_mass_m + carried_kg * first.length_m, second_kg_m],
            gravity_m_per_s2: chain.gravity_m_per_s2,
            base: chain.base,
        })
    }

    /// From `c·M e/(c·M c)` of each link's turn c, the angles by which the links turn in a change e: the turns are not orthogonal by
    /// mass. `M δ = (c₁·M e, c₂·M e)` with `M = [J₁, K cos Δ; K cos Δ, J₂]`.
    pub fn turned(&self, links: [[f64; 2]; ROTATIONS], parts: [f64; ROTATIONS]) -> [f64; ROTATIONS] {
        let coupling = self.coupling_kg_m2 * (links[0][0] - links[1][0]).cos();
        let [of_first, of_second] = self.inertia_kg_m2.map(|inertia| coupling / inertia);
        let left = 1.0 - of_first * of_second;
        [(parts[0] - of_first * parts[1]) / left, (parts[1] - of_second * parts[0]) / left]
    }

    /// Small motion over `step_s` about angles and rates under a torque at the base: `e^{Ah}` of the equations linearised there,
    /// `M δ̈ + C δ̇ + D δ = 0`, exact while M, C and D stand.
    pub fn carried_turn(&self, step_s: f64, links: [[f64; 2]; ROTATIONS], torque_nm: f64) -> CarriedTurn {
        let mut blocks = [[Block::default(); ROTATIONS]; ROTATIONS];
        if let Some([stiffness, damping]) = self.per_inertia(links, torque_nm) {
            let mut a = Matrix4::zeros();
            a.fixed_view_mut::<2, 2>(0, 2).copy_from(&Matrix2::identity());
            a.fixed_view_mut::<2, 2>(2, 0).copy_from(&-stiffness);
            a.fixed_view_mut::<2, 2>(2, 2).copy_from(&-damping);
            let grown = exponential(&(a * step_s));
            for (i, row) in blocks.iter_mut().enumerate() {
                for (j, block) in row.iter_mut().enumerate() {
                    *block = [[grown[(i, j)], grown[(i, j + 2)]], [grown[(i + 2, j)], grown[(i + 2, j + 2)]]];
                }
            }
        }
        CarriedTurn { step_s, links, blocks }
    }

    /// `M⁻¹ D` and `M⁻¹ C`; `None` where an inertia is 0.
    fn per_inertia(
        &self,
        [[first, first_rate], [second, second_rate]]: [[f64; 2]; ROTATIONS],
        torque_nm: f64,
    ) -> Option<[Matrix2<f64>; 2]> {
        let [j1, j2] = self.inertia_kg_m2;
        let (sin, cos) = (first - second).sin_cos();
        let (ks, kc) = (self.coupling_kg_m2 * sin, self.coupling_kg_m2 * cos);
        let Base { torsion_spring_nm_per_rad, damper_nm_s_per_rad } = self.base;
        let inverse = Matrix2::new(j1, kc, kc, j2).try_inverse()?;
        // Of the weights: S g·e(θ), which stiffens, and S g·e′(θ), which turns.
        let weight = |link: usize, angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let [x, y] = self.gravity_m_per_s2.map(|g| g * self.moment_kg_m[link]);
            [x * cos + y * sin, y * cos - x * sin]
        };
        let [[stiff1, turning1], [stiff2, turning2]] = [weight(0, first), weight(1, second)];
        let acceleration = inverse
            * Vector2::new(
                torque_nm + turning1
                    - torsion_spring_nm_per_rad * first
                    - damper_nm_s_per_rad * first_rate
                    - ks * second_rate.powi(2),
                turning2 + ks * first_rate.powi(2),
            );
        let by_second = kc * second_rate.powi(2) - ks * acceleration.y;
        let by_first = -kc * first_rate.powi(2) - ks * acceleration.x;
        let stiffness = Matrix2::new(by_second + torsion_spring_nm_per_rad + stiff1, -by_second, by_first, stiff2 - by_first);
        let damping = Matrix2::new(damper_nm_s_per_rad, 2.0 * ks * second_rate, -2.0 * ks * first_rate, 0.0);
        Some([inverse * stiffness, inverse * damping])
    }
}

/// `e^A` by a Taylor series of `A/2ᵏ`, squared k times. NaN where A is not finite, or so large that nothing is known of what it does.
fn exponential(a: &Matrix4<f64>) -> Matrix4<f64> {
    let size = a.abs().column_sum().max();
    if size.is_nan() || size >= LARGEST {
        return Matrix4::repeat(f64::NAN);
    }
    let halvings = (size / SERIES).log2().ceil().max(0.0) as i32;
    let part = a * 0.5_f64.powi(halvings);
    let (mut power, mut sum) = (Matrix4::identity(), Matrix4::identity());
    for k in 1..=TERMS {
        power *= part / f64::from(k);
        sum += power;
    }
    for _ in 0..halvings {
        sum *= sum;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::{Input, Mechanism, Modal};
    use crate::scene::SceneSource;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    const CHAIN: &str = "
        [crank]
        length_m = 0.4
        rigid = true
        mass_kg = 0.1
        centre_of_mass_m = 0.15
        [rod]
        length_m = 0.3
        rigid = true
        mass_kg = 0.05
        [tip]
        mass_kg = 0.03
        [base]
        torsion_spring_nm_per_rad = 0.1
        damper_nm_s_per_rad = 0.002
        [gravity]
        x_m_per_s2 = 1.0
        y_m_per_s2 = -9.81
        [solver]
        model = \"rigid\"
        ";

    fn chain() -> Result<Chain, Box<dyn std::error::Error>> {
        Ok(SceneSource::parse("chain", CHAIN, &[])?.scene.chain().ok_or("no chain")?.clone())
    }

    /// Accelerations by the model that runs such scenes.
    fn accelerations(
        model: &mut Modal,
        q: &[f64; 2],
        v: &[f64; 2],
        torque_nm: f64,
    ) -> Result<[f64; 2], Box<dyn std::error::Error>> {
        let input = Input { torque_nm, ..Input::default() };
        let weights = crate::mechanics::Weights { acceleration: 1.0, velocity: 0.0, position: 0.0 };
        let mut a = [0.0; 2];
        model.residual(&input, q, v, &[0.0; 2], &mut a);
        model.factor(&input, q, v, &[0.0; 2], weights).map_err(|_| "singular")?;
        model.solve(&mut a);
        Ok(a.map(|a| -a))
    }

    /// Two runs of the model that runs such scenes, which begin 1e-7 rad apart and tumble: their difference is carried along.
    #[test]
    fn val_the_difference_of_two_tumbling_chains_is_carried_along() -> Tested {
        let chain = chain()?;
        let two = TwoLinks::new(&chain).ok_or("not two links")?;
        let mut model = Modal::new(&chain, false);
        let (h_s, apart, torque_nm) = (1e-4, 1e-7, 0.02);
        let mut one = [[0.5, -1.0], [9.0, -4.0]];
        let mut other = [[0.5 + apart, -1.0], [9.0, -4.0]];
        let mut carried = [[apart, 0.0], [0.0; 2]];
        let (mut most, mut wrong, mut standing) = (0.0_f64, 0.0_f64, CarriedTurn::default());
        for _ in 0..20_000 {
            for [q, v] in [&mut one, &mut other] {
                // The midpoint rule.
                let a = accelerations(&mut model, q, v, torque_nm)?;
                let middle = [0, 1].map(|i| (q[i] + 0.5 * h_s * v[i], v[i] + 0.5 * h_s * a[i]));
                let (qm, vm) = (middle.map(|m| m.0), middle.map(|m| m.1));
                let a = accelerations(&mut model, &qm, &vm, torque_nm)?;
                for i in 0..2 {
                    (q[i], v[i]) = (q[i] + h_s * vm[i], v[i] + h_s * a[i]);
                }
            }
            let links = [0, 1].map(|i| [one[0][i], one[1][i]]);
            if !standing.stands(h_s, links) {
                standing = two.carried_turn(h_s, links, torque_nm);
            }
            carried = standing.after(carried, None);
            let difference = other[0][0] - one[0][0];
            (most, wrong) = (most.max(difference.abs()), wrong.max((carried[0][0] - difference).abs()));
        }
        assert!(most > 10.0 * apart && wrong < 0.1 * most, "{wrong:e} of {most:e}");
        Ok(())
    }

    /// Against the eigenvalues of blocks, from small to stiff: a swing, a growth, and decays.
    #[test]
    fn val_the_exponential_is_that_of_its_blocks() {
        for size in [1e-6, 0.1, 1.0, 30.0] {
            let mut a = Matrix4::zeros();
            (a[(0, 2)], a[(2, 0)]) = (size, -size);
            (a[(1, 1)], a[(3, 3)]) = (-1e3 * size, 0.5 * size);
            let found = exponential(&a);
            for (place, value) in [
                ((0, 0), size.cos()),
                ((0, 2), size.sin()),
                ((2, 0), -size.sin()),
                ((1, 1), (-1e3 * size).exp()),
                ((3, 3), (0.5 * size).exp()),
                ((0, 1), 0.0),
            ] {
                assert!(
                    (found[place] - value).abs() < 1e-10 * (1.0 + f64::abs(value)),
                    "{size} {place:?}: {} for {value}",
                    found[place]
                );
            }
        }
    }

    /// A library's exponential panics at some such states, and never ends at others.
    #[test]
    fn regress_states_beyond_all_bounds_are_carried_nowhere() -> Tested {
        assert!(exponential(&Matrix4::from_diagonal_element(-10.0 * LARGEST))[(0, 0)].is_nan());
        let two = TwoLinks::new(&chain()?).ok_or("not two links")?;
        for rate in [1e8, 1e30, 1e200, f64::INFINITY, f64::NAN] {
            for step_s in [1e-3, 10.0] {
                let carried = two.carried_turn(step_s, [[0.3, rate], [-0.9, -rate]], 1e6);
                let after = carried.after([[1e-9, 0.0], [0.0; 2]], None);
                assert!(after.as_flattened().iter().all(|number| number.is_finite()), "{rate} {step_s}: {after:?}");
            }
        }
        Ok(())
    }

    /// Turns of both links are told apart, though they are not orthogonal by mass.
    #[test]
    fn val_turns_of_both_links_are_told_apart() -> Tested {
        let chain = chain()?;
        let two = TwoLinks::new(&chain).ok_or("not two links")?;
        let mut model = Modal::new(&chain, false);
        let (links, turned) = ([[0.3, 0.0], [-0.9, 0.0]], [0.2, -0.7]);
        let mut parts = [0.0; 2];
        for (link, part) in parts.iter_mut().enumerate() {
            let mut row = [0.0; 2];
            assert!(model.turn_part(&Input::default(), &[0.3, -0.9], &[0.0; 2], &[0.0; 2], link, &mut row));
            *part = row[0] * turned[0] + row[1] * turned[1];
        }
        for (found, turned) in two.turned(links, parts).iter().zip(turned) {
            assert!((found - turned).abs() < 1e-12, "{found} for {turned}");
        }
        Ok(())
    }
}
