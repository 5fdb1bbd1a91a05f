//! Numbers with a comma: they are refused, with the number as it should be written.

/// A hint at the decimal point if `text` is a number with a comma in its place, perhaps with a unit, or a range with such numbers: `0,15`,
/// `1,5s`, `0,1:0,6:51`.
pub(crate) fn decimal_comma_hint(text: &str) -> Option<String> {
    let with_point = |part: &str| if part.contains(',') { pointed(part) } else { Some(part.to_owned()) };
    let parts: Vec<String> = text.split(':').map(with_point).collect::<Option<_>>()?;
    text.contains(',').then(|| format!("a number has a decimal point, not a comma: {}", parts.join(":")))
}

/// The number with a point in place of its only comma.
fn pointed(text: &str) -> Option<String> {
    let (whole, rest) = text.split_once(',')?;
    let digits = whole.trim_start_matches(['+', '-']);
    let is_whole = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let after_digits = rest.trim_start_matches(|c: char| c.is_ascii_digit());
    let is_decimal = is_whole && after_digits.len() < rest.len() && !after_digits.starts_with('.') && !rest.contains(',');
    is_decimal.then(|| format!("{whole}.{rest}"))
}

/// A hint at the number as TOML has it if `text` is one with commas between thousands: `12,000,000`, `-1,500.5`. A single comma,
/// as in `1,500`, may also be a decimal comma.
pub(crate) fn thousands_commas_hint(text: &str) -> Option<String> {
    let text = text.trim_end_matches('.');
    let value: f64 = text.replace(',', "").parse().ok().filter(|value: &f64| value.is_finite())?;
    let unsigned = text.trim_start_matches(['+', '-']);
    let (whole, rest) = unsigned.split_at(unsigned.find(['.', 'e', 'E']).unwrap_or(unsigned.len()));
    let (first, thousands) = whole.split_once(',')?;
    let are_digits = |group: &str| group.bytes().all(|byte| byte.is_ascii_digit());
    let is_grouped = (1..=3).contains(&first.len())
        && !first.starts_with('0')
        && are_digits(first)
        && thousands.split(',').all(|group| group.len() == 3 && are_digits(group));
    let may_be_decimal = !thousands.contains(',') && !rest.starts_with('.');
    let decimal = if may_be_decimal { format!(", or with a decimal point {}", text.replace(',', ".")) } else { String::new() };
    is_grouped.then(|| format!("a number has no commas: {} or {value:e}{decimal}", text.replace(',', "_")))
}

#[cfg(test)]
mod tests {
    use super::{decimal_comma_hint, thousands_commas_hint};

    #[test]
    fn val_a_decimal_comma_is_told_from_a_list() {
        for (text, number) in [
            ("0,15", "0.15"),
            ("-1,5", "-1.5"),
            ("1,5s", "1.5s"),
            ("3,2e-4", "3.2e-4"),
            ("1,5:5:0.1", "1.5:5:0.1"),
            ("0,1:0,6:51", "0.1:0.6:51"),
        ] {
            let hint = decimal_comma_hint(text).unwrap_or_default();
            assert_eq!(hint, format!("a number has a decimal point, not a comma: {number}"), "{text}");
        }
        for text in
            ["", "0.15", "1,2,3", "1,2.5", "0.1,0.2", ",5", "1,", "1, 2", "a,b", "[0,5", "angles,loads", "1:2,3,4", "a,b:0,5"]
        {
            assert_eq!(decimal_comma_hint(text), None, "{text}");
        }
    }

    #[test]
    fn val_commas_between_thousands_are_told_from_decimal_commas_and_lists() {
        for (text, number) in [
            ("12,000,000,000", "12_000_000_000 or 1.2e10"),
            ("-1,500.5", "-1_500.5 or -1.5005e3"),
            ("12,000,000.", "12_000_000 or 1.2e7"),
            ("210,000e6", "210_000e6 or 2.1e11, or with a decimal point 210.000e6"),
            ("1,500", "1_500 or 1.5e3, or with a decimal point 1.500"),
        ] {
            assert_eq!(thousands_commas_hint(text), Some(format!("a number has no commas: {number}")), "{text}");
        }
        for text in [
            "",
            "12",
            "0,015",
            "0,150",
            "1,5",
            "1,2,3",
            "12,00,000",
            "1234,567",
            "1,000,",
            ",000",
            "a,bcd",
            "1,nan",
            "12,000e400",
        ] {
            assert_eq!(thousands_commas_hint(text), None, "{text}");
        }
    }
}
