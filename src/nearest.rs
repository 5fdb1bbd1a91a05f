//! The most similar known name, for error messages.

/// Smallest similarity (Jaro–Winkler, 0 to 1) of a suggestion.
const LIKE: f64 = 0.8;

/// The one of `names` that is most like `given`, if any is like it.
pub(crate) fn nearest<'a>(given: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    names
        .into_iter()
        .map(|name| (strsim::jaro_winkler(given, name), name))
        .filter(|(likeness, _)| *likeness > LIKE)
        .max_by(|one, other| one.0.total_cmp(&other.0))
        .map(|(_, name)| name)
}

/// A question to end a refusal with, if one of `names` is like the one given; else nothing.
pub(crate) fn did_you_mean<'a>(given: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    nearest(given, names).map(|near| format!("; did you mean `{near}`?")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn prop_only_what_is_near_is_suggested() {
        let names = ["length_m", "nodes.crank.4.y_m", "modal", "ref-r5-tip"];
        for (given, near) in
            [("lenght_m", Some("length_m")), ("modla", Some("modal")), ("nosuch", None), ("/tmp", None), ("", None)]
        {
            assert_eq!(nearest(given, names), near, "{given}");
        }
    }
}
