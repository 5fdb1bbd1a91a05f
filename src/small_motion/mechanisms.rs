//! Tests of periodic motion on mechanisms.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::error::FloquetError;
use super::examples::{chain, finite_elements, modal};
use super::floquet::{Accuracy, Floquet, eigenvector, of_physics, of_scheme};
use super::orbit::{Cycle, Guess, OrbitSettings, periodic_orbit};
use super::periodic::{CrankDrive, DrivenMechanism};
use super::scheme::Scheme;
use super::variation::{TIGHT, Trajectory};
use crate::integrate::{State, System, Taken};
use crate::mechanics::{Input, Mechanism, Rigid};

type Tested = Result<(), Box<dyn std::error::Error>>;

const SPEED: f64 = 12.0;
const PERIOD_S: f64 = TAU / SPEED;
const STEADY: CrankDrive = CrankDrive::Speed { start_rad: 0.3, speed_rad_per_s: SPEED };
/// A crank-slider whose vibrations are slow enough for all of them to be resolved.
const SLOW: [&str; 4] = ["crank.rigid=true", "rod.axial=false", "rod.damping_s=1e-4", "rod.modes=2"];

/// As if the links were rigid and the crank turned at the speed.
fn rigid_guess<M: Mechanism>(mechanism: &mut M, drive: CrankDrive) -> Result<Guess, Box<dyn std::error::Error>> {
    let n = mechanism.degrees_of_freedom();
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let input: Input = DrivenMechanism::new(mechanism, drive).input(0.0);
    mechanism.start(&input, &mut q, &mut v).map_err(|_| "no start")?;
    mechanism.rigid_motion(&input, SPEED, &q, &mut v, &mut a);
    Ok(Guess { q, v, advance: None })
}

fn physics<M: Mechanism>(mechanism: &mut M, drive: CrankDrive) -> Result<Floquet, Box<dyn std::error::Error>> {
    let guess = rigid_guess(mechanism, drive)?;
    let (accuracy, settings) = (Accuracy { most_steps: 4096, ..Accuracy::default() }, OrbitSettings::default());
    Ok(of_physics(&mut DrivenMechanism::new(mechanism, drive), PERIOD_S, &guess, &accuracy, &settings)?)
}

/// Liouville's formula: the product of the multipliers is `exp(−∫ tr(M⁻¹ D) dt)` over a period.
#[test]
fn val_the_product_of_multipliers_of_a_crank_slider_is_that_of_liouville() -> Tested {
    let mut mechanism = modal(&chain("crank-slider", &SLOW)?, true);
    let found = physics(&mut mechanism, STEADY)?;
    assert!(found.orbit.residual <= 1e-10 && found.error() <= 1e-8, "{:e} {:e}", found.orbit.residual, found.error());
    let product: Complex<f64> = found.multipliers.iter().map(|multiplier| multiplier.value).product();
    let mut system = DrivenMechanism::new(&mut mechanism, STEADY);
    let mut trajectory = Trajectory::new(Scheme::Esdirk, system.degrees_of_freedom(), TIGHT);
    trajectory.begin(&mut system, 0.0, &[found.orbit.q.clone(), found.orbit.v.clone()].concat())?;
    let (mut sum, h_s) = (0.0, found.orbit.cycle.step_s());
    for step in 0..found.orbit.cycle.steps {
        trajectory.step(&mut system, f64::from(step) * h_s, h_s)?;
        // The trapezoidal rule over a period is as good as the motion.
        sum += h_s * trajectory.damping_trace().ok_or("singular")?;
    }
    assert!((product / (-sum).exp() - 1.0).norm() < 1e-6, "{product} for {}", (-sum).exp());
    Ok(())
}

/// Every scheme finds the motion of finite elements at a constant speed.
#[test]
fn val_orbits_of_finite_elements_repeat_to_rounding() -> Tested {
    let mut mechanism = finite_elements(&chain("crank-slider", &["crank.elements=2", "rod.elements=2"])?, true);
    let guess = rigid_guess(&mut mechanism, STEADY)?;
    let mut system = DrivenMechanism::new(&mut mechanism, STEADY);
    for scheme in [Scheme::Esdirk, Scheme::TwoPoint(0.5), Scheme::TwoPoint(1.0), Scheme::GeneralizedAlpha(0.6)] {
        let cycle = Cycle { period_s: PERIOD_S, steps: 400 };
        let orbit = periodic_orbit(&mut system, scheme, cycle, &guess, &OrbitSettings::default())?;
        assert!(orbit.residual <= 1e-10, "{scheme:?}: {:e}", orbit.residual);
    }
    Ok(())
}

/// A free link without weight turns steadily under a torque `d Ω` against its damper.
#[test]
fn val_the_torque_of_a_rotating_link_is_that_of_its_damper() -> Tested {
    let chain = chain("thesis-beam", &["base.damper_nm_s_per_rad=0.7", "base.torsion_spring_nm_per_rad=0"])?;
    let drive = CrankDrive::Torque { torque_nm: 8.0 };
    for (name, found) in
        [("modal", physics(&mut modal(&chain, false), drive)), ("elements", physics(&mut finite_elements(&chain, false), drive))]
    {
        let found = found?;
        assert!((found.orbit.torque_nm.ok_or("no torque")? - 0.7 * SPEED).abs() < 1e-6, "{name}");
    }
    // Nodes move on circles: without a torque and a rate that bring the crank round first, Newton takes many iterations.
    let mut mechanism = finite_elements(&chain, false);
    let guess = rigid_guess(&mut mechanism, drive)?;
    let (cycle, settings) = (Cycle { period_s: PERIOD_S, steps: 256 }, OrbitSettings::default());
    let orbit = periodic_orbit(&mut DrivenMechanism::new(&mut mechanism, drive), Scheme::Esdirk, cycle, &guess, &settings)?;
    assert!(orbit.iterations <= 4, "{}", orbit.iterations);
    Ok(())
}

/// The torque found puts in what friction takes; turning the crank on is a multiplier of 1.
#[test]
fn val_the_torque_of_a_crank_slider_balances_its_friction() -> Tested {
    let chain = chain("crank-slider", &[&SLOW[..], &["slider.friction_n_s_per_m=2.0"]].concat())?;
    let mut mechanism = modal(&chain, false);
    let drive = CrankDrive::Torque { torque_nm: 0.0 };
    let found = physics(&mut mechanism, drive)?;
    let torque_nm = found.orbit.torque_nm.ok_or("no torque")?;
    let mut system = DrivenMechanism::new(&mut mechanism, CrankDrive::Torque { torque_nm });
    let mut integrator = Scheme::Esdirk.integrator(found.orbit.q.len(), TIGHT);
    let mut state = State::new(found.orbit.q.clone(), found.orbit.v.clone());
    let (mut taken, h_s) = (Taken::default(), found.orbit.cycle.step_s());
    integrator.begin(&mut system, 0.0, h_s, &mut state)?;
    for step in 0..found.orbit.cycle.steps {
        taken += integrator.step(&mut system, f64::from(step) * h_s, h_s, &mut state)?;
    }
    assert!((TAU * torque_nm - taken.work.dissipated_j).abs() < 1e-7 * taken.work.dissipated_j, "{:?}", taken.work);
    assert!(found.error() <= 1e-8, "{:e}", found.error());
    let turned_rad = found.orbit.q[0] - rigid_guess(&mut mechanism, drive)?.q[0];
    assert!(turned_rad.abs() < 1e-10, "the search keeps the crank's angle: {turned_rad:e}");
    let one = found.multipliers.iter().map(|multiplier| (multiplier.value - 1.0).norm()).fold(f64::INFINITY, f64::min);
    assert!(one < 1e-7 && !found.is_unstable(), "{:?}", found.multipliers);
    Ok(())
}

/// The rod of a rigid guess has no inertia bend: Newton alone gets nowhere from it.
#[test]
fn regress_a_rigid_guess_is_good_enough_for_finite_elements() -> Tested {
    let mut mechanism = finite_elements(&chain("crank-slider", &[])?, true);
    let guess = rigid_guess(&mut mechanism, STEADY)?;
    let mut system = DrivenMechanism::new(&mut mechanism, STEADY);
    let cycle = Cycle::near(PERIOD_S, 0.008);
    assert_eq!(cycle.steps, 65);
    let orbit = periodic_orbit(&mut system, Scheme::Esdirk, cycle, &guess, &OrbitSettings::default())?;
    assert!(orbit.residual <= 1e-10, "{:e}", orbit.residual);
    Ok(())
}

/// Parametric resonance of an undamped rod: the multiplier found is the growth of a small perturbation, as Runge–Kutta computes both
/// nonlinear motions; and the multipliers are a reciprocal pair, as nothing dissipates.
#[test]
fn val_an_unstable_rod_grows_by_its_multiplier() -> Tested {
    let section = "rod.section={shape=\"rectangle\",width_m=0.01,height_m=0.03}";
    let undamped = ["crank.rigid=true", "rod.axial=false", "rod.damping_s=0", "rod.modes=1", "slider.mass_kg=2.0", section];
    let drive = CrankDrive::Speed { start_rad: 0.3, speed_rad_per_s: 112.0 };
    let period_s = TAU / 112.0;
    let mut mechanism = modal(&chain("crank-slider", &undamped)?, true);
    let guess = rigid_guess(&mut mechanism, drive)?;
    let mut system = DrivenMechanism::new(&mut mechanism, drive);
    let found = of_physics(&mut system, period_s, &guess, &Accuracy::default(), &OrbitSettings::default())?;
    let [first, second] = found.multipliers[..] else { return Err("not one mode".into()) };
    assert!(first.value.norm() > 10.0 && first.is_unstable() && !second.is_unstable(), "{found:?}");
    assert!((first.value * second.value - 1.0).norm() < 1e-7, "{found:?}");
    let mode = eigenvector(&found.orbit.monodromy, first.value).ok_or("no mode")?.map(|x| x.re);
    let mut ends = Vec::new();
    for small in [0.0, 1e-7] {
        let (q, v) = (found.orbit.q[0] + small * mode[0], found.orbit.v[0] + small * mode[1]);
        let (mut state, mut integrator) = (State::new(vec![q], vec![v]), Scheme::RungeKutta.integrator(1, TIGHT));
        let h_s = period_s / 2000.0;
        for step in 0..2000 {
            integrator.step(&mut system, f64::from(step) * h_s, h_s, &mut state)?;
        }
        ends.push([state.q[0], state.v[0]]);
    }
    for (component, mode) in mode.iter().enumerate() {
        let growth = (ends[1][component] - ends[0][component]) / (1e-7 * mode);
        assert!((growth / first.value.re - 1.0).abs() < 1e-4, "{growth} for {}", first.value);
    }
    Ok(())
}

/// At the dead centre, with neither weight nor torque, no force is at work; nor is there one a period later.
#[test]
fn regress_a_start_without_forces_is_periodic() -> Tested {
    let mut mechanism = modal(&chain("crank-slider", &["slider.friction_n_s_per_m=2.0"])?, false);
    let drive = CrankDrive::Torque { torque_nm: 0.0 };
    let guess = rigid_guess(&mut mechanism, drive)?;
    let (cycle, settings) = (Cycle::near(PERIOD_S, 0.004), OrbitSettings::default());
    for scheme in [Scheme::Esdirk, Scheme::TwoPoint(1.0), Scheme::GeneralizedAlpha(0.6)] {
        let found = of_scheme(&mut DrivenMechanism::new(&mut mechanism, drive), scheme, cycle, &guess, &settings)?;
        // Turning the crank on changes nothing but the time, so the multiplier is 1 with any scheme.
        assert!((found.multipliers[0].value - 1.0).norm() < 1e-8 && !found.is_unstable(), "{scheme:?} {found:?}");
    }
    Ok(())
}

/// A spring that winds up is not the same after a turn, though a free state may repeat.
#[test]
fn regress_forces_that_do_not_repeat_are_refused() -> Tested {
    let chain = chain("thesis-beam", &["base.damper_nm_s_per_rad=0.7"])?;
    let found = physics(&mut modal(&chain, false), CrankDrive::Torque { torque_nm: 8.0 });
    let error = found.err().ok_or("found")?.downcast::<FloquetError>()?;
    assert!(matches!(*error, FloquetError::NotPeriodic { mismatch } if mismatch > 0.1), "{error}");
    Ok(())
}

#[test]
fn regress_hopeless_searches_end_in_errors() -> Tested {
    let chain = chain("crank-slider", &SLOW)?;
    let mut mechanism = modal(&chain, true);
    let guess = rigid_guess(&mut mechanism, STEADY)?;
    let mut system = DrivenMechanism::new(&mut mechanism, STEADY);
    let mut search = |guess: &Guess, period_s, steps| {
        let cycle = Cycle { period_s, steps };
        periodic_orbit(&mut system, Scheme::Esdirk, cycle, guess, &OrbitSettings::default())
    };
    assert_eq!(search(&guess, 0.0, 10), Err(FloquetError::NoPeriod));
    assert_eq!(search(&guess, f64::NAN, 10), Err(FloquetError::NoPeriod));
    let short = Guess { q: Vec::new(), ..guess.clone() };
    assert_eq!(search(&short, 1.0, 10), Err(FloquetError::WrongLength { given: 0, needed: guess.q.len() }));
    let lost = Guess { q: vec![f64::NAN; guess.q.len()], ..guess.clone() };
    assert!(matches!(search(&lost, PERIOD_S, 10), Err(FloquetError::Step { .. })));
    // Half a turn is no period of a crank-slider.
    assert!(matches!(search(&guess, 0.5 * PERIOD_S, 100), Err(FloquetError::NotPeriodic { .. })));
    Ok(())
}

/// Rigid links at a prescribed speed have no unknowns, and nothing to perturb.
#[test]
fn regress_no_unknowns_have_no_multipliers() -> Tested {
    let found = physics(&mut Rigid::new(&chain("crank-slider", &[])?, true), STEADY)?;
    assert!(found.multipliers.is_empty() && !found.is_unstable() && found.orbit.residual == 0.0, "{found:?}");
    Ok(())
}
