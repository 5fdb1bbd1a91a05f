//! Starts at which links do not carry their loads yet.

use crate::{Tried, checked};

/// Key and rows of a cycloid, 5 ms apart.
fn cycloid(over_s: f64, to_rad: f64) -> String {
    let count = (over_s / 0.005).round() as u32;
    let row = |k: u32| {
        let part = f64::from(k) / f64::from(count);
        let angle_rad = to_rad * (part - (std::f64::consts::TAU * part).sin() / std::f64::consts::TAU);
        format!("[{}, {angle_rad:.9}]", over_s * part)
    };
    format!("table=[{}]", (0..=count).map(row).collect::<Vec<_>>().join(", "))
}

/// Links carry no load of their inertia at a start at speed; peaks followed from their ringing, and no command said so.
#[test]
fn regress_a_start_at_speed_is_warned_of_where_links_bend() -> Tried {
    let began = "warning: the scene starts at 20 rad/s with links that carry no load of their own inertia yet: they ring, and first \
                 peaks of deflections and forces are up to twice the steady ones; ";
    let driven = |by: &str| vec!["pulse=[]".to_owned(), format!("drive.{by}")];
    let rigid = [driven("speed_rad_per_s=20"), vec!["solver.model=rigid".to_owned()]].concat();
    for (keys, way_on) in [
        (driven("speed_rad_per_s=20"), Some("a drive.ramp from rest begins smoothly\n")),
        (driven("table=[[0,0],[0.1,2]]"), Some("a drive.table whose first two rows have one angle begins at rest\n")),
        (vec!["start.rate_rad_per_s=20".to_owned()], Some("their damping lets that fade\n")),
        (driven("ramp={to_rad_per_s=20,over_s=0.1}"), None),
        (driven("table=[[0,0],[0.03,0],[0.07,0.6],[0.1,2]]"), None),
        (rigid, None),
        // A cycloid of 0.1 s over 3 rad, whose spline begins at 6e-5 of its largest rate.
        (driven(&cycloid(0.1, 3.0)), None),
    ] {
        let (_, said) = checked("crank-slider", &keys, &["--until", "0.1"])?;
        let told = said.split_once(began).map(|(_, way_on)| way_on);
        assert!(way_on.map_or(told.is_none(), |way_on| told.is_some_and(|told| told.starts_with(way_on))), "{said}");
    }
    Ok(())
}

/// A ramp from rest begins smoothly, and a gas force does not: pin forces began at twice that force, and no command said so.
#[test]
fn regress_a_start_under_resistance_is_warned_of_where_links_bend() -> Tried {
    let table = "slider.resistance_table=[[0,2300],[0.9,0],[5.2,1200]]";
    let warning = "warning: 2300 N resist the slider at the start, which the links do not carry yet: ";
    for (keys, is_warned_of) in [
        (vec![table], true),
        (vec!["slider.resistance_n=2300"], true),
        (vec![table, "start.angle_rad=2"], false),
        (vec![table, "start.static_equilibrium=true"], false),
        (vec![table, "solver.model=rigid"], false),
        (vec!["crank.rigid=false"], false),
    ] {
        let ramp = [
            "solver.step_s=1e-4",
            "pulse=[]",
            "drive.ramp={to_rad_per_s=2,over_s=1}",
            "rod.section.height_m=0.03",
            "crank.section.height_m=0.03",
        ];
        let given: Vec<String> = ramp.iter().chain(&keys).map(|&key| key.to_owned()).collect();
        let (_, said) = checked("crank-slider", &given, &["--until", "0.05"])?;
        assert_eq!(said.contains(warning), is_warned_of, "{keys:?}: {said}");
    }
    Ok(())
}
