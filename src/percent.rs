//! Shares in per cent: they are refused, with the number as it should be written.

use crate::shown::figure;

/// A hint at the number to write if `text` is one in per cent: `1%`, `0.5 %`.
pub(crate) fn percent_hint(text: &str) -> Option<String> {
    let percent: f64 = text.strip_suffix('%')?.trim_end().parse().ok()?;
    percent.is_finite().then(|| format!("{text} is written as {}", figure(0.01 * percent)))
}

#[cfg(test)]
mod tests {
    use super::percent_hint;

    #[test]
    fn val_per_cent_are_hundredths() {
        for (text, number) in [("1%", "0.01"), ("0.7%", "0.007"), ("50 %", "0.5"), ("-3%", "-0.03"), ("1e2%", "1")] {
            assert_eq!(percent_hint(text), Some(format!("{text} is written as {number}")));
        }
        for text in ["", "%", "1", "a%", "inf%", "1% 2", "1%%"] {
            assert_eq!(percent_hint(text), None, "{text}");
        }
    }
}
