//! Sizes of links that look like mistakes: lengths and sections in mm.

use crate::scene::{Bar, Chain, End, Link};
use crate::shown::figure;

/// Links are rarely this many times as long as one another.
const LENGTH_RATIO: f64 = 100.0;
/// No crank of an engine or a machine with a slider is longer, m: the largest engines have 1.7 m.
const LONGEST_CRANK_M: f64 = 10.0;
/// No boom or blade is longer, m.
const LONGEST_LINK_M: f64 = 300.0;
/// Links longer than this, m, are rarely this many times as long as their section is thick. Shorter ones may be as thin as a wire
/// or a strip.
const THIN: [(f64, f64); 2] = [(20.0, 1000.0), (5.0, 2000.0)];
/// No boom or blade is thicker, m.
const THICKEST_M: f64 = 10.0;
/// Rigid cranks up to this size, m, may be discs, and short strips may be wider than long.
const SMALL_M: f64 = 2.0;

/// Thickness of a section, m, after a word that says whether it is exact. A section without a shape counts as a rectangle: one of
/// the height h has the second moment of area `A h²/12`. Without a second moment, it counts as a square.
fn thickness_m(bar: &Bar) -> (&'static str, f64) {
    match bar.extreme_fibre_m {
        Some(fibre_m) => ("", 2.0 * fibre_m),
        None if bar.second_moment_m4 > 0.0 => ("some ", (12.0 * bar.second_moment_m4 / bar.area_m2).sqrt()),
        None => ("some ", bar.area_m2.sqrt()),
    }
}

/// A warning of a section that is thicker or wider than its link is long, or thicker than any, as with sizes in mm.
pub(super) fn no_slender_bar(link: &Link) -> Option<String> {
    let bar = link.bar?;
    let (about, thickness_m) = thickness_m(&bar);
    // Area and second moment alone may stand for stiffness and mass that no rectangle has.
    let width_m = bar.extreme_fibre_m.map_or(0.0, |_| bar.area_m2 / thickness_m);
    let widest_m = link.length_m.max(SMALL_M);
    let thickest_m = THICKEST_M.min(if link.rigid { widest_m } else { link.length_m });
    let (size_m, direction) = match (thickness_m > thickest_m, width_m > widest_m) {
        (true, _) => (thickness_m, "thick"),
        (false, true) => (width_m, "wide"),
        (false, false) => return None,
    };
    let (name, [size, length]) = (link.name.as_str(), [size_m, link.length_m].map(figure));
    // Neither thickness nor width is in the scene.
    let units = match bar.extreme_fibre_m {
        Some(_) => "lengths are in m",
        None => "area_m2 is in m², second_moment_m4 in m⁴",
    };
    Some(format!("the {name} is no slender bar: its section is {about}{size} m {direction}, and it is {length} m long: {units}"))
}

/// A warning of lengths of links that look like mistakes.
pub(super) fn of_lengths(chain: &Chain) -> Option<String> {
    unlike_lengths(&chain.links).or_else(|| long_crank(chain)).or_else(|| chain.links.iter().find_map(long_link))
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

/// A warning of a crank that is longer than any with a slider, as with lengths in mm. Beams and booms may be as long.
fn long_crank(chain: &Chain) -> Option<String> {
    let ([crank, _], End::Slider(_)) = (&chain.links[..], &chain.end) else { return None };
    let warning = || {
        let [given, meant] = [crank.length_m, 1e-3 * crank.length_m].map(figure);
        format!("crank.length_m = {given} is longer than the crank of any engine: lengths are in m, and {given} mm is {meant}")
    };
    (crank.length_m > LONGEST_CRANK_M).then(warning)
}

/// A warning of a link that is longer than any, or than a bar of its section, as with a length in mm.
fn long_link(link: &Link) -> Option<String> {
    let [name, given, meant] = [link.name.as_str().to_owned(), figure(link.length_m), figure(1e-3 * link.length_m)];
    let bar = link.bar.filter(|_| !link.rigid);
    let times = bar.map_or(0.0, |bar| link.length_m / thickness_m(&bar).1);
    let why = if link.length_m > LONGEST_LINK_M {
        "longer than any boom or blade".to_owned()
    } else if THIN.iter().any(|(length_m, ratio)| link.length_m > *length_m && times > *ratio) {
        format!("{times:.0} times the thickness of its section")
    } else {
        return None;
    };
    Some(format!("{name}.length_m = {given} is {why}: lengths are in m, and {given} mm is {meant}"))
}
