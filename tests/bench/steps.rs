//! Cost of steps, observations and messages, by model and size: `cargo bench`.
//!
//! Times are for a batch; rates are steps, observations or messages per second. With finite elements the rate counts elements: it
//! stays the same from a few elements to a thousand if the cost is linear in them. A short run: `cargo bench --bench steps -- --max-time 0.05`;
//! one bench: `cargo bench --bench steps -- finite_element`.
#![allow(clippy::unwrap_used, reason = "a benchmark may fail")]

use std::time::SystemTime;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use flexcrank::scene::SceneSource;
use flexcrank::simulation::{Sample, SampleContext, Simulation, Stamp};
use flexcrank::wire::{Angles, Displacements, Energies, Loads};
use prost::Message;

fn main() {
    divan::main();
}

/// Items timed at once: enough for caches and clock alike.
const ITEMS: usize = 100;

/// Times `work`, counted as `items` items.
fn repeat<T>(bencher: Bencher<'_, '_>, items: usize, mut work: impl FnMut() -> T) {
    let repeats = (ITEMS / items).max(1);
    bencher.counter(ItemsCount::new(repeats * items)).bench_local(|| {
        for _ in 0..repeats {
            black_box(work());
        }
    });
}

/// Run into the middle of its pulse.
fn moving(overrides: &[String]) -> Simulation {
    let scene = SceneSource::open("ref-r2s", overrides).unwrap().scene;
    let mut simulation = Simulation::new(&scene).unwrap();
    while simulation.time_s() < 0.05 {
        simulation.step().unwrap();
    }
    simulation
}

fn overrides(model: &str, more: &[String]) -> Vec<String> {
    [&[format!("solver.model={model}"), "solver.step_s=1e-4".to_owned()], more].concat()
}

fn both(key: &str, value: usize) -> [String; 2] {
    ["crank", "rod"].map(|link| format!("{link}.{key}={value}"))
}

#[divan::bench(args = ["runge-kutta", "two-point", "generalized-alpha"])]
fn step_rigid(bencher: Bencher<'_, '_>, integrator: &str) {
    let mut simulation = moving(&overrides("rigid", &[format!("solver.integrator={integrator}")]));
    repeat(bencher, 1, || simulation.step().unwrap());
}

/// As the thesis runs it.
#[divan::bench]
fn step_incremental(bencher: Bencher<'_, '_>) {
    let mut simulation = Simulation::new(&SceneSource::open("thesis-crank-slider", &[]).unwrap().scene).unwrap();
    repeat(bencher, 1, || simulation.step().unwrap());
}

#[divan::bench(args = [1, 2, 3, 4, 5, 6])]
fn step_modal(bencher: Bencher<'_, '_>, modes: usize) {
    let mut simulation = moving(&overrides("modal", &both("modes", modes)));
    repeat(bencher, 1, || simulation.step().unwrap());
}

/// By elements per link; the elements of both links are counted.
#[divan::bench(args = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000], max_time = 2)]
fn step_finite_element(bencher: Bencher<'_, '_>, elements: usize) {
    let mut simulation = moving(&overrides("finite-element", &both("elements", elements)));
    repeat(bencher, 2 * elements, || simulation.step().unwrap());
}

type Messages = (Displacements, Angles, Loads, Energies);

fn messages(context: &SampleContext, sample: &Sample) -> Messages {
    (context.displacements(sample), context.angles(sample), context.loads(sample), context.energies(sample))
}

/// A running mechanism with this many elements per link, and the facts that its samples leave out.
fn told(elements: usize) -> (Simulation, SampleContext, Sample) {
    let overrides = overrides("finite-element", &both("elements", elements));
    let scene = SceneSource::open("ref-r2s", &overrides).unwrap().scene;
    let mut simulation = moving(&overrides);
    let observation = simulation.observe().unwrap().clone();
    let wall = SystemTime::UNIX_EPOCH;
    let stamp = Stamp { step: simulation.step_count(), epoch: 0, sim_time_s: 0.05, epoch_start_s: 0.0, wall };
    let context = SampleContext::new(&scene.system, &observation, None);
    let ledger = simulation.ledger();
    (simulation, context, Sample { stamp, driving_torque_nm: 1.0, observation, ledger })
}

/// From the state to an observation and its messages.
#[divan::bench(args = [4, 8, 64])]
fn snapshot(bencher: Bencher<'_, '_>, elements: usize) {
    let (mut simulation, context, mut sample) = told(elements);
    repeat(bencher, 1, || {
        sample.observation.clone_from(simulation.observe().unwrap());
        messages(&context, &sample)
    });
}

/// From messages to protobuf.
#[divan::bench(args = [4, 8, 64])]
fn encoding(bencher: Bencher<'_, '_>, elements: usize) {
    let (_, context, sample) = told(elements);
    let (displacements, angles, loads, energies) = messages(&context, &sample);
    repeat(bencher, 1, || {
        (displacements.encode_to_vec(), angles.encode_to_vec(), loads.encode_to_vec(), energies.encode_to_vec())
    });
}
