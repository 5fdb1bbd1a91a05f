//! Conservation: energy, momentum, strain.

use std::f64::consts::TAU;

use flexcrank::scene::PulseShape;
use flexcrank::simulation::{PulseRequest, Simulation};

use crate::bench::{FINITE, MIDPOINT, MODAL, RIGID, energy_j, largest, look, run_to, simulation};
use crate::chains::{Kind, Shape};

/// R2s after its pulse, by the implicit midpoint rule: the error of the energy over 100 revolutions stays small, and the second
/// half shows no more of it than the first, neither in its mean nor in its extremes.
#[test]
fn prop_energy_is_kept_over_100_revolutions() {
    for model in [RIGID, MODAL, FINITE] {
        let mut run = simulation("ref-r2s", &[model, MIDPOINT[0], MIDPOINT[1], "solver.step_s=1e-4"]);
        run_to(&mut run, 0.1);
        let before = energy_j(look(&mut run));
        let (mut first, mut second) = (Vec::new(), Vec::new());
        loop {
            (0..50).for_each(|_| run.step().unwrap());
            let seen = look(&mut run);
            let error = energy_j(seen) / before - 1.0;
            match seen.links[0].chord_rad / TAU {
                turns if turns < 50.0 => first.push(error),
                turns if turns < 100.0 => second.push(error),
                _ => break,
            }
        }
        let worst = [&first, &second].map(|half| largest(half.iter().copied()));
        let mean = [&first, &second].map(|half| half.iter().sum::<f64>() / half.len() as f64);
        assert!(worst[0] < 1e-5 && worst[1] < 1e-5, "{model}: {worst:?}");
        assert!(worst[1] < 1.1 * worst[0] && (mean[1] - mean[0]).abs() < 0.1 * worst[0], "{model}: {worst:?}, means {mean:?}");
    }
}

/// The default scene as it comes, and its rod given more damping and its slider friction: at every look the balance is what the scheme
/// alone lost, a part of 2.6e-6 at 2 ms of which nearly all goes in the pulse.
#[test]
fn val_the_energy_of_the_default_scene_is_what_was_put_in() {
    for lossy in [&[][..], &["rod.damping_s=1e-3", "slider.friction_n_s_per_m=0.5"]] {
        for (step, bound) in [("solver.step_s=2e-3", 1e-5), ("solver.step_s=1e-3", 1e-6)] {
            let mut run = simulation("crank-slider", &[lossy, &[step]].concat());
            let mut worst = 0.0_f64;
            for k in 1..=500 {
                run_to(&mut run, 0.04 * f64::from(k));
                look(&mut run);
                let ledger = run.ledger();
                worst = worst.max((ledger.balance_error_j / ledger.in_play_j).abs());
            }
            println!("{lossy:?} {step}: {worst:e}");
            assert!(worst < bound, "{lossy:?}, {step}: {worst:e}");
        }
    }
}

/// Ten minutes of the default scene as it stands: the balance in the guide.
#[test]
fn val_the_energy_of_ten_minutes_of_the_default_scene_is_what_was_put_in() {
    let mut run = simulation("crank-slider", &[]);
    let mut worst = 0.0_f64;
    while run.time_s() < 600.0 - 1e-9 {
        (0..500).for_each(|_| run.step().unwrap());
        let ledger = run.ledger();
        worst = worst.max((ledger.balance_error_j / ledger.in_play_j).abs());
    }
    assert!(worst < 1e-5, "{worst:e}");
    let ends_j = run.ledger().balance_error_j.abs();
    assert!((3e-6..3e-5).contains(&ends_j), "{ends_j:e} J; the guide says 1e-5 J");
}

/// Thirty pulses to and fro on the default scene as it stands, some ending near standstill with nearly all of the energy in the strain.
/// The edges of a rectangle ring what a step of 2 ms does not resolve and forgets: 1.3e-2 of the energy in play.
#[test]
fn regress_energy_is_balanced_through_many_pulses() {
    for (torque_nm, shape, bound) in [
        (1.0, PulseShape::RaisedCosine, 1e-6),
        (5.0, PulseShape::RaisedCosine, 1e-6),
        (1.0, PulseShape::Rectangular, 2e-2),
        (5.0, PulseShape::Rectangular, 2e-2),
    ] {
        let mut run = simulation("crank-slider", &["pulse=[]"]);
        for n in 0..30_u32 {
            let (torque_nm, delay_s) = (if n % 2 == 0 { torque_nm } else { -torque_nm }, 0.8 * f64::from(n));
            run.add_pulse(&PulseRequest { torque_nm, duration_s: 0.1, delay_s, shape }).unwrap();
        }
        while run.time_s() < 24.0 {
            run.step().unwrap();
        }
        let ledger = run.ledger();
        let worst = ledger.worst_balance_j / ledger.in_play_j;
        println!("{torque_nm} N·m, {shape:?}: {worst:e} of {} J", ledger.in_play_j);
        assert!(worst < bound, "{torque_nm} N·m, {shape:?}: {worst:e} of {} J", ledger.in_play_j);
    }
}

/// Sum of the external forces (weight left out) and first moment of mass, along one axis, from an observation.
///
/// With gravity `g` along that axis alone the potential energy is `−g ∫ x dm`, exactly as the model has it.
fn force_and_moment(run: &mut Simulation, axis: usize, gravity: f64) -> [f64; 2] {
    let seen = look(run);
    let mut force = seen.pivot_n.unwrap()[axis];
    if axis == 0 {
        let slide = seen.links.last().unwrap().nodes.last().unwrap().velocity_m_per_s[0];
        force -= seen.resistance_n.map_or(0.0, |resistance| resistance + 3.0 * slide);
    } else {
        force += seen.guide_n.unwrap_or(0.0);
    }
    [force, -seen.energy.potential_j.unwrap() / gravity]
}

/// Largest difference between the rate of change of momentum, from three moments of mass a step apart, and the external forces,
/// over the largest of these.
fn imbalance(text: &str, overrides: &[&str], axis: usize, step_s: f64) -> f64 {
    let gravity = [0.5, -9.81];
    let other = if axis == 0 { "gravity.y_m_per_s2=0.0" } else { "gravity.x_m_per_s2=0.0" };
    let step = format!("solver.step_s={step_s}");
    let mut run = simulation(text, &[overrides, &[&step, other]].concat());
    let mass = total_mass(text);
    let (mut error, mut most) = (0.0_f64, 0.0_f64);
    for time_s in [0.12, 0.15, 0.18] {
        run_to(&mut run, time_s - step_s);
        let [_, before] = force_and_moment(&mut run, axis, gravity[axis]);
        run.step().unwrap();
        let [force, now] = force_and_moment(&mut run, axis, gravity[axis]);
        run.step().unwrap();
        let [_, after] = force_and_moment(&mut run, axis, gravity[axis]);
        let rate = (after - 2.0 * now + before) / (step_s * step_s);
        error = error.max((rate - force - mass * gravity[axis]).abs());
        most = most.max(force.abs());
    }
    error / most
}

fn total_mass(text: &str) -> f64 {
    let scene = crate::bench::scene(text, &[RIGID]);
    let chain = scene.chain().unwrap();
    let end = match &chain.end {
        flexcrank::scene::End::Free { tip_mass_kg } => *tip_mass_kg,
        flexcrank::scene::End::Slider(slider) => slider.mass_kg,
    };
    chain.links.iter().map(|link| link.mass_kg).sum::<f64>() + end
}

/// The external forces change the momentum, once the pulse is over: to second order in the step, down to rounding.
#[test]
fn prop_external_forces_change_the_momentum() {
    for shape in [Shape::Slider, Shape::Free, Shape::Beam] {
        for (driven, rigid) in [(false, [false; 2]), (true, [false; 2]), (false, [true, false]), (false, [false, true])] {
            let text = Kind { driven, rigid, damped: true, ..Kind::plain(shape) }.toml();
            for (model, axis) in [(RIGID, 0), (RIGID, 1), (MODAL, 0), (MODAL, 1), (FINITE, 0), (FINITE, 1)] {
                for scheme in ["solver.integrator=generalized-alpha", "solver.integrator=esdirk"] {
                    let overrides = [model, scheme, "solver.tolerance=1e-10"];
                    let [coarse, fine] = [1e-4, 5e-5].map(|step_s| imbalance(&text, &overrides, axis, step_s));
                    let order = (coarse / fine).log2();
                    let name = format!("{shape:?} {rigid:?}, driven {driven}, {model}, {scheme}, axis {axis}");
                    assert!(fine < 5e-6 && (order > 1.8 || fine < 2e-7), "{name}: {coarse:e} {fine:e}, order {order:.2}");
                }
            }
        }
    }
}

/// Any angle is as good as zero: no strain, no force in a chain that stands still and straight.
#[test]
fn prop_a_straight_chain_is_unstrained_at_any_angle() {
    for text in [FREE.to_owned(), Kind { rigid: [true, false], ..Kind::plain(Shape::Free) }.toml()] {
        for model in [MODAL, FINITE] {
            for angle in [-7.0, -3.2, -1.0, 0.3, 1.6, 3.1, 12.0, 1000.0] {
                let still = ["gravity.x_m_per_s2=0", "gravity.y_m_per_s2=0", "start.rate_rad_per_s=0", "base={}"];
                let mut run = simulation(&text, &[&[model, &format!("start.angle_rad={angle}")], &still[..]].concat());
                let seen = look(&mut run);
                let strain = seen.energy.strain_j.unwrap();
                let pull = largest(seen.pivot_n.unwrap());
                assert!(strain < 1e-20 && pull < 1e-8, "{model} at {angle} rad: {strain:e} J, {pull:e} N");
            }
        }
    }
}

/// A free chain of two links in line.
const FREE: &str = "
[crank]
length_m = 0.5
area_m2 = 1e-4
second_moment_m4 = 8.333e-10
density_kg_per_m3 = 7700.0
youngs_modulus_pa = 2.1e11
elements = 4
[rod]
length_m = 1.5
area_m2 = 1e-4
second_moment_m4 = 8.333e-10
density_kg_per_m3 = 7700.0
youngs_modulus_pa = 2.1e11
elements = 4
[tip]
mass_kg = 0.5
[start]
angle_rad = 0.3
";

/// Turning freely, a chain in line stretches by its centrifugal forces and does nothing else: over a whole turn its strain stays
/// below four times `∫ N²/(2EA) ds` (a load that is there at once stretches twice as far as it does at rest).
#[test]
fn prop_rotation_of_a_free_chain_makes_no_strain() {
    let (rate, per_length, tip) = (0.05_f64, 0.77, 0.5);
    let pull = |x: f64| rate * rate * (per_length * (4.0 - x * x) / 2.0 + tip * 2.0);
    let centrifugal_j: f64 = (0..2000).map(|k| pull((k as f64 + 0.5) * 1e-3).powi(2) * 1e-3 / (2.0 * 2.1e7)).sum();
    for (model, most_j) in [(MODAL, 1e-30), (FINITE, 4.0 * centrifugal_j)] {
        let mut run = simulation(FREE, &[model, "start.rate_rad_per_s=0.05", "solver.step_s=0.02"]);
        let mut strain_j = 0.0_f64;
        while run.time_s() < TAU / rate {
            run.step().unwrap();
            strain_j = strain_j.max(look(&mut run).energy.strain_j.unwrap());
        }
        let turned = [0, 1].map(|k| run.observation().links[k].chord_rad - 0.3 - rate * run.time_s());
        assert!(strain_j < most_j, "{model}: {strain_j:e} J of {centrifugal_j:e} J");
        let second_order = TAU * (rate * run.step_s()).powi(2);
        assert!(largest(turned) < second_order, "{model}: {turned:?}");
    }
}
