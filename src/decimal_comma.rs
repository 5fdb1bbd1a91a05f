//! Numbers with a decimal comma: they are refused, with the number as it should be written.

/// A hint at the decimal point if `text` is a number with a comma in its place, perhaps with a unit or more numbers after it: `0,15`,
/// `1,5s`.
pub(crate) fn decimal_comma_hint(text: &str) -> Option<String> {
    let (whole, rest) = text.split_once(',')?;
    let digits = whole.trim_start_matches(['+', '-']);
    let is_whole = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let is_decimal = is_whole && rest.starts_with(|c: char| c.is_ascii_digit()) && !rest.contains(',');
    is_decimal.then(|| format!("a number has a decimal point, not a comma: {whole}.{rest}"))
}

#[cfg(test)]
mod tests {
    use super::decimal_comma_hint;

    #[test]
    fn val_a_decimal_comma_is_told_from_a_list() {
        for (text, number) in
            [("0,15", "0.15"), ("-1,5", "-1.5"), ("1,5s", "1.5s"), ("3,2e-4", "3.2e-4"), ("1,5:5:0.1", "1.5:5:0.1")]
        {
            let hint = decimal_comma_hint(text).unwrap_or_default();
            assert_eq!(hint, format!("a number has a decimal point, not a comma: {number}"), "{text}");
        }
        for text in ["", "0.15", "1,2,3", "0.1,0.2", ",5", "1,", "1, 2", "a,b", "[0,5", "angles,loads"] {
            assert_eq!(decimal_comma_hint(text), None, "{text}");
        }
    }
}
