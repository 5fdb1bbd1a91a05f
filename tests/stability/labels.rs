//! Labels of failed cells against brute force: the same cell converged in step, beside neighbours that begin a little apart.

use std::num::NonZero;
use std::ops::ControlFlow;
use std::time::Duration;

use flexcrank::mechanics::Mechanism;
use flexcrank::scene::{Scene, SceneSource};
use flexcrank::simulation::{Checkpoint, Motion, Simulation};
use flexcrank::small_motion::growth::BOUND;
use flexcrank::small_motion::{Linearised, Point, Subject};
use flexcrank::study::stability::{
    Axis, BaseScene, Category, Cell, Label, Map, MapPlan, Measure, Outcome, Quantity, Spacing, sweep,
};
use nalgebra::{DMatrix, DVector};

use crate::Tried;

/// Numbers that look random, the same in every run (splitmix64).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Spread by ratios.
    fn wide(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }

    fn one_of<T: Copy>(&mut self, among: &[T]) -> T {
        among[(self.unit() * among.len() as f64) as usize]
    }
}

/// A cell before it has run, with its reference's overrides and step.
struct Drawn {
    mechanism: Vec<String>,
    solver: Vec<String>,
    step_s: f64,
    over_s: f64,
    /// The reference is a mesh of eight elements, instead of the same model.
    meshed: bool,
}

fn words(given: &[&str]) -> Vec<String> {
    given.iter().map(|&given| given.to_owned()).collect()
}

/// A rod without damping near a parametric resonance, its crank moved steadily.
fn resonant(random: &mut Random) -> Drawn {
    let speed = random.between(100.0, 116.0);
    let mut mechanism = words(&[
        "solver.model=modal",
        "pulse=[]",
        "crank.rigid=true",
        "rod.axial=false",
        "rod.damping_s=0.0",
        "rod.modes=1",
        "slider.mass_kg=2.0",
        "rod.section={shape=\"rectangle\",width_m=0.01,height_m=0.03}",
    ]);
    mechanism.extend(["start.rate_rad_per_s", "drive.speed_rad_per_s"].map(|key| format!("{key}={speed:?}")));
    let solver = solver(random, "modal");
    Drawn { mechanism, solver, step_s: random.wide(1e-3, 1e-2), over_s: 0.6, meshed: false }
}

/// Rigid or modal links near their upright position in gravity, from which they fall.
fn upright(random: &mut Random) -> Drawn {
    let model = random.one_of(&["rigid", "modal"]);
    let angle = std::f64::consts::FRAC_PI_2 + random.wide(1e-6, 1e-3);
    let mut mechanism = words(&["pulse=[]", "gravity.y_m_per_s2=-9.81", "crank.damping_s=1e-3", "rod.damping_s=1e-3"]);
    mechanism.extend([format!("solver.model={model}"), format!("start.angle_rad={angle:?}")]);
    let solver = solver(random, model);
    Drawn { mechanism, solver, step_s: random.wide(1e-2, 1e-1), over_s: random.between(0.5, 3.0), meshed: false }
}

fn solver(random: &mut Random, model: &str) -> Vec<String> {
    let integrators = ["two-point", "generalized-alpha", "esdirk", "runge-kutta"];
    let integrator = random.one_of(&integrators[..if model == "finite-element" { 3 } else { 4 }]);
    let (weight, rho) = (random.unit(), random.unit());
    vec![format!("solver.integrator={integrator}"), format!("solver.weight={weight:?}"), format!("solver.rho_infinity={rho:?}")]
}

/// A cell from the ranges of the sweep.
fn drawn(random: &mut Random) -> Drawn {
    match random.unit() {
        ..0.15 => return resonant(random),
        0.15..0.3 => return upright(random),
        _ => (),
    }
    let model = random.one_of(&["rigid", "modal", "finite-element", "finite-element"]);
    let mut mechanism = vec![format!("solver.model={model}")];
    let mesh = random.one_of(&[1, 2, 4]);
    mechanism.extend(["crank", "rod"].map(|link| format!("{link}.elements={mesh}")));
    let both = |key: &str, value: f64| ["crank", "rod"].map(|link| format!("{link}.{key}={value:?}")).to_vec();
    mechanism.extend(match random.one_of(&[0, 1, 2, 3, 4, 5, 6, 7]) {
        0 => both("youngs_modulus_pa", random.wide(1e8, 1e14)),
        1 => {
            let speed = random.wide(1.0, 60.0);
            let keys = ["start.rate_rad_per_s", "drive.speed_rad_per_s"].map(|key| format!("{key}={speed:?}"));
            [words(&["pulse=[]"]), keys.to_vec()].concat()
        }
        2 => vec![format!("crank.length_m={:?}", random.between(0.05, 1.5))],
        3 => vec![format!("slider.mass_kg={:?}", random.wide(1e-4, 1e4))],
        4 => both("damping_s", random.wide(1e-6, 1.0)),
        5 => vec![format!("slider.friction_n_s_per_m={:?}", random.wide(1e-2, 1e5))],
        6 => {
            let (torque, duration) = (random.wide(1e-3, 1e2), random.wide(1e-5, 1e-1));
            vec![format!("pulse=[{{ start_s = 0.0, torque_nm = {torque:?}, duration_s = {duration:?} }}]")]
        }
        _ => vec![format!("base.damper_nm_s_per_rad={:?}", random.wide(1e-3, 1e4))],
    });
    let solver = solver(random, model);
    let meshed = model == "finite-element" && random.unit() < 0.3;
    Drawn { mechanism, solver, step_s: random.wide(1e-4, 5e-2), over_s: 0.1, meshed }
}

impl Drawn {
    fn cell(&self, solver: &[String], step_s: f64, mesh: Option<usize>) -> Cell {
        let mut overrides = self.mechanism.clone();
        if let Some(count) = mesh {
            overrides.retain(|given| !given.contains(".elements="));
            overrides.extend(["crank", "rod"].map(|link| format!("{link}.elements={count}")));
        }
        overrides.extend_from_slice(solver);
        overrides.push(format!("solver.step_s={step_s:?}"));
        let steps = ((self.over_s / step_s).round() as u64).max(1);
        let measure = if self.meshed { Measure::Length } else { Measure::Travel };
        Cell { overrides, steps, reference: None, measure, switch: None }
    }

    fn esdirk(&self, steps: u32) -> Cell {
        let solver = words(&["solver.integrator=esdirk", "solver.tolerance=1e-12"]);
        self.cell(&solver, self.over_s / f64::from(steps), None)
    }
}

/// Runs cells against the reference.
fn run(base: &BaseScene, drawn: &Drawn, cells: Vec<Cell>) -> Vec<Outcome> {
    let values = (0..cells.len()).map(|n| n as f64).collect();
    let quantity = |name| Quantity { name, words: name, unit: "" };
    let (x, y) = (Axis::new(quantity("cell"), Spacing::Listed, values), Axis::new(quantity("one"), Spacing::Listed, vec![0.0]));
    let cells = cells.into_iter().map(|cell| Cell { reference: Some(0), ..cell }).collect();
    let map = Map { name: "labels".into(), title: "labels".into(), x, y, cells };
    let reference = drawn.cell(&words(&["solver.integrator=esdirk"]), drawn.over_s / 6000.0, drawn.meshed.then_some(8));
    let plan = MapPlan { maps: vec![map], references: vec![reference] };
    let one = NonZero::<usize>::MIN;
    let mut swept = sweep(base, plan, one, Duration::from_secs(600), |_| ControlFlow::Continue(()));
    swept.pop().map(|swept| swept.outcomes).unwrap_or_default()
}

/// The same cell at fine steps of two schemes: the label if the mechanism does not amplify, and whether its motion ends by itself.
fn fine(base: &BaseScene, drawn: &Drawn, category: Category, ended_s: f64) -> (Option<Label>, bool) {
    let solver = words(&["solver.integrator=generalized-alpha", "solver.rho_infinity=0.8"]);
    let esdirk = words(&["solver.integrator=esdirk"]);
    let fine = [4000.0, 12000.0].map(|steps| drawn.cell(&solver, drawn.over_s / steps, None));
    let cells = [&fine[..], &[drawn.cell(&esdirk, drawn.over_s / 3000.0, None)]].concat();
    let ends = run(base, drawn, cells);
    let all = |of: &dyn Fn(&Outcome) -> bool| ends.iter().all(of);
    let near = |one: f64, other: f64| (one / other - 1.0).abs() < 0.2;
    let last = &ends[2];
    if all(&|end| end.category == Category::Stable) {
        return (Some(Label::Scheme), false);
    }
    let goes_on = |end: &Outcome| end.category != Category::Diverged || end.sim_time_s > 1.1 * ended_s;
    if category == Category::Diverged && all(&goes_on) {
        return (Some(Label::Scheme), false);
    }
    if all(&|end| end.category == Category::Diverged && near(end.sim_time_s, last.sim_time_s) && end.step > 50) {
        return ((last.sim_time_s <= 1.02 * ended_s).then_some(Label::Model), true);
    }
    let error = |end: &Outcome| end.error.unwrap_or(f64::NAN);
    let alike = |end: &Outcome| near(error(end), error(last)) || error(end).max(error(last)) < 0.01;
    let equally_wrong = category == Category::Wrong && all(&|end| end.category == Category::Wrong && alike(end));
    (equally_wrong.then_some(Label::Model), false)
}

/// The square root of the energy of a difference; see `Growth`.
struct Energy {
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
}

impl Energy {
    fn new(mechanism: &mut dyn Mechanism, motion: &Motion, over_s: f64) -> Self {
        let still = vec![0.0; motion.q.len()];
        let Motion { input, q, .. } = motion.clone();
        let of = Linearised::new(mechanism, &Point { input, q, v: still.clone(), a: still, speed_rad_per_s: 0.0 });
        let dense = of.stiffness.dense();
        let eigen = ((&dense + dense.transpose()) * 0.5).symmetric_eigen();
        let positive = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.max(0.0)));
        let mass = of.mass.dense();
        let stiffness = &eigen.eigenvectors * positive * eigen.eigenvectors.transpose() + &mass / (over_s * over_s);
        Energy { mass, stiffness }
    }

    fn size(&self, q: &DVector<f64>, v: &DVector<f64>) -> f64 {
        (q.dot(&(&self.stiffness * q)) + v.dot(&(&self.mass * v))).max(0.0).sqrt()
    }

    /// A difference of this size whose direction is random in the norm.
    fn random(&self, random: &mut Random, size: f64) -> Option<[DVector<f64>; 2]> {
        let n = self.mass.nrows();
        let mut draw = |matrix: &DMatrix<f64>| {
            let mut x = DVector::from_fn(n, |_, _| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0);
            matrix.clone().cholesky()?.l().transpose().solve_upper_triangular_mut(&mut x).then_some(x)
        };
        let [q, v] = [draw(&self.stiffness)?, draw(&self.mass)?];
        let scale = size / self.size(&q, &v);
        Some([q * scale, v * scale])
    }
}

/// A simulation that begins a little beside the scene's start.
fn beside(scene: &Scene, start: &Motion, [q, v]: &[DVector<f64>; 2]) -> Option<Simulation> {
    let mut simulation = Simulation::new(scene).ok()?;
    let n = q.len();
    let Checkpoint { mut state, .. } = simulation.checkpoint();
    for i in 0..n {
        state[i] = start.q[i] + q[i];
        state[n + i] = start.v[i] + v[i];
    }
    let moved = Checkpoint { state: state.clone(), ..simulation.checkpoint() };
    simulation.restore(&moved).then_some(())?;
    let a = simulation.motion()?.a;
    state[2 * n..3 * n].copy_from_slice(&a);
    state[3 * n..4 * n].copy_from_slice(&a);
    let moved = Checkpoint { state, ..moved };
    simulation.restore(&moved).then_some(simulation)
}

/// Growth of random differences.
struct Grown {
    /// The largest, over the turns of a free crank.
    growth: f64,
    /// Components of a difference.
    components: usize,
    /// Whether the motion went on to the end.
    whole: bool,
}

/// The largest growth of a few random differences up to a time, or as far as the motion goes.
fn grown(base: &BaseScene, drawn: &Drawn, steps: u32, ended_s: f64) -> Option<Grown> {
    let scene = SceneSource::parse("cell", &base.text, &drawn.esdirk(steps).overrides).ok()?.scene;
    let mut mechanism = Subject::new(&scene, None).ok()?.mechanism();
    let mut centre = Simulation::new(&scene).ok()?;
    let start = centre.motion()?;
    let n = start.q.len();
    let mut grown = Grown { growth: 1.0, components: 2 * n, whole: n == 0 };
    let energy = Energy::new(mechanism.as_mut(), &start, drawn.over_s);
    let mut random = Random(7);
    let small = 1e-7 * (0.5 * size_of(&start, &energy, &scene, steps)?).max(1e-9);
    let mut neighbours = Vec::new();
    for _ in 0..if n == 0 { 0 } else { 4 } {
        neighbours.push(beside(&scene, &start, &energy.random(&mut random, small)?)?);
    }
    let (mut turned, mut before) = (0.0, start.q.first().copied().unwrap_or_default());
    while !grown.whole {
        if centre.step().is_err() || neighbours.iter_mut().any(|neighbour| neighbour.step().is_err()) {
            break;
        }
        let Some(here) = centre.motion() else { break };
        turned += (here.q[0] - before).abs();
        before = here.q[0];
        grown.whole = centre.time_s() >= ended_s * (1.0 - 1e-9);
        // The difference of few unknowns swings within a sixty-fourth.
        let every = if n <= 4 { 1 } else { u64::from(steps / 64) };
        if centre.step_count() % every == 0 || grown.whole {
            let energy = Energy::new(mechanism.as_mut(), &here, drawn.over_s);
            let turns = if here.input.motion.is_none() { turned / std::f64::consts::TAU } else { 0.0 };
            for neighbour in &mut neighbours {
                let there = neighbour.motion()?;
                let difference = |a: &[f64], b: &[f64]| DVector::from_fn(n, |i, _| a[i] - b[i]);
                let size = energy.size(&difference(&there.q, &here.q), &difference(&there.v, &here.v));
                grown.growth = grown.growth.max(size / small / turns.max(1.0));
            }
        }
    }
    Some(grown)
}

/// The largest energy norm of the motion itself, from rest.
fn size_of(start: &Motion, energy: &Energy, scene: &Scene, steps: u32) -> Option<f64> {
    let mut simulation = Simulation::new(scene).ok()?;
    let size = |simulation: &mut Simulation| {
        let v = DVector::from_vec(simulation.motion()?.v);
        Some(energy.size(&DVector::zeros(start.q.len()), &v))
    };
    let mut most = size(&mut simulation)?;
    for _ in 0..steps / 4 {
        if simulation.step().is_err() {
            break;
        }
        most = most.max(size(&mut simulation)?);
    }
    Some(most)
}

/// Brute force's label, where it decides: a random difference that grows by 1.5 [`BOUND`] is the mechanism; none that grows by more than
/// `BOUND` over the root of the number of components is not.
fn brute_force(base: &BaseScene, drawn: &Drawn, end: &Outcome) -> (Option<Label>, Option<f64>) {
    let ended_s = if end.category == Category::Diverged { end.sim_time_s + drawn.step_s } else { drawn.over_s };
    let ended_s = ended_s.min(drawn.over_s);
    let near = |one: f64, other: f64| (one / other - 1.0).abs() < 0.1;
    let mut before: Option<f64> = None;
    let mut below = true;
    for steps in [512, 1024, 2048, 4096] {
        let Some(Grown { growth, components, whole }) = grown(base, drawn, steps, ended_s) else { return (None, None) };
        let stays = growth * (components as f64).sqrt() < BOUND;
        if before
            .is_some_and(|before| before.min(growth) > 1.5 * BOUND && (near(before, growth) || before.min(growth) > 3.0 * BOUND))
        {
            return (Some(Label::Mechanism), Some(growth));
        }
        if whole && before.is_some_and(|before| near(before, growth)) {
            return (stays.then(|| fine(base, drawn, end.category, ended_s).0).flatten(), Some(growth));
        }
        (before, below) = (Some(growth), stays);
    }
    // The motion itself ends before it has grown.
    let (label, ends) = fine(base, drawn, end.category, ended_s);
    (label.filter(|_| ends && below), before)
}

/// A number from the environment: `FLEXCRANK_LABELS=200` judges 200 failed cells, `FLEXCRANK_LABELS_SEED` draws others.
fn given(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|given| given.parse().ok()).unwrap_or(usual)
}

/// The label, or with `FLEXCRANK_LABELS_FAULT` always the scheme: then the test must fail.
fn planted(label: Label) -> Label {
    if std::env::var_os("FLEXCRANK_LABELS_FAULT").is_some() { Label::Scheme } else { label }
}

#[test]
fn prop_labels_agree_with_brute_force() -> Tried {
    let base = BaseScene::new(&SceneSource::open("crank-slider", &[])?)?;
    let mut random = Random(given("FLEXCRANK_LABELS_SEED", 16));
    let count = given("FLEXCRANK_LABELS", 40);
    let (mut failed, mut decided, mut labelled, mut disagree) = (0_u64, 0_u64, 0_u64, Vec::new());
    let mut table = std::collections::BTreeMap::new();
    while failed < count {
        let drawn = drawn(&mut random);
        let Some(end) = run(&base, &drawn, vec![drawn.cell(&drawn.solver, drawn.step_s, None)]).pop() else { continue };
        let Some(label) = end.label.map(planted) else { continue };
        failed += 1;
        let (brute, growth) = brute_force(&base, &drawn, &end);
        *table.entry((end.category, brute, label)).or_insert(0) += 1;
        let Some(brute) = brute else { continue };
        decided += 1;
        labelled += u64::from(label != Label::Undecided);
        if label != brute && label != Label::Undecided {
            disagree.push(format!(
                "{label:?} ({:?}), brute force {brute:?} ({growth:?}): {:?} error {:?} t {} step {} {} {:?} {:?}",
                end.growth, end.category, end.error, end.sim_time_s, drawn.step_s, end.message, drawn.mechanism, drawn.solver
            ));
        }
    }
    println!("(category, brute force, label) of {failed} cells, {decided} decided by brute force, {labelled} of these labelled");
    table.iter().for_each(|(kinds, count)| println!("{count:>5} {kinds:?}"));
    assert!(disagree.is_empty(), "{} of {decided} disagree:\n{}", disagree.len(), disagree.join("\n"));
    assert!(4 * decided >= 3 * failed, "brute force decides {decided} of {failed} only");
    assert!(10 * labelled >= 9 * decided, "{labelled} of {decided} are labelled");
    Ok(())
}
