//! `response`: largest values, tables and remarks.

use std::error::Error;

use crate::{Outcome, flexcrank};

/// Far below its resonances a mass follows a force as its spring does.
#[test]
fn val_the_table_of_a_response_begins_at_its_static_value() -> Outcome {
    let folder = tempfile::tempdir()?;
    let springs = "--set oscillator.masses_kg=[1.0,2.0] --set oscillator.springs=[[0,1,300.0],[1,2,200.0]]";
    let line = format!("response thesis-two-masses {springs} --output mass_1_m --from 1e-4 --to 1e-3 --csv all.csv --plot drawn");
    let (code, _, said) = flexcrank(folder.path(), &line)?;
    assert_eq!(code, Some(0), "{said}");
    let text = std::fs::read_to_string(folder.path().join("all.csv"))?;
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("frequency_hz,mass_1_m_per_mass_1_force_n,mass_1_m_phase_deg"));
    let first: Vec<f64> = lines.next().ok_or("no row")?.split(',').map(str::parse).collect::<Result<_, _>>()?;
    assert!((first[1] * 300.0 - 1.0).abs() < 1e-6 && first[2] == 0.0, "{first:?}");
    assert_eq!(std::fs::read_dir(folder.path().join("drawn"))?.count(), 4);
    Ok(())
}

/// A rigid beam on a spring and a damper: `J θ'' + c θ' + k θ = τ`. The largest response is `1/(2 k ζ √(1 − ζ²))` at `f₀ √(1 − 2 ζ²)`, which
/// lies between the frequencies of the table: that at f₀ was printed, 0.7 % off.
#[test]
fn val_the_largest_response_is_that_of_a_damped_vibration() -> Outcome {
    let folder = tempfile::tempdir()?;
    let [mass_kg, length_m, stiffness_nm] = [2.0_f64, 0.5, 80.0];
    let inertia_kg_m2 = mass_kg * length_m * length_m / 3.0;
    let natural_rad_per_s = (stiffness_nm / inertia_kg_m2).sqrt();
    for damping in [0.001, 0.05, 0.2, 0.5] {
        let damper = 2.0 * damping * (stiffness_nm * inertia_kg_m2).sqrt();
        let scene = format!(
            "[beam]\nlength_m = {length_m}\nmass_kg = {mass_kg}\nrigid = true\n[base]\ntorsion_spring_nm_per_rad = {stiffness_nm}\n\
             damper_nm_s_per_rad = {damper}\n[solver]\nmodel = \"rigid\"\n"
        );
        std::fs::write(folder.path().join("arm.toml"), scene)?;
        let (code, told, said) = flexcrank(folder.path(), "response arm.toml --output beam_angle_rad --csv all.csv")?;
        assert_eq!(code, Some(0), "{said}");
        let row = told.lines().find(|line| line.trim_start().starts_with("beam_angle_rad")).ok_or("no row")?;
        let shown: Vec<f64> = row.split_whitespace().skip(1).take(2).map(str::parse).collect::<Result<_, _>>()?;
        let largest = 0.5 / (stiffness_nm * damping * (1.0 - damping * damping).sqrt());
        let at_hz = natural_rad_per_s / std::f64::consts::TAU * (1.0 - 2.0 * damping * damping).sqrt();
        // Six digits are printed.
        assert!((shown[0] / largest - 1.0).abs() < 1e-5 && (shown[1] / at_hz - 1.0).abs() < 1e-5, "{damping}: {row}");
        // The table has that frequency, in its order.
        let text = std::fs::read_to_string(folder.path().join("all.csv"))?;
        let number = |row: &str, column: usize| row.split(',').nth(column).map_or(Ok(f64::NAN), str::parse::<f64>);
        let rows =
            text.lines().skip(1).map(|row| Ok((number(row, 0)?, number(row, 1)?))).collect::<Result<Vec<_>, Box<dyn Error>>>()?;
        assert!(rows.is_sorted_by(|one, other| one.0 < other.0), "{damping}");
        let most = rows.iter().map(|row| row.1).fold(0.0, f64::max);
        assert!((most / largest - 1.0).abs() < 1e-12, "{damping}: {most} for {largest}");
    }
    Ok(())
}

/// A clamped beam's sixth bending, its twelfth mode, of less than a millionth of the critical damping: its peak goes by the inverse of the
/// damping. Only the modes that give the range were looked at, and the largest was that of the grid.
#[test]
fn val_a_narrow_peak_of_a_higher_mode_is_found() -> Outcome {
    let folder = tempfile::tempdir()?;
    let line = "response ref-r5 --crank held --set beam.elements=20 --output tip_y_m --from 2.5e4 --to 4e4";
    for (damping_s, largest) in [(1e-11, 1.35540e-6), (1e-10, 1.35540e-7)] {
        let (code, told, said) = flexcrank(folder.path(), &format!("{line} --set beam.damping_s={damping_s:e}"))?;
        assert_eq!(code, Some(0), "{said}");
        let row = told.lines().find(|line| line.trim_start().starts_with("tip_y_m")).ok_or("no row")?;
        let shown: Vec<f64> = row.split_whitespace().skip(1).take(2).map(str::parse).collect::<Result<_, _>>()?;
        assert!((shown[0] / largest - 1.0).abs() < 1e-4 && (shown[1] / 31388.0 - 1.0).abs() < 1e-5, "{damping_s}: {row}");
        assert!(!told.contains("may be missed"), "{told}");
    }
    let (_, told, _) = flexcrank(folder.path(), &line.replace("--to 4e4", "--to 1e5"))?;
    assert!(told.contains("peaks that are narrow beside the 600 frequencies of the range may be missed"), "{told}");
    Ok(())
}

/// A beam that stands upright falls; one that hangs does not.
#[test]
fn prop_a_response_says_what_it_wrote_and_that_motion_grows() -> Outcome {
    let folder = tempfile::tempdir()?;
    let beam = "thesis-beam --set solver.model=modal --set solver.integrator=esdirk --set pulse=[]";
    let heavy = "--set gravity.y_m_per_s2=-9.81 --set base.torsion_spring_nm_per_rad=0.0";
    for (angle_deg, grows) in [(90, true), (270, false)] {
        let line = format!("response {beam} {heavy} --angle {angle_deg} --csv all.csv --step-csv step.csv --plot drawn");
        let (code, told, said) = flexcrank(folder.path(), &line)?;
        assert_eq!(code, Some(0), "{said}");
        assert_eq!(said.contains("warning: the motion grows by itself as e^(5.42"), grows, "{said}");
        let replaced = if grows { "" } else { "replaced " };
        for file in ["all.csv (", "step.csv (1001 rows)"].map(|file| format!("{replaced}{file}")) {
            assert!(told.lines().any(|line| line.starts_with(&file)), "{file} in {told}");
        }
        for file in ["drawn/frequency-response.svg", "drawn/step-response.png"] {
            assert!(told.lines().any(|line| line == file), "{file} in {told}");
        }
    }
    Ok(())
}

#[test]
fn regress_a_largest_response_that_is_no_resonance_or_no_small_motion_is_named() -> Outcome {
    let folder = tempfile::tempdir()?;
    let springs = "--set oscillator.masses_kg=[1.0,2.0] --set oscillator.springs=[[0,1,300.0],[1,2,200.0]]";
    let end = |end: &str| format!("largest at the {end} end of the range, which is no resonance");
    let free = "no stiffness holds the mechanism".to_owned();
    for (line, says, not) in [
        (
            "crank-slider --angle 57".to_owned(),
            vec![
                format!("  crank_angle_rad, slider_m: {}\n", end("lower")),
                format!("  {free}"),
                "small motion (1 rad)".to_owned(),
            ],
            vec![end("upper")],
        ),
        (
            "crank-slider --angle 57 --output rod_deflection_m".to_owned(),
            vec![],
            vec![end("lower"), end("upper"), free.clone(), "1 rad".to_owned()],
        ),
        // Under a damper, the speed ends at 1/d.
        (
            "crank-slider --set base.damper_nm_s_per_rad=0.5 --output crank_speed_rad_per_s --from 0.01 --until 2".to_owned(),
            vec![],
            vec![free.clone()],
        ),
        (
            "crank-slider --output crank_speed_rad_per_s --from 0.01 --until 2".to_owned(),
            vec![format!("  {free}: crank_speed_rad_per_s grows without bound")],
            vec![],
        ),
        (
            format!("thesis-two-masses {springs} --output mass_1_m --from 1e-4 --to 1e-3"),
            vec![format!("  mass_1_m: {}\n", end("upper"))],
            vec![end("lower"), free.clone()],
        ),
    ] {
        let (code, told, said) = flexcrank(folder.path(), &format!("response {line}"))?;
        assert_eq!(code, Some(0), "{said}");
        assert!(says.iter().all(|text| told.contains(text)), "{says:?} in {told}");
        assert!(!not.iter().any(|text| told.contains(text)), "{not:?} not in {told}");
    }
    Ok(())
}

/// A slider in a dead centre does not move with the crank. It was largest at the lowest frequency, in phase; at 180°, by rounding.
#[test]
fn regress_an_output_that_the_input_does_not_move_is_largest_nowhere() -> Outcome {
    let folder = tempfile::tempdir()?;
    for angle in ["0", "180", "-180", "360"] {
        let line = format!("response crank-slider --output crank_angle_rad,slider_m --angle {angle}");
        let (code, told, said) = flexcrank(folder.path(), &line)?;
        assert_eq!(code, Some(0), "{said}");
        let slider: Vec<&str> = told.lines().filter(|line| line.contains("slider_m")).collect();
        let row: Vec<&str> = slider.first().ok_or("no row")?.split_whitespace().collect();
        assert_eq!([row[0], row[2], row[3], row[5]], ["slider_m", "–", "–", "–"], "{told}");
        assert!(row[1].parse::<f64>()? < 1e-15 && row[4].parse::<f64>()?.abs() < 1e-15, "{told}");
        assert_eq!(slider[1..], ["  slider_m: not moved by torque_nm in small motion about this state"], "{told}");
    }
    Ok(())
}

/// Far beyond the frequencies of a chain of masses, its end moves by a tiny part of what the force moves: by less than rounding beside that.
#[test]
fn regress_the_far_end_of_a_chain_of_masses_moves() -> Outcome {
    let folder = tempfile::tempdir()?;
    let springs: Vec<String> = (1..=10).map(|mass| format!("[{}, {mass}, 100.0]", mass - 1)).collect();
    let text = format!("[oscillator]\nmasses_kg = {:?}\nsprings = [{}]\n", [1.0; 10], springs.join(", "));
    std::fs::write(folder.path().join("chain.toml"), text)?;
    let line = "response chain.toml --input mass_10_force_n --output mass_1_m --from 10 --to 30";
    let (code, told, said) = flexcrank(folder.path(), line)?;
    assert!(code == Some(0) && !told.contains("not moved by"), "{told}{said}");
    Ok(())
}

/// The state was the start, released: with a force of 400 N on the second mass, which then moves on. Static displacements by hand, K⁻¹F.
#[test]
fn val_the_masses_of_a_linear_model_are_where_springs_balance_forces() -> Outcome {
    let folder = tempfile::tempdir()?;
    let springs = "springs = [[1, 0, 6.0e4], [1, 2, 3.2e5], [1, 3, 3.2e5], [1, 4, 3.2e5]]\n";
    let loaded = format!("[oscillator]\nmasses_kg = [120.0, 40.0, 40.0, 40.0]\n{springs}forces_n = [0.0, 400.0, 0.0, 0.0]\n");
    // Two free masses keep their place, and their spring is slack.
    let free = "[oscillator]\nmasses_kg = [1.0, 1.0]\nsprings = [[1, 2, 100.0]]\nstart_m = [0.5, 0.7]\n";
    // Nothing balances the force.
    let pushed = format!("{free}forces_n = [1.0, 0.0]\n");
    for (scene, expected) in [
        (loaded.as_str(), &[20.0 / 3e3, 20.0 / 3e3 + 1.25e-3, 20.0 / 3e3, 20.0 / 3e3][..]),
        (free, &[0.6, 0.6]),
        (pushed.as_str(), &[0.5, 0.7]),
    ] {
        std::fs::write(folder.path().join("masses.toml"), scene)?;
        let (code, _, said) = flexcrank(folder.path(), "linearise masses.toml -o masses.json")?;
        assert_eq!(code, Some(0), "{said}");
        let file: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(folder.path().join("masses.json"))?)?;
        std::fs::remove_file(folder.path().join("masses.json"))?;
        let places: Vec<f64> = serde_json::from_value(file["at"].clone())?;
        // Each place is followed by its speed.
        let right = places.iter().step_by(2).zip(expected).all(|(place, expected)| (place - expected).abs() < 1e-12);
        assert!(right && places.len() == 2 * expected.len(), "{places:?} for {expected:?}");
    }
    Ok(())
}
