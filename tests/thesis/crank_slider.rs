//! The crank-slider of section 5.6.

use std::f64::consts::{PI, TAU};

use crate::reference::{Outcome, reference, simulation, turn};

const RIGID: [&str; 3] = ["solver.model=rigid", "solver.integrator=runge-kutta", "solver.step_s=0.001"];

#[test]
fn val_rigid_follows_lagrange_within_1e_7_rad() -> Outcome {
    let mut simulation = simulation("thesis-crank-slider", &RIGID)?;
    let mut worst: f64 = 0.0;
    for row in reference("thesis/ref_rigid_crank_slider_L0.5_1.5_1Nm_0.1s.csv")? {
        while simulation.time_s() < row[0] - 5e-4 {
            simulation.step()?;
        }
        let seen = simulation.observe()?;
        let (crank, rod) = (&seen.links[0], &seen.links[1]);
        worst = worst.max((crank.chord_rad - row[1]).abs());
        assert!((crank.rate_rad_per_s - row[2]).abs() < 1e-7);
        assert!((rod.chord_rad - row[3]).abs() < 1e-7);
        assert!((rod.nodes[1].position_m[0] - row[4]).abs() < 1e-7);
        assert!((seen.energy.kinetic_j - row[5]).abs() < 1e-9);
    }
    assert!(worst < 1e-7, "crank angle off by {worst} rad");
    Ok(())
}

#[test]
fn prop_rigid_keeps_its_energy_after_the_pulse() -> Outcome {
    let mut simulation = simulation("thesis-crank-slider", &RIGID)?;
    while simulation.time_s() < 0.1 - 5e-4 {
        simulation.step()?;
    }
    let given = simulation.observe()?.energy.kinetic_j;
    let work_in_j = simulation.ledger().work_in_j;
    assert!((given - work_in_j).abs() < 1e-9 * given, "kinetic energy {given} J, work {work_in_j} J");
    while simulation.time_s() < 22.8 {
        simulation.step()?;
        let kept = simulation.observe()?.energy.kinetic_j;
        assert!((kept / given - 1.0).abs() < 1e-9, "{kept} J of {given} J at {} s", simulation.time_s());
    }
    Ok(())
}

#[test]
fn val_incremental_is_the_thesis_listing_within_1e_6() -> Outcome {
    let mut simulation = simulation("thesis-crank-slider", &[])?;
    let rows = reference("thesis/crank_slider_h0.1_theta0.55__wrap_repaired.csv")?;
    assert_eq!(rows.len(), 229);
    for (n, row) in rows.iter().enumerate() {
        if n > 0 {
            simulation.step()?;
        }
        let torque = simulation.take_mean_torque_nm();
        let seen = simulation.observe()?;
        let (crank, rod) = (&seen.links[0].nodes, &seen.links[1].nodes);
        let columns = [
            (turn(&crank[0]), row[1]),
            (crank[1].position_m[0], row[2]),
            (crank[1].position_m[1], row[3]),
            (turn(&crank[1]), row[4]),
            (turn(&rod[0]), row[5]),
            (rod[1].position_m[0], row[6]),
            (turn(&rod[1]), row[7]),
            (row[8] + wrap(seen.links[0].chord_rad - row[8]), row[8]),
            (row[9] + wrap(seen.links[1].chord_rad - row[9]), row[9]),
            (torque, row[10]),
        ];
        for (column, (computed, listed)) in columns.into_iter().enumerate() {
            assert!((computed - listed).abs() < 1e-6, "row {n}, column {}: {computed} for {listed}", column + 1);
        }
    }
    Ok(())
}

/// To (−π, π].
fn wrap(angle_rad: f64) -> f64 {
    angle_rad - TAU * ((angle_rad - PI) / TAU).ceil()
}

#[test]
fn prop_same_commands_give_the_same_bits_through_a_checkpoint() -> Outcome {
    for model in
        [["solver.model=rigid", "solver.integrator=runge-kutta"], ["solver.model=incremental", "solver.integrator=two-point"]]
    {
        let mut straight = simulation("thesis-crank-slider", &model)?;
        let mut resumed = simulation("thesis-crank-slider", &model)?;
        for _ in 0..37 {
            straight.step()?;
        }
        assert!(resumed.restore(&straight.checkpoint()));
        for _ in 0..200 {
            straight.step()?;
            resumed.step()?;
        }
        assert_eq!(straight.checkpoint(), resumed.checkpoint());
    }
    Ok(())
}

#[test]
fn val_incremental_agrees_with_the_listing_as_printed_until_it_breaks() -> Outcome {
    let mut simulation = simulation("thesis-crank-slider", &[])?;
    for row in reference("thesis/crank_slider_h0.1_theta0.55.csv")?.iter().skip(1).take_while(|row| row[0] < 5.65) {
        simulation.step()?;
        let seen = simulation.observe()?;
        let (crank, rod) = (&seen.links[0].nodes, &seen.links[1].nodes);
        let columns = [(turn(&crank[0]), 1), (crank[1].position_m[0], 2), (crank[1].position_m[1], 3), (rod[1].position_m[0], 6)];
        for (computed, column) in columns {
            assert!((computed - row[column]).abs() < 1e-7, "t = {}: column {column}", row[0]);
        }
    }
    Ok(())
}
