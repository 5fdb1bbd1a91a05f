//! Warnings of numbers that are allowed, but look like mistakes, such as a length in mm.

mod dwells;
mod materials;
mod pulses;
mod sizes;
mod speeds;

use std::f64::consts::TAU;

use super::aligned_table::figure;
use crate::scene::{Chain, Drive, End, Link, ModelKind, Motion, Scene, SceneSource, builtin};
use dwells::moving_dwell;
use materials::{left_out_damping, light_material, soft_material, strong_damping};
use pulses::{long_pulses, strong_pulses};
use sizes::{no_slender_bar, of_lengths};
use speeds::{fast_crank, long_ramp};

/// Angles that are all whole multiples of this are rarely radians.
const ROUND_DEGREES: f64 = 5.0;
/// Such angles are smaller in a table that may be in radians, rad.
const FEW_DEGREES: f64 = 30.0;
/// A slider or a mass at the tip is rarely so heavy, kg, and so many times as heavy as the links.
const HEAVY_KG: f64 = 10.0;
const HEAVY_RATIO: f64 = 300.0;

/// Gravity on Earth, m/s².
const EARTH_M_PER_S2: f64 = 9.81;
/// Gravity is rarely this many times that on Earth: on Jupiter 2.5 times.
const STRONG_GRAVITY: f64 = 10.0;

/// The warnings of a scene; of a built-in one, those of what was changed in it: the thesis's crank is a metre thick.
pub(super) fn suspect_numbers(source: &SceneSource) -> Vec<String> {
    let built_in = builtin::find(&source.origin).and_then(|found| SceneSource::parse(found.name, found.text, &[]));
    built_in.map_or_else(|_| of_scene(&source.scene), |before| newly_suspect(&before.scene, &source.scene))
}

/// The warnings of a changed scene that it did not have before.
pub(super) fn newly_suspect(before: &Scene, after: &Scene) -> Vec<String> {
    let known = of_scene(before);
    of_scene(after).into_iter().filter(|warning| !known.contains(warning)).collect()
}

fn of_scene(scene: &Scene) -> Vec<String> {
    let Some(chain) = scene.chain() else { return Vec::new() };
    let of_damping = |link: &Link| match scene.solver.model {
        ModelKind::Rigid => None,
        ModelKind::Incremental => left_out_damping(link),
        _ => strong_damping(link),
    };
    let of_link = |link: &Link| [no_slender_bar(link), soft_material(link), light_material(link), of_damping(link)];
    let of_links = chain.links.iter().flat_map(of_link).flatten();
    let of_gravity = strong_gravity(chain.gravity_m_per_s2);
    let of_angles =
        many_turns(chain.start.angle_rad).into_iter().chain(table_in_degrees(&scene.drive)).chain(moving_dwell(scene));
    let of_lengths = of_lengths(chain);
    // With a length in mm, any speed looks too high.
    let of_speed = if of_lengths.is_none() { fast_crank(chain, &scene.drive) } else { None };
    of_links
        .chain(of_lengths)
        .chain(heavy_end(chain))
        .chain(of_gravity)
        .chain(of_angles)
        .chain(of_speed)
        .chain(long_ramp(&scene.drive))
        .chain(long_pulses(&scene.drive))
        .chain(strong_pulses(scene))
        .collect()
}

/// A warning of a mass at the end that is far heavier than the links, as in grams.
fn heavy_end(chain: &Chain) -> Option<String> {
    let (name, mass_kg) = match &chain.end {
        End::Slider(slider) => ("slider", slider.mass_kg),
        End::Free { tip_mass_kg } => ("tip", *tip_mass_kg),
    };
    let times = mass_kg / chain.links.iter().map(|link| link.mass_kg).sum::<f64>();
    let is_heavy = mass_kg >= HEAVY_KG && times.is_finite() && times > HEAVY_RATIO;
    let [given, meant] = [mass_kg, 1e-3 * mass_kg].map(figure);
    let problem = format!("{given} is {times:.0} times the mass of the links: masses are in kg, and {given} g is {meant}");
    is_heavy.then(|| format!("{name}.mass_kg = {problem}"))
}

/// Warnings of gravity that is far stronger than on Earth, as in mm/s².
fn strong_gravity(gravity_m_per_s2: [f64; 2]) -> impl Iterator<Item = String> {
    let times = |given: f64| given.abs() / EARTH_M_PER_S2;
    let strong = ["x", "y"].into_iter().zip(gravity_m_per_s2).filter(move |(_, given)| times(*given) > STRONG_GRAVITY);
    strong.map(move |(axis, given)| {
        let [times, given, meant] = [times(given), given, 1e-3 * given].map(figure);
        format!("gravity.{axis}_m_per_s2 = {given} is {times} times that on Earth: it is in m/s², and {given} mm/s² is {meant}")
    })
}

/// A warning of a start angle beyond a full turn, as in degrees.
fn many_turns(angle_rad: f64) -> Option<String> {
    let warning = || {
        let turns = angle_rad.abs() / TAU;
        format!("start.angle_rad = {} is {turns:.1} turns: angles are in radians", figure(angle_rad))
    };
    (angle_rad.abs() > TAU).then(warning)
}

/// A warning of a table of the drive that begins beyond a full turn, or whose angles are as round and large as degrees, or that goes
/// back and forth by more than a turn.
fn table_in_degrees(drive: &Drive) -> Option<String> {
    let Drive::Motion(Motion::Table(rows)) = drive else { return None };
    let [_, first_rad] = rows.first()?;
    let largest_rad = rows.iter().map(|[_, angle_rad]| angle_rad.abs()).fold(0.0, f64::max);
    let is_round = rows.iter().all(|[_, angle_rad]| angle_rad % ROUND_DEGREES == 0.0);
    let warning = || {
        let turns = largest_rad / TAU;
        format!("drive.table reaches {} rad, {turns:.1} turns: angles are in radians", figure(largest_rad))
    };
    let ends = |end: fn(f64, f64) -> f64| rows.iter().map(|[_, angle_rad]| *angle_rad).reduce(end).unwrap_or_default();
    let turns_back = !rows.is_sorted_by_key(|row| row[1]) && !rows.iter().rev().is_sorted_by_key(|row| row[1]);
    let swings_far = turns_back && ends(f64::max) - ends(f64::min) > TAU;
    (first_rad.abs() > TAU || (is_round && largest_rad >= FEW_DEGREES) || swings_far).then(warning)
}

#[cfg(test)]
mod tests {
    use super::suspect_numbers;
    use crate::scene::{SceneError, SceneSource, builtin};

    fn warnings(scene: &str, overrides: &[&str]) -> Result<Vec<String>, SceneError> {
        let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
        Ok(suspect_numbers(&SceneSource::open(scene, &overrides)?))
    }

    #[test]
    fn regress_damping_that_the_incremental_model_leaves_out_is_named() -> Result<(), SceneError> {
        let incremental = ["solver.model=incremental", "solver.integrator=two-point", "crank.elements=1", "rod.elements=1"];
        let given = |more: &[&'static str]| warnings("crank-slider", &[&incremental[..], more].concat());
        let said = |link: &str, damping_s: &str| {
            format!("{link}.damping_s = {damping_s} is left out: incremental has no damping of links")
        };
        assert_eq!(given(&["crank.damping_s=0", "rod.damping_s=1"])?, [said("rod", "1")]);
        assert_eq!(given(&["crank.damping_s=0", "rod.damping_s=0"])?, [""; 0]);
        Ok(())
    }

    /// A pulse of the scene counts as one from the bus, in either direction; at the limit it may be.
    #[test]
    fn regress_pulses_over_the_torque_limit_are_named() -> Result<(), SceneError> {
        let said = |torque: &str| {
            let pulse = format!("pulse=[{{ start_s = 0.1, torque_nm = {torque}, duration_s = 0.1 }}]");
            warnings("crank-slider", &["commands.torque_limit_nm=50", &pulse])
        };
        for torque in ["50.1", "-50.1", "1e9"] {
            let warning =
                format!("pulse.0.torque_nm = {torque} is over commands.torque_limit_nm = 50, which pulses from the bus keep");
            assert_eq!(said(torque)?, [warning.replace("1e9", "1.00000e9")]);
        }
        for torque in ["50", "-50"] {
            assert_eq!(said(torque)?, [""; 0]);
        }
        Ok(())
    }

    #[test]
    fn regress_numbers_in_a_wrong_unit_are_suspect() -> Result<(), SceneError> {
        for (given, warning) in [
            ("rod.length_m=420", "the rod is 420 m long, 840 times as long as the crank (0.5 m): lengths are in m"),
            ("start.angle_rad=-90", "start.angle_rad = -90 is 14.3 turns: angles are in radians"),
            (
                "rod.section.height_m=20",
                "the rod is no slender bar: its section is 20 m thick, and it is 1.5 m long: lengths are in m",
            ),
            (
                "rod.section={shape=\"round\", diameter_m=10}",
                "the rod is no slender bar: its section is 10 m thick, and it is 1.5 m long: lengths are in m",
            ),
            (
                "rod.section={shape=\"tube\", outer_m=16, inner_m=10}",
                "the rod is no slender bar: its section is 16 m thick, and it is 1.5 m long: lengths are in m",
            ),
            (
                "rod.youngs_modulus_pa=210",
                "rod.youngs_modulus_pa = 210 is softer than any material: moduli are in Pa, and 210 GPa is 210e9",
            ),
            (
                "rod.youngs_modulus_pa=3200",
                "rod.youngs_modulus_pa = 3200 is softer than any material: moduli are in Pa, and 3200 MPa is 3200e6",
            ),
            (
                "rod.youngs_modulus_pa=2.1e5",
                "rod.youngs_modulus_pa = 210000 is softer than rubber for its density: moduli are in Pa, and 210000 MPa is 210000e6",
            ),
            (
                "rod.density_kg_per_m3=7.85",
                "rod.density_kg_per_m3 = 7.85 is lighter than any stiff material: densities are in kg/m³, and 7.85 g/cm³ is 7850",
            ),
            ("slider.mass_kg=800", "slider.mass_kg = 800 is 519 times the mass of the links: masses are in kg, and 800 g is 0.8"),
            (
                "gravity.y_m_per_s2=-9810",
                "gravity.y_m_per_s2 = -9810 is 1000 times that on Earth: it is in m/s², and -9810 mm/s² is -9.81",
            ),
            (
                "rod.damping_s=0.02",
                "rod.damping_s = 0.02 damps its first bending between two pins, of 10.5247 Hz, by some 66 % of critical: it is a time \
                 in s, not a damping ratio: see `flexcrank guide scenes`",
            ),
        ] {
            assert_eq!(warnings("crank-slider", &[given])?, [warning]);
        }
        let large = ["rod.length_m=20", "start.angle_rad=-6.28", "gravity.y_m_per_s2=-98"];
        assert_eq!(warnings("crank-slider", &large)?, [""; 0]);
        let both = warnings("crank-slider", &["rod.youngs_modulus_pa=70", "rod.density_kg_per_m3=2.7"])?;
        assert!(both.len() == 2 && both[0].ends_with("70 GPa is 70e9") && both[1].ends_with("2.7 g/cm³ is 2700"), "{both:?}");
        let aluminium = warnings("crank-slider", &["rod.youngs_modulus_pa=7e4", "rod.density_kg_per_m3=2700"])?;
        assert!(aluminium.len() == 1 && aluminium[0].ends_with("70000 MPa is 70000e6"), "{aluminium:?}");
        for scene in builtin::BUILTIN {
            assert_eq!(warnings(scene.name, &[])?, [""; 0], "{}", scene.name);
        }
        Ok(())
    }

    #[test]
    fn regress_light_solids_in_g_per_cm3_are_suspect() -> Result<(), SceneError> {
        for (modulus, given, meant) in
            [("1e10", "0.68", "680"), ("1.3e9", "0.9", "900"), ("2e8", "0.92", "920"), ("10", "0.5", "500")]
        {
            let changes = [format!("rod.youngs_modulus_pa={modulus}"), format!("rod.density_kg_per_m3={given}")];
            let warned = warnings("crank-slider", &changes.each_ref().map(String::as_str))?;
            let why = "is lighter than any stiff material: densities are in kg/m³, and";
            let warning = format!("rod.density_kg_per_m3 = {given} {why} {given} g/cm³ is {meant}");
            assert_eq!(warned.last(), Some(&warning), "{warned:?}");
        }
        Ok(())
    }

    #[test]
    fn regress_sections_in_mm_are_suspect() -> Result<(), SceneError> {
        for (given, is) in [
            (&["rod.section.width_m=50"][..], "50 m wide, and it is 1.5 m long"),
            (&["rod.length_m=20", "rod.section.height_m=12"], "12 m thick, and it is 20 m long"),
            (&["rod.rigid=true", "rod.section.height_m=12"], "12 m thick, and it is 1.5 m long"),
        ] {
            let warning = format!("the rod is no slender bar: its section is {is}: lengths are in m");
            assert_eq!(warnings("crank-slider", given)?, [warning]);
        }
        for given in [&["rod.rigid=true", "rod.section.height_m=1.6"][..], &["rod.section.width_m=1.9"]] {
            assert_eq!(warnings("crank-slider", given)?, [""; 0], "{given:?}: a disc and a strip");
        }
        Ok(())
    }

    #[test]
    fn regress_a_crank_and_a_rod_in_mm_are_suspect_together() -> Result<(), SceneError> {
        let both = warnings("crank-slider", &["crank.length_m=50", "rod.length_m=250"])?;
        let warning = "crank.length_m = 50 is longer than the crank of any engine: lengths are in m, and 50 mm is 0.05";
        assert_eq!(both, [warning]);
        assert_eq!(warnings("crank-slider", &["crank.length_m=10", "rod.length_m=20"])?, [""; 0]);
        assert_eq!(warnings("thesis-beam", &["beam.length_m=60"])?, [""; 0], "a boom or a blade");
        Ok(())
    }

    #[test]
    fn regress_a_beam_in_mm_is_suspect() -> Result<(), SceneError> {
        for (given, warning) in [
            (
                &["beam.length_m=850"][..],
                "beam.length_m = 850 is longer than any boom or blade: lengths are in m, and 850 mm is 0.85",
            ),
            (
                &["beam.length_m=50", "beam.area_m2=1e-4", "beam.second_moment_m4=8.333e-10"],
                "beam.length_m = 50 is 5000 times the thickness of its section: lengths are in m, and 50 mm is 0.05",
            ),
            (
                &["beam.length_m=12", "beam.area_m2=2.5e-5", "beam.second_moment_m4=5.208e-11"],
                "beam.length_m = 12 is 2400 times the thickness of its section: lengths are in m, and 12 mm is 0.012",
            ),
        ] {
            assert_eq!(warnings("thesis-beam", given)?, [warning]);
        }
        for given in [
            ["beam.length_m=12", "beam.area_m2=1e-4", "beam.second_moment_m4=8.333e-10"],
            ["beam.length_m=4", "beam.area_m2=1e-6", "beam.second_moment_m4=8.333e-14"],
        ] {
            assert_eq!(warnings("thesis-beam", &given)?, [""; 0], "{given:?}: a mast and a wire");
        }
        Ok(())
    }

    #[test]
    fn regress_a_table_of_the_drive_in_degrees_is_suspect() -> Result<(), SceneError> {
        let with = |table: &str| warnings("thesis-compressor", &[format!("drive={{table={table}}}").as_str()]);
        let reaches = |angle: &str, turns: &str| format!("drive.table reaches {angle} rad, {turns} turns: angles are in radians");
        let found = with("[[0, 0], [2, 90], [4, 90]]")?;
        assert!(found.len() == 2 && found[0] == reaches("90", "14.3"), "{found:?}");
        assert!(
            found[1].starts_with("drive.table has the same angle at 2 s and 4 s, and its spline leaves it by up to "),
            "{found:?}"
        );
        assert_eq!(with("[[0, 180], [5, 180], [10, 180]]")?, [reaches("180", "28.6")]);
        assert_eq!(with("[[0, 7.5], [1, -12.5]]")?, [reaches("12.5", "2.0")], "begins beyond a full turn");
        assert_eq!(with("[[0, 0], [0.2, 8.6], [0.7, 60.5], [2, 0]]")?, [reaches("60.5", "9.6")], "goes back and forth");
        for radians in
            ["[[0, 0], [2, 1.5708]]", "[[0, 0], [1, 5], [2, 10]]", "[[0, 0], [10, 1570.8]]", "[[0, 0], [1, 3.2], [2, 0]]"]
        {
            assert_eq!(with(radians)?, [""; 0], "{radians}");
        }
        Ok(())
    }

    #[test]
    fn regress_a_pulse_in_ms_is_suspect() -> Result<(), SceneError> {
        let warning = "pulse.0.duration_s = 300 is long for a pulse: times are in s, and 300 ms is 0.3";
        assert_eq!(warnings("crank-slider", &["pulse.0.duration_s=300"])?, [warning]);
        assert_eq!(warnings("crank-slider", &["pulse.0.duration_s=30"])?, [""; 0]);
        Ok(())
    }

    #[test]
    fn regress_a_ramp_in_ms_is_suspect() -> Result<(), SceneError> {
        let with = |over: &str| {
            let drive = format!("drive={{ ramp = {{ to_rad_per_s = 20.0, over_s = {over} }} }}");
            warnings("crank-slider", &["pulse=[]", drive.as_str()])
        };
        let warning = "drive.ramp.over_s = 1000 is long for a change of speed: times are in s, and 1000 ms is 1";
        assert_eq!(with("1000")?, [warning]);
        assert_eq!(with("100")?, [""; 0]);
        Ok(())
    }

    #[test]
    fn regress_a_speed_in_revolutions_a_minute_is_suspect() -> Result<(), SceneError> {
        for (given, key, speed, pin, meant) in [
            (&["start.rate_rad_per_s=-300"][..], "start.rate_rad_per_s", "-300", "150", "-31.4159"),
            (&["pulse=[]", "drive.speed_rad_per_s=240"], "drive.speed_rad_per_s", "240", "120", "25.1327"),
            (
                &["pulse=[]", "drive={ ramp = { to_rad_per_s = 240, over_s = 2 } }"],
                "drive.ramp.to_rad_per_s",
                "240",
                "120",
                "25.1327",
            ),
        ] {
            let warning = format!(
                "{key} = {speed} moves the crank pin at {pin} m/s, faster than in any engine: speeds are in rad/s, and {speed} \
                 revolutions a minute are {meant}"
            );
            assert_eq!(warnings("crank-slider", given)?, [warning]);
        }
        assert_eq!(warnings("crank-slider", &["start.rate_rad_per_s=190"])?, [""; 0]);
        assert_eq!(warnings("thesis-beam", &["start.rate_rad_per_s=300"])?, [""; 0], "a blade");
        let in_mm = warnings("crank-slider", &["crank.length_m=50", "rod.length_m=250", "start.rate_rad_per_s=3"])?;
        assert!(in_mm.len() == 1 && in_mm[0].starts_with("crank.length_m = 50"), "{in_mm:?}");
        Ok(())
    }

    #[test]
    fn prop_what_a_built_in_scene_has_by_itself_is_suspect_in_a_copy_alone() -> Result<(), SceneError> {
        let thesis = "thesis-crank-slider";
        assert_eq!(warnings(thesis, &["start.angle_rad=180"])?, ["start.angle_rad = 180 is 28.6 turns: angles are in radians"]);
        let copied = suspect_numbers(&SceneSource::parse("mine.toml", builtin::find(thesis)?.text, &[])?);
        assert!(copied.len() == 1 && copied[0].starts_with("the crank is no slender bar"), "{copied:?}");
        Ok(())
    }

    #[test]
    fn prop_foams_rubber_and_links_without_mass_are_not_suspect() -> Result<(), SceneError> {
        for given in [
            ["rod.youngs_modulus_pa=1e4", "rod.density_kg_per_m3=5"],
            ["rod.youngs_modulus_pa=1e7", "rod.density_kg_per_m3=20"],
            ["rod.youngs_modulus_pa=1e5", "rod.density_kg_per_m3=300"],
            ["rod.youngs_modulus_pa=1e6", "rod.density_kg_per_m3=1100"],
            ["rod.youngs_modulus_pa=1e6", "rod.damping_s=1"],
            ["rod.youngs_modulus_pa=2.1e11", "rod.damping_s=0.015"],
            // So thick that vibrations die at once.
            ["rod.section.height_m=1", "rod.damping_s=9e-4"],
            // The falling flexible pendulum, a benchmark: 11 m/s.
            ["rod.youngs_modulus_pa=7e5", "rod.density_kg_per_m3=5540"],
            ["rod.youngs_modulus_pa=2.1e11", "rod.density_kg_per_m3=1"],
            ["rod.youngs_modulus_pa=2.1e11", "rod.density_kg_per_m3=1e-6"],
            ["rod.youngs_modulus_pa=3.5e9", "rod.density_kg_per_m3=40"],
            ["rod.youngs_modulus_pa=210", "rod.rigid=true"],
        ] {
            assert_eq!(warnings("crank-slider", &given)?, [""; 0], "{given:?}");
        }
        Ok(())
    }

    /// Stiffness and mass per length by numbers that no rectangle has.
    #[test]
    fn prop_sections_without_a_shape_may_stand_for_stiffness_and_mass_alone() -> Result<(), SceneError> {
        for given in [
            &["beam.second_moment_m4=1e-8"][..],
            &["beam.second_moment_m4=1e-9"],
            &["beam.area_m2=1.0", "beam.second_moment_m4=8.333e-10", "beam.density_kg_per_m3=0.77"],
        ] {
            assert_eq!(warnings("thesis-beam", given)?, [""; 0], "{given:?}");
        }
        Ok(())
    }
}
