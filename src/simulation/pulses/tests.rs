//! Pulses against 200-digit arithmetic, and the laws that their means and rises keep.

use super::*;
use crate::scene::{Scene, SceneSource};
use crate::simulation::{Route, Simulation};

const SHAPES: [PulseShape; 2] = [PulseShape::Rectangular, PulseShape::RaisedCosine];

fn one(pulse: Pulse) -> Pulses {
    let mut pulses = Pulses::default();
    pulses.push(pulse);
    pulses
}

/// Rows of `tests/data/pulses.csv`: the pulse, `[from, to]`, mean and rise.
fn rows() -> impl Iterator<Item = (Pulse, [f64; 2], [f64; 2])> {
    include_str!("../../../tests/data/pulses.csv").lines().skip(1).map(|line| {
        let (shape, numbers) = line.split_once(',').unwrap();
        let numbers: Vec<f64> = numbers.split(',').map(|number| number.parse().unwrap()).collect();
        let [start_s, duration_s, torque_nm, from_s, to_s, mean, rise] = numbers[..] else { panic!("{line}") };
        let shape = if shape == "rectangular" { PulseShape::Rectangular } else { PulseShape::RaisedCosine };
        (Pulse { start_s, torque_nm, duration_s, shape }, [from_s, to_s], [mean, rise])
    })
}

/// Both to 2e-15 of themselves. Where the step holds an edge of the pulse, the overlap's own rise and the moment of its mean about
/// the step's middle may cancel: there the rise is good to 2e-15 of the mean over the step, or of itself.
#[test]
fn val_mean_and_rise_keep_their_accuracy_from_1e_9_to_1e9_s() {
    let mut count = 0;
    for (pulse, [from_s, to_s], [mean, rise]) in rows() {
        let pulses = one(pulse);
        let (found_mean, found_rise) = (pulses.mean_nm(from_s, to_s), pulses.rise_nm_per_s(from_s, to_s));
        let within = from_s >= pulse.start_s && to_s - pulse.start_s <= pulse.duration_s;
        let scale = if within { rise.abs() } else { rise.abs().max(mean / (to_s - from_s)) };
        assert!((found_mean - mean).abs() <= 2e-15 * mean, "{pulse:?} {from_s} {to_s}: mean {found_mean:e} for {mean:e}");
        assert!((found_rise - rise).abs() <= 2e-15 * scale, "{pulse:?} {from_s} {to_s}: rise {found_rise:e} for {rise:e}");
        count += 1;
    }
    assert!(count > 400, "{count} rows");
}

/// Adds up means times steps until the pulse is over, with what every addition rounds off carried along (Neumaier 1974).
fn impulse_nm_s(pulse: Pulse, step_s: f64) -> f64 {
    let mut pulses = one(pulse);
    let (mut impulse, mut lost, mut n) = (0.0_f64, 0.0, 0.0);
    // Steps that end before it begins give nothing.
    if pulse.start_s > 2.0 * step_s {
        n = (pulse.start_s / step_s).floor() - 1.0;
    }
    while !pulses.is_empty() {
        let (from_s, to_s) = (n * step_s, (n + 1.0) * step_s);
        let more = pulses.mean_nm(from_s, to_s) * (to_s - from_s);
        let sum = impulse + more;
        lost += if impulse.abs() > more.abs() { (impulse - sum) + more } else { (more - sum) + impulse };
        impulse = sum;
        pulses.retire(to_s);
        n += 1.0;
    }
    impulse + lost
}

#[test]
fn prop_impulse_is_exact_whatever_the_step() {
    let cases = [
        // step, duration, start
        (1e-3, 0.1, 0.0),
        (1e-3, 0.37e-3, 1.0003),
        (0.1, 0.05, 0.07),
        (1e-4, 0.123, 2.5),
        (0.3, 10.0, 0.9),
        // A hundred thousand steps and more.
        (1e-4, 10.0, 0.3),
        (7e-6, 1.0, 12.345),
        (10.0, 1e6 + 0.1, 3.3),
        (1e-9, 1.2345e-4, 5e-5),
        // Late, and so short that few clock readings fall within.
        (1e-3, 1e-3, 3e6 + 0.0123),
        (1e-6, 1e-5, 1e4 + 1.23e-7),
        // Within a step.
        (10.0, 1e-12, 0.5),
        (1e-3, 1e-9, 17.0004),
    ];
    for shape in SHAPES {
        for (step_s, duration_s, start_s) in cases {
            let impulse = impulse_nm_s(Pulse { start_s, torque_nm: 5.0, duration_s, shape }, step_s);
            let error = impulse / (5.0 * duration_s) - 1.0;
            assert!(error.abs() <= 1e-14, "{shape:?} {duration_s} s from {start_s} s at {step_s} s: {error:e}");
        }
    }
}

#[test]
fn prop_first_moments_add_up_to_that_of_the_pulse() {
    let pulse = Pulse { start_s: 0.3, torque_nm: 5.0, duration_s: 2.7, shape: PulseShape::RaisedCosine };
    let (step_s, pulses) = (0.07, one(pulse));
    let moment: f64 = (0..50)
        .map(|n| {
            let (from_s, to_s) = (f64::from(n) * step_s, f64::from(n + 1) * step_s);
            let h = to_s - from_s;
            pulses.mean_nm(from_s, to_s) * h * 0.5 * (from_s + to_s) + pulses.rise_nm_per_s(from_s, to_s) * h.powi(3) / 12.0
        })
        .sum();
    let expected = 5.0 * 2.7 * (0.3 + 0.5 * 2.7);
    assert!((moment / expected - 1.0).abs() < 1e-14, "{moment} for {expected}");
}

/// `1 − cos 2πs/D ≈ ½ (2πs/D)²`: ten times the duration, a hundredth of the torque.
#[test]
fn prop_early_torque_goes_as_one_over_the_duration_squared() {
    for duration_s in [1e2, 1e3, 3600.0, 1e5, 1e6, 1e7, 1e9] {
        let pulses = one(Pulse { start_s: 0.0, torque_nm: 20.0, duration_s, shape: PulseShape::RaisedCosine });
        let found = [pulses.mean_nm(0.004, 0.005), pulses.rise_nm_per_s(0.004, 0.005), pulses.value_nm(0.005, 0.005)];
        let turn = 2.0 * PI / duration_s;
        for (found, early) in found.iter().zip([61e-6 / 3.0, 9e-3, 25e-6]) {
            let error = found / (10.0 * turn * turn * early) - 1.0;
            assert!(error.abs() < (0.005 * turn).powi(2) + 1e-14, "{duration_s} s: {error:e} of {found}");
        }
    }
}

#[test]
fn val_rise_is_that_of_the_first_moment() {
    let pulse = Pulse { start_s: 0.3, torque_nm: 5.0, duration_s: 0.4, shape: PulseShape::RaisedCosine };
    let pulses = one(pulse);
    for (from_s, to_s) in [(0.0, 0.2), (0.1, 0.5), (0.35, 0.36), (0.4, 0.9), (0.0, 1.0), (0.7, 0.8)] {
        let (n, h) = (100_000_u32, to_s - from_s);
        let moment: f64 = (0..n)
            .map(|k| {
                let s = h * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
                let time_s = 0.5 * (from_s + to_s) + s;
                s * torque_nm(&pulse, time_s, time_s) * h / f64::from(n)
            })
            .sum();
        let (rise, expected) = (pulses.rise_nm_per_s(from_s, to_s), 12.0 * moment / h.powi(3));
        assert!((rise - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{from_s} {to_s}: {rise} {expected}");
    }
}

#[test]
fn val_overlapping_pulses_add() {
    let mut pulses = Pulses::default();
    for _ in 0..2 {
        pulses.push(Pulse { start_s: 0.0, torque_nm: 3.0, duration_s: 1.0, shape: PulseShape::Rectangular });
    }
    assert_eq!(pulses.mean_nm(0.25, 0.5), 6.0);
}

/// A rigid crank-slider with steps of 0.5 ms, pushed for 0.2 s from this hundredth of a second on.
fn pushed(start: u32, torque_nm: f64) -> Scene {
    let pulse = format!("pulse=[{{ start_s = {}, torque_nm = {torque_nm}, duration_s = 0.2 }}]", f64::from(start) / 100.0);
    let overrides = ["solver.step_s=0.0005", "solver.model=rigid", "solver.integrator=runge-kutta", &pulse].map(str::to_owned);
    SceneSource::open("crank-slider", &overrides).unwrap().scene
}

/// Rounding leaves some of these 54 edges before the end of their step, and some behind it.
#[test]
fn regress_a_jump_at_the_end_of_a_step_is_still_to_come() {
    let torque_nm = 0.2;
    for start in 40..67_u32 {
        let mut simulation = Simulation::new(&pushed(start, torque_nm)).unwrap();
        let mut torque_after = |steps: u32| {
            while simulation.step_count() < u64::from(steps) {
                simulation.step().unwrap();
            }
            simulation.law.torque.mean_nm
        };
        let (first, last) = (20 * start, 20 * start + 400);
        let found = [first - 1, first, first + 1, last - 1, last, last + 1].map(&mut torque_after);
        assert_eq!(found, [0.0, 0.0, torque_nm, torque_nm, torque_nm, 0.0], "{start}");
    }
}

/// A changed scene begins behind the jump.
#[test]
fn regress_a_scene_that_changes_at_a_jump_begins_with_the_torque_behind_it() {
    let torque_nm = 0.2;
    for start in 40..67_u32 {
        let scene = pushed(start, torque_nm);
        for (steps, expected) in [(20 * start, torque_nm), (20 * start + 400, 0.0)] {
            let (mut simulation, mut next) = (Simulation::new(&scene).unwrap(), Simulation::new(&scene).unwrap());
            (0..steps).for_each(|_| simulation.step().unwrap());
            simulation.change_to(&mut next, &mut Route::new(&scene, &scene).unwrap()).unwrap();
            assert_eq!(simulation.law.torque.mean_nm, expected, "{start} {steps}");
        }
    }
}
