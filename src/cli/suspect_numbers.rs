//! Warnings of numbers that are allowed, but look like mistakes, such as a length in mm.

use std::f64::consts::TAU;

use super::aligned_table::figure;
use crate::scene::{Link, Scene};

/// Links are rarely this many times as long as one another.
const LENGTH_RATIO: f64 = 100.0;

/// The warnings of a scene.
pub(super) fn suspect_numbers(scene: &Scene) -> Vec<String> {
    let Some(chain) = scene.chain() else { return Vec::new() };
    let bars = chain.links.iter().filter_map(no_slender_bar);
    bars.chain(unlike_lengths(&chain.links)).chain(many_turns(chain.start.angle_rad)).collect()
}

/// A warning of a section that is thicker than its link is long, as with sizes in mm. A rectangle of the height h has the second
/// moment of area `A h²/12`.
fn no_slender_bar(link: &Link) -> Option<String> {
    let bar = link.bar.filter(|_| !link.rigid)?;
    let height_m = (12.0 * bar.second_moment_m4 / bar.area_m2).sqrt();
    let [height, length] = [height_m, link.length_m].map(figure);
    let warning = || {
        format!("the {} is no slender bar: its section is some {height} m thick, and it is {length} m long", link.name.as_str())
    };
    (height_m > link.length_m).then(warning)
}

/// A warning of a link that is far longer than the other, as with a length in mm.
fn unlike_lengths(links: &[Link]) -> Option<String> {
    let [one, other] = links else { return None };
    let (short, long) = if one.length_m < other.length_m { (one, other) } else { (other, one) };
    let ratio = long.length_m / short.length_m;
    let warning = || {
        let [shorter, longer] = [short, long].map(|link| link.name.as_str());
        let [short_m, long_m] = [short, long].map(|link| figure(link.length_m));
        format!("the {longer} is {long_m} m long, {ratio:.0} times as long as the {shorter} ({short_m} m): lengths are in m")
    };
    (ratio > LENGTH_RATIO).then(warning)
}

/// A warning of a start angle beyond a full turn, as in degrees.
fn many_turns(angle_rad: f64) -> Option<String> {
    let warning = || {
        let turns = angle_rad.abs() / TAU;
        format!("start.angle_rad = {} is {turns:.1} turns: angles are in radians", figure(angle_rad))
    };
    (angle_rad.abs() > TAU).then(warning)
}

#[cfg(test)]
mod tests {
    use super::suspect_numbers;
    use crate::scene::{SceneError, SceneSource, builtin};

    fn warnings(scene: &str, overrides: &[&str]) -> Result<Vec<String>, SceneError> {
        let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
        Ok(suspect_numbers(&SceneSource::open(scene, &overrides)?.scene))
    }

    #[test]
    fn regress_numbers_in_a_wrong_unit_are_suspect() -> Result<(), SceneError> {
        for (given, warning) in [
            ("rod.length_m=420", "the rod is 420 m long, 840 times as long as the crank (0.5 m): lengths are in m"),
            ("start.angle_rad=-90", "start.angle_rad = -90 is 14.3 turns: angles are in radians"),
            ("rod.section.height_m=20", "the rod is no slender bar: its section is some 20 m thick, and it is 1.5 m long"),
        ] {
            assert_eq!(warnings("crank-slider", &[given])?, [warning]);
        }
        assert_eq!(warnings("crank-slider", &["rod.length_m=40", "start.angle_rad=-6.28"])?, [""; 0]);
        for scene in builtin::BUILTIN {
            let said = warnings(scene.name, &[])?;
            // The thesis's crank is a metre thick.
            assert!(said.iter().all(|warning| warning.starts_with("the crank is no slender bar")), "{}: {said:?}", scene.name);
        }
        Ok(())
    }
}
