//! Tangents and inertia terms of every model at random states.

use flexcrank::mechanics::{Input, Mechanism, Observation, Weights};
use flexcrank::scene::Scene;
use proptest::prelude::*;

use crate::assembled::{mechanism, start};
use crate::bench::{FINITE, MODAL, RIGID, energy_j, scene};
use crate::chains::{Kind, Shape};

/// A mechanism at a state of its own choosing.
struct At {
    mechanism: Box<dyn Mechanism>,
    input: Input,
    state: [Vec<f64>; 3],
    links: usize,
}

impl At {
    /// The scene's start with noise on everything.
    fn random(scene: &Scene, driven: bool, noise: &[f64]) -> Self {
        let mut mechanism = mechanism(scene);
        let input = Input { torque_nm: 3.0, motion: driven.then_some([0.6, 2.0, -5.0]), ..Input::default() };
        let [mut q, mut v] = start(&mut *mechanism, &input);
        let at = |i: usize, from: usize, scale: f64| scale * noise[(from + i) % noise.len()] * (1.0 + 0.1 * (i as f64).sin());
        let a = (0..q.len()).map(|i| at(i, 11, 20.0)).collect();
        for i in 0..q.len() {
            q[i] += at(i, 0, 0.02);
            v[i] += at(i, 5, 1.0);
        }
        Self { mechanism, input, state: [q, v, a], links: scene.chain().unwrap().links.len() }
    }

    fn residual(&mut self, state: &[Vec<f64>; 3]) -> Vec<f64> {
        let mut r = vec![0.0; state[0].len()];
        self.mechanism.residual(&self.input, &state[0], &state[1], &state[2], &mut r);
        r
    }

    /// How far the factored tangent is from the differences of the residual along one coordinate with the weights given: it must
    /// take them to the unit vector. Central differences of sixth order, which err by rounding with short steps and by
    /// curvature with long ones: the best of a few.
    fn tangent_error(&mut self, column: usize, w: Weights) -> f64 {
        let here = self.state.clone();
        let mut moved = |by: f64| {
            let mut state = here.clone();
            state[0][column] += w.position * by;
            state[1][column] += w.velocity * by;
            state[2][column] += w.acceleration * by;
            self.residual(&state)
        };
        let lengths = [0.01, 0.03, 0.1, 0.3, 1.0];
        let differences = lengths.map(|h| {
            let odd = [1.0, 2.0, 3.0].map(|k| moved(k * h).iter().zip(moved(-k * h)).map(|(a, b)| a - b).collect::<Vec<f64>>());
            let sum = |i: usize| (45.0 * odd[0][i] - 9.0 * odd[1][i] + odd[2][i]) / (60.0 * h);
            (0..here[0].len()).map(sum).collect::<Vec<f64>>()
        });
        let [q, v, a] = &here;
        self.mechanism.factor(&self.input, q, v, a, w).unwrap();
        let mut least = f64::INFINITY;
        for mut x in differences {
            self.mechanism.solve(&mut x);
            x[column] -= 1.0;
            least = least.min(crate::bench::largest(x));
        }
        least
    }

    /// Mechanical energy along the motion with constant acceleration through the state.
    fn energy_j(&mut self, t: f64) -> f64 {
        let [q, v, a] = &self.state;
        let n = q.len();
        let q: Vec<f64> = (0..n).map(|i| q[i] + t * v[i] + t * t / 2.0 * a[i]).collect();
        let v: Vec<f64> = (0..n).map(|i| v[i] + t * a[i]).collect();
        let motion = self.input.motion.map(|[x, dx, ddx]| [x + t * dx + t * t / 2.0 * ddx, dx + t * ddx, ddx]);
        let mut out = Observation::default();
        out.links.resize_with(self.links, Default::default);
        self.mechanism.observe(&Input { motion, ..self.input }, &q, &v, a, &mut out);
        energy_j(&out)
    }
}

/// Any chain, any model that computes it. (The closed form of `rigid` has no second free link.)
fn cases() -> impl Strategy<Value = (Kind, &'static str)> {
    let shape = prop_oneof![Just(Shape::Slider), Just(Shape::Free), Just(Shape::Beam)];
    let model = prop_oneof![Just(RIGID), Just(MODAL), Just(FINITE)];
    let kind = (shape, any::<[bool; 2]>(), any::<[bool; 4]>(), 1..4_usize);
    let kind = kind.prop_map(|(shape, rigid, [driven, damped, axial, table], elements)| Kind {
        shape,
        rigid,
        driven,
        damped,
        axial,
        table,
        elements,
    });
    (kind, model).prop_filter("rigid computes it", |(kind, model)| *model != RIGID || kind.shape != Shape::Free)
}

const WEIGHTS: [Weights; 4] = [
    Weights { acceleration: 1.0, velocity: 0.0, position: 0.0 },
    Weights { acceleration: 1.0, velocity: 0.02, position: 0.0 },
    Weights { acceleration: 1.0, velocity: 0.0, position: 0.0003 },
    Weights { acceleration: 1.0, velocity: 0.02, position: 0.0003 },
];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn prop_tangents_are_the_derivatives_of_the_residual(
        (kind, model) in cases(), weights in prop::sample::select(&WEIGHTS[..]),
        noise in prop::collection::vec(-1.0..1.0_f64, 37),
    ) {
        let mut at = At::random(&scene(&kind.toml(), &[model]), kind.driven, &noise);
        for column in 0..at.state[0].len() {
            let error = at.tangent_error(column, weights);
            prop_assert!(error < 1e-7, "{kind:?}, {model}, {weights:?}, column {column}: {error:e}");
        }
    }

    /// `v·r = d/dt (T + U + V) + dissipated − put in` at any state and acceleration: mass, gyroscopic, elastic and external
    /// forces at once, the power of a prescribed motion among them.
    #[test]
    fn prop_the_residual_is_the_balance_of_energy(
        (kind, model) in cases(), noise in prop::collection::vec(-1.0..1.0_f64, 37),
    ) {
        let mut at = At::random(&scene(&kind.toml(), &[model]), kind.driven, &noise);
        let state = at.state.clone();
        let r = at.residual(&state);
        let power: f64 = state[1].iter().zip(&r).map(|(v, r)| v * r).sum();
        let [put_in, dissipated] = at.mechanism.power(&at.input, &state[0], &state[1], &state[2]);
        let h = 1e-4;
        let rate = (8.0 * (at.energy_j(h) - at.energy_j(-h)) - (at.energy_j(2.0 * h) - at.energy_j(-2.0 * h))) / (12.0 * h);
        let size = rate.abs() + put_in.abs() + dissipated + at.energy_j(0.0).abs();
        let error = (power - (rate + dissipated - put_in)).abs() / size;
        prop_assert!(error < 1e-7, "{kind:?}, {model}: {error:e} of {size} W");
    }
}
