//! The most similar known name, for error messages.

#[cfg(feature = "service")]
mod column;
mod file;

#[cfg(feature = "service")]
pub(crate) use column::{column_hint, did_you_mean_column};
pub(crate) use file::did_you_mean_file;

/// Smallest similarity (Jaro–Winkler, 0 to 1) of a suggestion.
const LIKE: f64 = 0.8;
/// Similarity of two words that differ by one letter, or by neighbours that changed places. That of Jaro and Winkler is too
/// small in short ones: 0.56 of `amr` and `arm`.
const SLIP: f64 = 0.85;
/// Shorter words differ by one letter without being alike.
const SHORTEST_SLIP: usize = 3;

/// The one of `names` that is most like `given`, if any is like it. Names that have all its words come before others: `crank_mean_rate`
/// for `crank_rate`, and not `crank_mass`. The only one of them need not be like it: `y_m_per_s2` for `y`.
/// Initials stand for a name if none is like them.
pub(crate) fn nearest<'a>(given: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let names: Vec<&str> = names.into_iter().collect();
    let wordier: Vec<&str> = names.iter().copied().filter(|name| has_words_of(given, name)).collect();
    let candidates = if wordier.is_empty() { &names } else { &wordier };
    let like = candidates.iter().copied().filter(|name| likeness(given, name) > LIKE);
    // Names with the same last part are told apart by the rest: node 2 is not node 4.
    let more_like = |one: &&str, other: &&str| {
        let by_whole = likeness_of_words(given, one).total_cmp(&likeness_of_words(given, other));
        likeness(given, one).total_cmp(&likeness(given, other)).then(by_whole)
    };
    let only_wordier = || {
        let first = *wordier.first()?;
        wordier.iter().all(|other| *other == first).then_some(first)
    };
    let shortened = || names.iter().copied().find(|name| is_short_for(given, name));
    like.max_by(more_like).or_else(only_wordier).or_else(shortened)
}

/// Whether `given` is made of the initials of `name`, and perhaps one more letter: `fem` for `finite-element`.
fn is_short_for(given: &str, name: &str) -> bool {
    let initials: String = name.split('-').filter_map(|word| word.chars().next()).collect();
    let rest = given.strip_prefix(initials.as_str());
    initials.chars().count() > 1 && rest.is_some_and(|rest| rest.chars().count() <= 1)
}

/// Similarity of two names. Names in one table share all but their last part, so that one has to be alike by itself, or to have its
/// words: `links.crank.angle` is not `links.crank.revolutions`.
fn likeness(given: &str, name: &str) -> f64 {
    let whole = likeness_of_words(given, name);
    match (given.rsplit_once('.'), name.rsplit_once('.')) {
        (Some((_, given)), Some((_, name))) if !has_words_of(given, name) => whole.min(likeness_of_words(given, name)),
        _ => whole,
    }
}

fn likeness_of_words(given: &str, name: &str) -> f64 {
    let is_slip = given.chars().count() >= SHORTEST_SLIP && strsim::osa_distance(given, name) == 1;
    strsim::jaro_winkler(given, name).max(if is_slip { SLIP } else { 0.0 })
}

/// Whether `name` has every word of `given`: the parts between `_` and `.`.
fn has_words_of(given: &str, name: &str) -> bool {
    given.split(['_', '.']).all(|word| name.split(['_', '.']).any(|other| other == word))
}

/// The key that is most like `given`, or else the one whose first word is: `damper_nm_s_per_rad` for `damping`.
fn nearest_key<'a>(given: &str, keys: &[&'a str]) -> Option<&'a str> {
    let by_first_word = || {
        let word = nearest(given, keys.iter().copied().map(first_word))?;
        keys.iter().copied().find(|key| first_word(key) == word)
    };
    nearest(given, keys.iter().copied()).or_else(by_first_word)
}

fn first_word(name: &str) -> &str {
    name.split('_').next().unwrap_or_default()
}

/// A question to end a refusal of an unknown key with, if one of `keys` is like it; else nothing.
pub(crate) fn did_you_mean_key(given: &str, keys: &[&str]) -> String {
    nearest_key(given, keys).map(question).unwrap_or_default()
}

/// A question to end a refusal with, if one of `names` is like the one given; else nothing.
pub(crate) fn did_you_mean<'a>(given: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    nearest(given, names).map(question).unwrap_or_default()
}

fn question(near: impl std::fmt::Display) -> String {
    format!("; did you mean `{near}`?")
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn regress_one_slip_in_a_short_name_is_near() {
        for (given, near) in [("amr", Some("arm")), ("arn", Some("arm")), ("am", None), ("leg", None)] {
            assert_eq!(nearest(given, ["arm"]), near, "{given}");
        }
    }

    #[test]
    fn regress_initials_stand_for_a_name() {
        let names = ["rigid", "modal", "finite-element", "runge-kutta", "mass-spring"];
        let shortened = [("fem", "finite-element"), ("fe", "finite-element"), ("rk4", "runge-kutta")];
        for (given, near) in shortened {
            assert_eq!(nearest(given, names), Some(near), "{given}");
        }
        for given in ["fast", "fem12", "m"] {
            assert_eq!(nearest(given, names), None, "{given}");
        }
    }

    #[test]
    fn prop_only_what_is_near_is_suggested() {
        let names = ["length_m", "nodes.crank.4.y_m", "modal", "ref-r5-tip"];
        for (given, near) in
            [("lenght_m", Some("length_m")), ("modla", Some("modal")), ("nosuch", None), ("/tmp", None), ("", None)]
        {
            assert_eq!(nearest(given, names), near, "{given}");
        }
    }

    #[test]
    fn regress_a_name_with_all_words_comes_before_one_that_is_more_alike() {
        let names = ["crank_peak_rate_rad_per_s", "crank_peak_stress_pa", "joints.pivot.fx_n", "joints.crank-pin.fx_n"];
        for (given, near) in [
            ("crank_rate", Some("crank_peak_rate_rad_per_s")),
            ("crank_stress", Some("crank_peak_stress_pa")),
            ("pivot.fx_n", Some("joints.pivot.fx_n")),
            ("fx_n", None),
        ] {
            assert_eq!(nearest(given, names), near, "{given}");
        }
        let either = nearest("crank_rate", ["crank_mean_rate_rad_per_s", "crank_peak_rate_rad_per_s", "crank_peak_stress_pa"]);
        assert!(either.is_some_and(|name| name.ends_with("_rate_rad_per_s")), "{either:?}");
    }

    #[test]
    fn regress_columns_of_one_table_are_told_apart_by_their_last_part() {
        let names = ["links.crank.chord_rad", "links.crank.revolutions", "stamp.wall_time", "state"];
        for (given, near) in [
            ("links.crank.angle", None),
            ("links.crank.position", None),
            ("links.crank.chord", Some("links.crank.chord_rad")),
            ("links.crnk.chord_rad", Some("links.crank.chord_rad")),
            ("links.crank.revolution", Some("links.crank.revolutions")),
            ("stamp.time", Some("stamp.wall_time")),
        ] {
            assert_eq!(nearest(given, names), near, "{given}");
        }
        assert_eq!(nearest("y", ["x_m_per_s2", "y_m_per_s2"]), Some("y_m_per_s2"));
        assert_eq!(nearest("torque", ["driving_peak_torque_nm", "driving_mean_torque_nm"]), None, "either may be meant");
    }
}
