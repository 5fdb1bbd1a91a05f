//! A row as a line of text: index, identity, seconds, ending, verdict, numbers, cause, between tabs.

use super::campaign::Sample;
use super::run::{Ending, Outcome, UNBALANCED};

/// The row of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Index of the run.
    pub index: u64,
    /// Identity: the hash of what was run.
    pub id: String,
    /// Computing time, s.
    pub seconds: f64,
    /// The outcome.
    pub outcome: Outcome,
}

/// Verdicts on the energy balance.
const VERDICTS: [&str; 4] = ["balanced", UNBALANCED, "not judged", ""];

impl Row {
    /// The line, with its end.
    pub(super) fn line(&self) -> String {
        let Row { index, id, seconds, outcome } = self;
        let number = |number: &Option<f64>| number.map(|number| format!("{number:?}")).unwrap_or_default();
        let numbers: Vec<String> = outcome.numbers.iter().map(number).collect();
        let cause = outcome.cause.replace(char::is_control, " ");
        format!("{index}\t{id}\t{seconds:?}\t{}\t{}\t{}\t{cause}\n", outcome.ending.as_str(), outcome.verdict, numbers.join("\t"))
    }

    /// Reads a line without its end; `None` of one that is damaged, or has another number of columns.
    pub(super) fn parse(line: &str, columns: usize) -> Option<Self> {
        let fields: Vec<&str> = line.split('\t').collect();
        let [index, id, seconds, ending, verdict, numbers @ .., cause] = fields.as_slice() else { return None };
        if numbers.len() != columns {
            return None;
        }
        let number = |text: &&str| if text.is_empty() { Some(None) } else { text.parse().ok().map(Some) };
        let outcome = Outcome {
            ending: Ending::ALL.into_iter().find(|known| known.as_str() == *ending)?,
            verdict: VERDICTS.into_iter().find(|known| known == verdict)?,
            numbers: numbers.iter().map(number).collect::<Option<_>>()?,
            cause: (*cause).to_owned(),
        };
        Some(Row { index: index.parse().ok()?, id: (*id).to_owned(), seconds: seconds.parse().ok()?, outcome })
    }

    /// Whether it is the row of this sample.
    pub(super) fn is_of(&self, sample: &Sample) -> bool {
        self.index == sample.index && self.id == sample.id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_row_reads_back_to_the_same_bits_and_a_part_of_it_does_not() {
        let numbers = vec![Some(0.1 + 0.2), None, Some(-0.0), Some(1e300), Some(5e-324)];
        let outcome =
            Outcome { ending: Ending::Diverged, cause: "a\tcause\nin lines".to_owned(), verdict: "unbalanced", numbers };
        let row = Row { index: 7, id: "ab".repeat(32), seconds: 1e-3, outcome };
        let line = row.line();
        let read = Row::parse(line.trim_end_matches('\n'), 5).unwrap();
        let cause = "a cause in lines".to_owned();
        assert_eq!(read, Row { outcome: Outcome { cause, ..row.outcome.clone() }, ..row });
        assert_eq!(read.line(), line);
        let ends = 1..line.trim_end().rfind('\t').unwrap();
        assert!(ends.into_iter().all(|end| Row::parse(&line[..end], 5).is_none()));
        assert!(Row::parse(line.trim_end(), 4).is_none() && Row::parse("\0\0\0", 5).is_none());
    }
}
