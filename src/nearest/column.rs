//! The most similar column of recordings, or signal of `watch`.

use indexmap::IndexSet;

use super::{has_words_of, nearest, question};
use crate::recording::is_stamp_or_time;
use crate::shown::{shown_name, shown_names};
use crate::wire::Topic;

/// Lists whose entries have columns: names begin with them.
const LISTS: [&str; 4] = ["links", "nodes", "joints", "elements"];
/// Words for the end of the last link.
const ENDS: [&str; 3] = ["slider", "tip", "end"];

/// A question to end a refusal with, if a column of a recording, or a signal of `watch`, is like the one given; else nothing.
pub(crate) fn did_you_mean_column<'a>(given: &str, columns: impl IntoIterator<Item = &'a str>) -> String {
    nearest_column(given, columns).map(question).unwrap_or_default()
}

/// The column that `given` means by its words, or else the one that is most like it.
fn nearest_column<'a>(given: &str, columns: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let columns: Vec<&'a str> = columns.into_iter().collect();
    let by_likeness = || nearest(given, columns.iter().copied()).or_else(|| nearest_without_list(given, &columns));
    meant_column(given, &columns).or_else(by_likeness)
}

/// The nearest column of topics, each with its name. One of samples comes first if `given` means it by its words. Checkpoints are
/// left out: they are states to resume from, and some of their fields are named like signals.
fn nearest_column_of_topics<'a>(given: &str, topics: &[(&'a str, Vec<&'a str>)]) -> Option<&'a str> {
    let columns_of = |is_wanted: fn(Option<Topic>) -> bool| -> Vec<&'a str> {
        let wanted = topics.iter().filter(|(topic, _)| is_wanted(Topic::of_key(topic)));
        wanted.flat_map(|(_, columns)| columns.iter().copied()).collect()
    };
    let of_samples = columns_of(|topic| topic.is_some_and(Topic::is_telemetry));
    let all = columns_of(|topic| topic != Some(Topic::Checkpoint));
    meant_column(given, &of_samples).or_else(|| nearest_column(given, all))
}

/// The column that holds what `slider.x_m`, `tip.x_m` or `crank.angle` means, or that of the middle of a link.
fn meant_column<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    let of_angle = || column_of_angle(given, columns);
    column_of_end(given, columns).or_else(of_angle).or_else(|| middle_column(given, columns))
}

/// The column whose name without that of its list is most like `given`: `joints.slider-pin.fx_n` for `slider_pin.fx_n`. `None` if
/// several lists have such a column.
fn nearest_without_list<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    // Without a dot, a name is that of no entry of a list.
    without_list(given)?;
    let near = nearest(given, columns.iter().copied().filter_map(without_list))?;
    let mut named = columns.iter().copied().filter(|column| without_list(column) == Some(near));
    named.next().filter(|_| named.next().is_none())
}

/// The name of a column without that of its list: `pivot.fx_n` for `joints.pivot.fx_n`.
fn without_list(column: &str) -> Option<&str> {
    column.split_once('.').map(|(_, rest)| rest)
}

/// The column of the last node of the last link: of the rod for `slider.x_m`, of the rod or the beam for `tip.x_m`, `tip_x` or
/// `end.x`. The slider moves along x alone: `slider_m` and `slider.speed` need no direction. `watch` names it without `nodes`, and
/// has signals of the slider itself. Links do not deflect at their ends.
fn column_of_end<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    let (end, wanted) = given.split_once(['.', '_']).unwrap_or((given, ""));
    let wanted = match wanted {
        "" | "m" | "position" | "position_m" | "displacement" | "displacement_m" if end == "slider" => "x_m",
        "speed" | "speed_m_per_s" | "velocity" | "velocity_m_per_s" if end == "slider" => "vx_m_per_s",
        _ if wanted.starts_with("deflection") => return None,
        _ => wanted,
    };
    let of_end = |column: &&'a str| column.split_once('.').filter(|(of, _)| *of == end).map(|(_, field)| (*column, field));
    let has_slider = || !columns.contains(&"driving_torque_nm") || columns.contains(&"guide_force_n");
    if !ENDS.contains(&end) || (end == "slider" && !has_slider()) {
        return None;
    }
    let links: &[&str] = if end == "slider" { &["rod"] } else { &["rod", "beam"] };
    let is_wanted = |field: &str| field.strip_prefix(wanted).is_some_and(|unit| unit.is_empty() || unit.starts_with('_'));
    let mut of_end = columns.iter().filter_map(of_end).peekable();
    if of_end.peek().is_some() {
        return of_end.find(|(_, field)| is_wanted(field)).map(|(column, _)| column);
    }
    let node = |column: &str| -> Option<u32> {
        let (link, rest) = column.strip_prefix("nodes.").unwrap_or(column).split_once('.')?;
        let (node, _) = rest.split_once('.').filter(|&(_, field)| links.contains(&link) && is_wanted(field))?;
        node.parse().ok()
    };
    columns.iter().filter_map(|column| Some((node(column)?, *column))).max().map(|(_, column)| column)
}

/// The column of a link's angle, which is that of its chord: `links.crank.chord_rad` for `crank.angle`. An only link may be called
/// crank.
fn column_of_angle<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    let given = given.strip_prefix("links.").unwrap_or(given);
    let given = given.strip_suffix("_rad").unwrap_or(given);
    let link = given.strip_suffix(".angle").or_else(|| given.strip_suffix("_angle"))?;
    let chord = |column: &'a str| Some((column.strip_suffix(".chord_rad")?.rsplit('.').next()?, column));
    let chords: Vec<(&str, &'a str)> = columns.iter().copied().filter_map(chord).collect();
    let is_meant = |of: &str| of == link || (chords.len() == 1 && link == "crank");
    chords.iter().copied().find(|&(of, _)| is_meant(of)).map(|(_, column)| column)
}

/// The middle one of the columns with all words of `given`, where their numbers alone tell them apart:
/// `nodes.rod.2.deflection_m` for `rod.deflection`; also for `links.rod.deflection`, whose list is another, and for the tip.
fn middle_column<'a>(given: &str, columns: &[&'a str]) -> Option<&'a str> {
    let is_left_out = |first: &str| LISTS.contains(&first) || ENDS.contains(&first);
    let rest = given.split_once('.').filter(|&(first, _)| is_left_out(first)).map(|(_, rest)| rest);
    [Some(given), rest].into_iter().flatten().find_map(|words| {
        let mut with_words: Vec<&'a str> = columns.iter().copied().filter(|column| has_words_of(words, column)).collect();
        // The signals of `watch` are sorted by letters: 10 before 2.
        with_words.sort_by_cached_key(|column| numbers(column));
        let middle = *with_words.get(with_words.len() / 2)?;
        with_words.iter().all(|column| without_numbers(column) == without_numbers(middle)).then_some(middle)
    })
}

/// A name with N for each number: `nodes.rod.N.x_m`.
fn without_numbers(name: &str) -> String {
    let parts = name.split('.').map(|part| if part.bytes().all(|byte| byte.is_ascii_digit()) { "N" } else { part });
    parts.collect::<Vec<_>>().join(".")
}

/// The numbers in a name, in order.
fn numbers(name: &str) -> Vec<u64> {
    name.split('.').filter_map(|part| part.parse().ok()).collect()
}

/// The rest of a refusal of a column: those of the topics or tables with this name, the one that is meant, or all.
pub(crate) fn column_hint(given: &str, topics: &[(&str, Vec<&str>)]) -> String {
    let is_named = |topic: &str| !given.is_empty() && (topic == given || topic.ends_with(&format!("/{given}")));
    let named = topics.iter().filter(|(topic, _)| is_named(topic.trim_end_matches('/')));
    let named = columns_by_topic(named.map(|(topic, names)| (*topic, names.iter().copied())));
    if !named.is_empty() {
        return format!("; under this name there are{named}");
    }
    match nearest_column_of_topics(given, topics) {
        // A recording of somebody else may have any name.
        Some(near) => question(shown_name(near)),
        None => format!("; there are{}", columns_by_topic(topics.iter().map(|(topic, names)| (*topic, names.iter().copied())))),
    }
}

/// Columns by topic for a refusal, a line each: numbers in names become N. Stamps, checkpoints and histograms are left out, and
/// lines that are there already, as of another service.
fn columns_by_topic<'a, N: IntoIterator<Item = &'a str>>(topics: impl IntoIterator<Item = (&'a str, N)>) -> String {
    let is_data = |name: &&str| !is_stamp_or_time(name);
    let line = |(topic, names): (&str, N)| {
        let mut names: Vec<String> = names.into_iter().filter(is_data).map(without_numbers).collect();
        names.retain(|name| !name.ends_with(".N"));
        names.sort();
        names.dedup();
        if names.is_empty() || Topic::of_key(topic) == Some(Topic::Checkpoint) {
            return String::new();
        }
        let topic = topic.trim_end_matches('/').rsplit('/').next().unwrap_or(topic);
        format!("\n  {}: {}", shown_name(topic), shown_names(&names))
    };
    topics.into_iter().map(line).collect::<IndexSet<String>>().into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::{column_hint, columns_by_topic, nearest_column, nearest_column_of_topics};

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
            ("slider.x", Some("nodes.rod.10.x_m")),
            ("slider_x_m", Some("nodes.rod.10.x_m")),
            ("slider.vx_m_per_s", Some("nodes.rod.10.vx_m_per_s")),
            ("slider_m", Some("nodes.rod.10.x_m")),
            ("slider", Some("nodes.rod.10.x_m")),
            ("slider.position_m", Some("nodes.rod.10.x_m")),
            ("slider_speed_m_per_s", Some("nodes.rod.10.vx_m_per_s")),
            ("slider.position_y", None),
            ("slider.mass", None),
        ] {
            assert_eq!(nearest_column(given, columns), column, "{given}");
        }
        let signals = ["rod.10.vx_m_per_s", "rod.10.x_m", "slider.vx_m_per_s", "slider.x_m"];
        for given in ["slider.x", "slider_x", "slider", "slider_m", "slider.position"] {
            assert_eq!(nearest_column(given, signals), Some("slider.x_m"), "{given}");
        }
        assert_eq!(nearest_column("slider.speed", signals), Some("slider.vx_m_per_s"));
        // The end of an open chain is no slider.
        let open = [&columns[..], &["driving_torque_nm"]].concat();
        for given in ["slider.x_m", "slider", "slider_m", "slider.speed"] {
            assert_eq!(nearest_column(given, open.iter().copied()), None, "{given}");
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
            (&pendulum, "end.y", "nodes.rod.2.y_m"),
            (&beam, "tip_x", "nodes.beam.8.x_m"),
            (&beam, "end_x_m", "nodes.beam.8.x_m"),
            (&signals, "tip.x", "beam.10.x_m"),
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
            ("xyz", None),
        ] {
            assert_eq!(nearest_column(given, columns.iter().map(String::as_str)), column, "{given}");
        }
    }

    /// An error estimate was suggested, which has the word.
    #[test]
    fn regress_the_angle_of_a_link_is_that_of_its_chord() {
        let chords = ["links.crank.chord_rad", "links.crank.revolutions", "links.rod.chord_rad"];
        let columns = [&chords[..], &["estimated_angle_error_rad"]].concat();
        let signals = ["crank.chord_rad", "rod.chord_rad", "shadow.angle_rad"];
        for given in ["crank.angle", "crank_angle", "crank.angle_rad", "crank_angle_rad", "links.crank.angle"] {
            assert_eq!(nearest_column(given, columns.iter().copied()), Some("links.crank.chord_rad"), "{given}");
            assert_eq!(nearest_column(given, signals), Some("crank.chord_rad"), "{given}");
        }
        assert_eq!(nearest_column("beam.angle", columns), None);
        for (given, column) in [("beam.angle", Some("links.beam.chord_rad")), ("crank.angle", Some("links.beam.chord_rad"))] {
            assert_eq!(nearest_column(given, ["kinetic_j", "links.beam.chord_rad"]), column, "{given}");
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

    /// `energies` led to `energy_verdict`, which is of another topic.
    #[test]
    fn regress_a_topic_in_the_place_of_a_column_is_refused_with_its_columns() {
        let topics = [
            ("flexcrank/crank/checkpoint", vec!["level"]),
            ("flexcrank/crank/energies", vec!["stamp.step", "kinetic_j", "strain_j"]),
            ("flexcrank/crank/status", vec!["energy_verdict"]),
            ("flexcrank/other/energies", vec!["kinetic_j", "strain_j"]),
            ("/robot/arm/", vec!["height_m"]),
        ];
        let energies = "\n  energies: kinetic_j, strain_j";
        for (given, hint) in [
            ("energies", format!("; under this name there are{energies}")),
            ("flexcrank/crank/status", "; under this name there are\n  status: energy_verdict".to_owned()),
            ("crank/energies", format!("; under this name there are{energies}")),
            ("arm", "; under this name there are\n  arm: height_m".to_owned()),
            ("energy", "; did you mean `energy_verdict`?".to_owned()),
            ("checkpoint", format!("; there are{energies}\n  status: energy_verdict\n  arm: height_m")),
            ("", format!("; there are{energies}\n  status: energy_verdict\n  arm: height_m")),
        ] {
            assert_eq!(column_hint(given, &topics), hint, "{given}");
        }
    }
}
