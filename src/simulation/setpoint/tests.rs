//! Setpoints: exact impulses, the watchdog, checkpoints and refusals.

use super::*;
use crate::scene::SceneSource;
use crate::simulation::PulseRequest;

const INTEGRATORS: [(&str, &str); 3] = [("rigid", "runge-kutta"), ("modal", "esdirk"), ("modal", "generalized-alpha")];

fn simulation(overrides: &[&str]) -> Simulation {
    let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
    Simulation::new(&SceneSource::open("crank-slider", &overrides).unwrap().scene).unwrap()
}

fn free(model: &str, integrator: &str, step_s: f64) -> Simulation {
    let keys = [format!("solver.model={model}"), format!("solver.integrator={integrator}"), format!("solver.step_s={step_s}")];
    let keys: Vec<&str> = keys.iter().map(String::as_str).chain(["pulse=[]"]).collect();
    simulation(&keys)
}

fn set(simulation: &mut Simulation, torque_nm: f64, hold_s: f64) -> Result<Effective, PulseRefused> {
    simulation.set_torque(&SetpointRequest { torque_nm, hold_s })
}

/// Angular impulse of the next `steps`, N·m·s.
fn impulse_nm_s(simulation: &mut Simulation, steps: u32) -> f64 {
    let step = |_| {
        simulation.step().unwrap();
        simulation.take_mean_torque_nm() * simulation.step_s()
    };
    (0..steps).map(step).sum()
}

#[test]
fn prop_a_setpoint_that_is_replaced_leaves_the_exact_impulse() {
    for (model, integrator) in INTEGRATORS {
        let mut simulation = free(model, integrator, 1e-3);
        let mut impulse = 0.0;
        for (torque_nm, steps) in [(3.0, 7), (-2.0, 1), (0.5, 20), (-0.25, 3)] {
            let effective = set(&mut simulation, torque_nm, 10.0).unwrap();
            assert_eq!(effective.step, simulation.step_count() + 1);
            impulse += impulse_nm_s(&mut simulation, steps);
        }
        let expected = 1e-3 * (3.0 * 7.0 - 2.0 + 0.5 * 20.0 - 0.25 * 3.0);
        assert!((impulse / expected - 1.0).abs() < 1e-14, "{model} {integrator}: {impulse} for {expected}");
        assert_eq!(simulation.setpoint().expirations, 0);
    }
}

#[test]
fn prop_a_hold_that_ends_inside_a_step_leaves_the_exact_impulse() {
    for (model, integrator) in INTEGRATORS {
        for hold_s in [1e-6, 0.3e-3, 1e-3, 2.5e-3, 0.0123456] {
            let mut simulation = free(model, integrator, 1e-3);
            simulation.step().unwrap();
            simulation.take_mean_torque_nm();
            set(&mut simulation, 4.0, hold_s).unwrap();
            let impulse = impulse_nm_s(&mut simulation, 20);
            let expected = 4.0 * hold_s;
            assert!((impulse / expected - 1.0).abs() < 1e-14, "{model} {integrator} {hold_s} s: {impulse} for {expected}");
            let SetpointState { held, expired, expirations } = *simulation.setpoint();
            assert_eq!((held, expired, expirations), (None, true, 1), "{hold_s} s");
        }
    }
}

/// A setpoint is a pulse that begins now and lasts for its hold: the motion is equal to the bit.
#[test]
fn val_a_setpoint_moves_as_a_rectangular_pulse_of_its_hold() {
    for (model, integrator) in INTEGRATORS {
        let (mut held, mut pushed) = (free(model, integrator, 1e-3), free(model, integrator, 1e-3));
        set(&mut held, 2.0, 0.0333).unwrap();
        let shape = PulseShape::Rectangular;
        pushed.add_pulse(&PulseRequest { torque_nm: 2.0, duration_s: 0.0333, delay_s: 0.0, shape }).unwrap();
        for _ in 0..100 {
            held.step().unwrap();
            pushed.step().unwrap();
        }
        let (held, pushed) = (held.checkpoint(), pushed.checkpoint());
        assert_eq!((held.state, held.ledger, held.delivered), (pushed.state, pushed.ledger, pushed.delivered), "{model}");
    }
}

#[test]
fn prop_the_torque_of_an_advance_covers_exactly_its_steps() {
    for step_s in [1e-3, 2e-3, 1e-4 / 3.0] {
        let mut simulation = free("rigid", "runge-kutta", step_s);
        for n in 1..200_u32 {
            let (torque_nm, steps) = (1.0 - f64::from(n % 3), 1 + n % 7);
            simulation.set_torque_for(torque_nm, steps.into()).unwrap();
            for _ in 0..steps {
                simulation.step().unwrap();
                let mean_nm = simulation.take_mean_torque_nm();
                assert!((mean_nm - torque_nm).abs() <= 1e-15, "{mean_nm} for {torque_nm} in step {}", simulation.step_count());
            }
            assert_eq!(*simulation.setpoint(), SetpointState::default(), "over, and no warning");
        }
        simulation.step().unwrap();
        assert_eq!(simulation.take_mean_torque_nm(), 0.0);
    }
}

/// A forged recording may state any number of steps.
#[test]
fn regress_any_number_of_steps_is_held() {
    let mut simulation = free("rigid", "runge-kutta", 1e-3);
    simulation.step().unwrap();
    for steps in [u64::MAX, 0] {
        simulation.set_torque_for(1.0, steps).unwrap();
        simulation.step().unwrap();
        assert_eq!(simulation.setpoint().held.is_some(), steps > 0);
    }
}

#[test]
fn prop_setpoints_add_to_pulses_and_constant_torque() {
    let mut simulation = simulation(&["solver.step_s=1e-3", "pulse=[]", "torque.constant_nm=0.5"]);
    let shape = PulseShape::RaisedCosine;
    simulation.add_pulse(&PulseRequest { torque_nm: 3.0, duration_s: 0.02, delay_s: 0.001, shape }).unwrap();
    set(&mut simulation, -1.0, 0.01).unwrap();
    let impulse = impulse_nm_s(&mut simulation, 40);
    assert!((impulse - (0.5 * 0.04 + 3.0 * 0.02 - 1.0 * 0.01)).abs() < 1e-15, "{impulse}");
}

#[test]
fn prop_the_watchdog_counts_only_torques_that_end_unasked() {
    let mut simulation = free("rigid", "runge-kutta", 1e-3);
    let steps = |simulation: &mut Simulation, count: u32| (0..count).for_each(|_| simulation.step().unwrap());
    set(&mut simulation, 1.0, 2.5e-3).unwrap();
    steps(&mut simulation, 2);
    assert!(!simulation.setpoint().expired && simulation.setpoint().held.is_some());
    steps(&mut simulation, 1);
    assert!(simulation.setpoint().expired && simulation.setpoint().held.is_none());
    set(&mut simulation, 0.0, 1e-3).unwrap();
    assert!(!simulation.setpoint().expired);
    steps(&mut simulation, 5);
    let SetpointState { held, expired, expirations } = *simulation.setpoint();
    assert_eq!((held, expired, expirations), (None, false, 1), "zero torque may end");
    set(&mut simulation, 1.0, 1.0).unwrap();
    simulation.reset().unwrap();
    assert_eq!(*simulation.setpoint(), SetpointState::default());
}

/// To the bit, through the recorded message, amid a hold and after it.
#[cfg(feature = "service")]
#[test]
fn regress_a_checkpoint_keeps_the_setpoint() {
    use crate::wire;
    for (model, integrator) in INTEGRATORS {
        for steps_before in [5, 50] {
            let mut straight = free(model, integrator, 1e-3);
            set(&mut straight, 2.0, 0.0123).unwrap();
            (0..steps_before).for_each(|_| straight.step().unwrap());
            let stamp = straight.stamp(0.0, std::time::SystemTime::UNIX_EPOCH);
            let message = wire::checkpoint(&straight.checkpoint(), &stamp);
            let mut resumed = free(model, integrator, 1e-3);
            assert!(resumed.restore(&wire::recorded_checkpoint(&message).unwrap()));
            assert_eq!(resumed.setpoint(), straight.setpoint());
            assert_eq!(straight.setpoint().held.is_some(), steps_before == 5);
            for _ in 0..40 {
                straight.step().unwrap();
                resumed.step().unwrap();
            }
            assert_eq!(resumed.checkpoint(), straight.checkpoint(), "{model} {integrator} {steps_before}");
        }
    }
}

#[test]
fn prop_a_bad_setpoint_is_refused_by_name_and_changes_nothing() {
    let mut simulation = free("rigid", "runge-kutta", 1e-3);
    set(&mut simulation, 1.0, 0.5).unwrap();
    let before = *simulation.setpoint();
    for (torque_nm, hold_s, word) in [
        (f64::NAN, 0.1, "finite"),
        (f64::INFINITY, 0.1, "finite"),
        (1.0, f64::NAN, "finite"),
        (1.0, 0.0, "hold_s = 0"),
        (1.0, -0.1, "hold_s = -0.1"),
        (1.0, 9.9e-7, "hold_s"),
        (1.0, 60.001, "hold_s"),
        (1.0, 3600.0, "hold_s = 3600"),
        (1e9, 0.1, "commands.torque_limit_nm"),
    ] {
        let refused = set(&mut simulation, torque_nm, hold_s).unwrap_err().to_string();
        assert!(refused.contains(word), "{torque_nm} for {hold_s}: {refused}");
        assert_eq!(*simulation.setpoint(), before);
    }
    for hold_s in [1e-6, 60.0] {
        assert!(set(&mut simulation, 1.0, hold_s).is_ok());
    }
    let mut driven = self::simulation(&["pulse=[]", "drive.speed_rad_per_s=5"]);
    assert_eq!(set(&mut driven, 1.0, 0.1), Err(PulseRefused::MotionPrescribed));
    let masses = SceneSource::open("thesis-two-masses", &[]).unwrap();
    assert_eq!(set(&mut Simulation::new(&masses.scene).unwrap(), 1.0, 0.1), Err(PulseRefused::NoPivot));
}
