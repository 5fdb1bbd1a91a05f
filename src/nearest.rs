//! The most similar known name, for error messages.

#[cfg(feature = "service")]
use crate::recording::is_stamp_or_time;
#[cfg(feature = "service")]
use crate::shown::{shown_name, shown_names};
#[cfg(feature = "service")]
use crate::wire::Topic;

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

/// The same for one of the columns of a recording, or of the signals of `watch`.
#[cfg(feature = "service")]
pub(crate) fn did_you_mean_column<'a>(given: &str, columns: impl IntoIterator<Item = &'a str>) -> String {
    nearest_column(given, columns).map(question).unwrap_or_default()
}

fn question(near: &str) -> String {
    format!("; did you mean `{near}`?")
}

/// The column that `given` means by its words, or else the one that is most like it.
#[cfg(feature = "service")]
pub(crate) fn nearest_column<'a>(given: &str, columns: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let columns: Vec<&'a str> = columns.into_iter().collect();
    let by_likeness = || nearest(given, columns.iter().copied()).or_else(|| nearest_without_list(given, &columns));
    meant_column(given, &columns).or_else(by_likeness)
}

/// The nearest column of topics, each with its name. One of samples comes first if `given` means it by its words. Checkpoints are
/// left out: they are states to resume from, and some of their fields are named like signals.
#[cfg(feature = "service")]
pub(crate) fn nearest_column_of_topics<'a>(given: &str, topics: &[(&'a str, Vec<&'a str>)]) -> Option<&'a str> {
    let columns_of = |is_wanted: fn(Option<Topic>) -> bool| -> Vec<&'a str> {
        let wanted = topics.iter().filter(|(topic, _)| is_wanted(Topic::of_key(topic)));
        wanted.flat_map(|(_, columns)| columns.iter().copied()).collect()
    };
    let of_samples = columns_of(|topic| topic.is_some_and(Topic::is_telemetry));
    let all = columns_of(|topic| topic != Some(Topic::Checkpoint));
    meant_column(given, &of_samples).or_else(|| nearest_column(given, all))
}

/// The column that holds what `slider.x_m` or `tip.x_m` means, or that of the middle of a link.
#[cfg(feature = "service")]
fn meant_column<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    column_of_end(given, columns).or_else(|| middle_column(given, columns))
}

/// The column whose name without that of its list is most like `given`: `joints.slider-pin.fx_n` for `slider_pin.fx_n`. `None` if
/// several lists have such a column.
#[cfg(feature = "service")]
fn nearest_without_list<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    // Without a dot, a name is that of no entry of a list.
    without_list(given)?;
    let near = nearest(given, columns.iter().copied().filter_map(without_list))?;
    let mut named = columns.iter().copied().filter(|column| without_list(column) == Some(near));
    named.next().filter(|_| named.next().is_none())
}

/// The name of a column without that of its list: `pivot.fx_n` for `joints.pivot.fx_n`.
#[cfg(feature = "service")]
fn without_list(column: &str) -> Option<&str> {
    column.split_once('.').map(|(_, rest)| rest)
}

/// The column of the last node of the last link: of the rod for `slider.x_m`, of the rod or the beam for `tip.x_m`. `watch` names
/// it without `nodes`. Links do not deflect at their ends.
#[cfg(feature = "service")]
fn column_of_end<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    let (end, wanted) = given.split_once('.').filter(|(_, wanted)| !wanted.starts_with("deflection"))?;
    let links: &[&str] = match end {
        "slider" => &["rod"],
        "tip" => &["rod", "beam"],
        _ => return None,
    };
    let node = |column: &str| -> Option<u32> {
        let (link, rest) = column.strip_prefix("nodes.").unwrap_or(column).split_once('.')?;
        let (node, _) = rest.split_once('.').filter(|(_, field)| links.contains(&link) && *field == wanted)?;
        node.parse().ok()
    };
    columns.iter().filter_map(|column| Some((node(column)?, *column))).max().map(|(_, column)| column)
}

/// The middle one of the columns with all words of `given`, where their numbers alone tell them apart:
/// `nodes.rod.2.deflection_m` for `rod.deflection`; also for `links.rod.deflection`, whose list is another.
#[cfg(feature = "service")]
fn middle_column<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    [Some(given), without_list(given)].into_iter().flatten().find_map(|words| {
        let mut with_words: Vec<&'a str> = columns.iter().copied().filter(|column| has_words_of(words, column)).collect();
        // The signals of `watch` are sorted by letters: 10 before 2.
        with_words.sort_by_cached_key(|column| numbers(column));
        let middle = *with_words.get(with_words.len() / 2)?;
        with_words.iter().all(|column| without_numbers(column) == without_numbers(middle)).then_some(middle)
    })
}

/// A name with N for each number: `nodes.rod.N.x_m`.
#[cfg(feature = "service")]
fn without_numbers(name: &str) -> String {
    let parts = name.split('.').map(|part| if part.bytes().all(|byte| byte.is_ascii_digit()) { "N" } else { part });
    parts.collect::<Vec<_>>().join(".")
}

/// The numbers in a name, in order.
#[cfg(feature = "service")]
fn numbers(name: &str) -> Vec<u64> {
    name.split('.').filter_map(|part| part.parse().ok()).collect()
}

/// Columns by topic for a refusal, a line each: numbers in names become N. Stamps, checkpoints and histograms are left out.
#[cfg(feature = "service")]
pub(crate) fn columns_by_topic<'a, N: IntoIterator<Item = &'a str>>(topics: impl IntoIterator<Item = (&'a str, N)>) -> String {
    let is_data = |name: &&str| !is_stamp_or_time(name);
    let line = |(topic, names): (&str, N)| {
        let mut names: Vec<String> = names.into_iter().filter(is_data).map(without_numbers).collect();
        names.retain(|name| !name.ends_with(".N"));
        names.sort();
        names.dedup();
        if names.is_empty() || Topic::of_key(topic) == Some(Topic::Checkpoint) {
            return String::new();
        }
        let topic = topic.rsplit('/').next().unwrap_or(topic);
        format!("\n  {}: {}", shown_name(topic), shown_names(&names))
    };
    topics.into_iter().map(line).collect()
}

#[cfg(all(test, feature = "service"))]
mod tests {
    use super::{columns_by_topic, nearest, nearest_column, nearest_column_of_topics};

    #[test]
    fn val_columns_are_listed_by_topic() {
        let loads = ["log_time", "stamp.step", "driving_torque_nm", "elements.rod.0.axial_n", "elements.rod.10.axial_n"];
        let status = ["state", "lateness.counts.0", "lateness.counts.27"];
        let topics = [("loads", loads.as_slice()), ("checkpoint", &["epoch"]), ("status", &status)];
        let listed = topics.map(|(topic, names)| (format!("flexcrank/crank/{topic}"), names));
        let listed = columns_by_topic(listed.iter().map(|(topic, names)| (topic.as_str(), names.iter().copied())));
        assert_eq!(listed, "\n  loads: driving_torque_nm, elements.rod.N.axial_n\n  status: state");
    }

    #[test]
    fn regress_the_slider_of_watch_is_the_last_node_of_the_rod() {
        let columns = ["nodes.crank.10.x_m", "nodes.rod.0.x_m", "nodes.rod.10.x_m", "nodes.rod.9.x_m", "nodes.rod.10.vx_m_per_s"];
        for (given, column) in [
            ("slider.x_m", Some("nodes.rod.10.x_m")),
            ("slider.vx_m_per_s", Some("nodes.rod.10.vx_m_per_s")),
            ("slider.mass", None),
        ] {
            assert_eq!(nearest_column(given, columns), column, "{given}");
        }
    }

    #[test]
    fn regress_the_tip_is_the_last_node_of_the_last_link() {
        let nodes = |link: &str, last: u32, list: &str| -> Vec<String> {
            let fields = ["x_m", "y_m", "deflection_m"];
            let mut names: Vec<String> =
                (0..=last).flat_map(|node| fields.map(|field| format!("{list}{link}.{node}.{field}"))).collect();
            names.sort();
            names
        };
        let beam = nodes("beam", 8, "nodes.");
        let signals = nodes("beam", 10, "");
        let pendulum = [nodes("crank", 10, "nodes."), nodes("rod", 2, "nodes.")].concat();
        for (columns, given, column) in [
            (&beam, "tip.y_m", "nodes.beam.8.y_m"),
            (&signals, "tip.y_m", "beam.10.y_m"),
            (&pendulum, "tip.x_m", "nodes.rod.2.x_m"),
            // An end does not deflect from the chord, the middle does.
            (&beam, "tip.deflection_m", "nodes.beam.4.deflection_m"),
            (&signals, "beam.deflection_m", "beam.5.deflection_m"),
            (&signals, "links.beam.deflection", "beam.5.deflection_m"),
        ] {
            assert_eq!(nearest_column(given, columns.iter().map(String::as_str)), Some(column), "{given}");
        }
    }

    #[test]
    fn regress_a_column_of_a_link_under_the_name_of_another_list_is_that_of_its_middle() {
        let columns = ["log_time", "links.rod.chord_rad", "kinetic_j", "estimated_deflection_error_m"].map(str::to_owned);
        let nodes = (0..=8).flat_map(|node| ["crank", "rod"].map(|link| format!("nodes.{link}.{node}.deflection_m")));
        let elements = (0..8).map(|element| format!("elements.rod.{element}.axial_n"));
        let columns: Vec<String> = columns.into_iter().chain(nodes).chain(elements).collect();
        for (given, column) in [
            ("links.rod.deflection", Some("nodes.rod.4.deflection_m")),
            ("rod.deflection_m", Some("nodes.rod.4.deflection_m")),
            ("links.rod.axial", Some("elements.rod.4.axial_n")),
            ("links.crank.2.deflection", Some("nodes.crank.2.deflection_m")),
            ("links.kinetic", Some("kinetic_j")),
            ("deflection", None),
            ("links.rod.angle", None),
            ("xyz", None),
        ] {
            assert_eq!(nearest_column(given, columns.iter().map(String::as_str)), column, "{given}");
        }
    }

    #[test]
    fn regress_a_misspelt_name_without_that_of_its_list_is_near() {
        let joints =
            ["pivot", "crank-pin", "slider-pin"].map(|joint| ["fx_n", "fy_n"].map(|force| format!("joints.{joint}.{force}")));
        let signals = joints.as_flattened().iter().filter_map(|column| column.strip_prefix("joints."));
        let signals: Vec<&str> = signals.collect();
        for given in ["slider_pin.fx_n", "slider-pin.fx_N", "slider_pin.fx"] {
            let columns = joints.as_flattened().iter().map(String::as_str);
            assert_eq!(nearest_column(given, columns), Some("joints.slider-pin.fx_n"), "{given}");
            assert_eq!(nearest_column(given, signals.iter().copied()), Some("slider-pin.fx_n"), "{given}");
        }
        let nodes = ["nodes.rod.2.deflection_m", "nodes.rod.3.x_m", "nodes.rod.4.deflection_m"];
        for (given, column) in [("rod.2.defl", Some("nodes.rod.2.deflection_m")), ("rod_deflexion", None)] {
            assert_eq!(nearest_column(given, nodes), column, "{given}");
        }
    }

    #[test]
    fn regress_columns_of_samples_come_before_others_and_fields_of_checkpoints_never() {
        let topics = [
            ("flexcrank/crank/checkpoint", vec!["stamp.step", "torque_nm", "fallen_j"]),
            ("flexcrank/crank/commands", vec!["reply.reason", "torque.id", "torque.torque_nm"]),
            ("flexcrank/crank/loads", vec!["stamp.step", "driving_torque_nm"]),
            ("flexcrank/crank/status", vec!["pulses_pending"]),
        ];
        for (given, column) in [
            ("torque", Some("driving_torque_nm")),
            ("torque_nm", Some("driving_torque_nm")),
            ("reply.reasn", Some("reply.reason")),
            ("pulses", Some("pulses_pending")),
            ("fallen", None),
        ] {
            assert_eq!(nearest_column_of_topics(given, &topics), column, "{given}");
        }
    }

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
