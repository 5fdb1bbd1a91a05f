//! Cells of a column that wait to be written, and what they are as a page.

use super::thrift::varint;
use crate::recording::export::learn::Kind;
use crate::recording::rows::Cell;

/// Cells of a column.
pub(super) struct Cells {
    /// Whether there is a cell in each row.
    there: Vec<bool>,
    values: Values,
}

enum Values {
    Integers(Vec<i64>),
    Numbers(Vec<f64>),
    Flags(Vec<bool>),
    Texts(Vec<String>),
}

impl Cells {
    pub fn new(kind: Kind) -> Self {
        let values = match kind {
            Kind::Integer | Kind::Time => Values::Integers(Vec::new()),
            Kind::Number => Values::Numbers(Vec::new()),
            Kind::Flag => Values::Flags(Vec::new()),
            Kind::Text => Values::Texts(Vec::new()),
        };
        Cells { there: Vec::new(), values }
    }

    /// Takes the cell of the next row, if it has one; returns about how many bytes it takes.
    pub fn push(&mut self, cell: Option<&Cell>) -> usize {
        let size = match (&mut self.values, cell) {
            (Values::Integers(values), Some(Cell::Integer(value) | Cell::Time(value))) => keep(values, *value),
            (Values::Numbers(values), Some(cell)) => keep(values, cell.number()),
            (Values::Flags(values), Some(Cell::Flag(value))) => keep(values, *value),
            (Values::Texts(values), Some(cell)) => {
                let text = cell.to_string();
                text.len() + keep(values, text)
            }
            // A column's type was learned from the same cells: only where there is none.
            (Values::Integers(_) | Values::Numbers(_) | Values::Flags(_) | Values::Texts(_), _) => 0,
        };
        self.there.push(size > 0);
        size + 1
    }

    pub fn rows(&self) -> usize {
        self.there.len()
    }

    /// All of them as the body of a data page, not compressed: which rows have a value, then the values one after the other.
    /// <https://parquet.apache.org/docs/file-format/data-pages/encodings/>
    pub fn take_page(&mut self) -> Vec<u8> {
        let levels = runs(&self.there);
        let mut page = (levels.len() as u32).to_le_bytes().to_vec();
        page.extend(levels);
        match &mut self.values {
            Values::Integers(values) => values.drain(..).for_each(|value| page.extend(value.to_le_bytes())),
            Values::Numbers(values) => values.drain(..).for_each(|value| page.extend(value.to_le_bytes())),
            Values::Flags(values) => {
                let byte = |flags: &[bool]| flags.iter().rev().fold(0, |byte, flag| byte << 1 | u8::from(*flag));
                page.extend(values.chunks(8).map(byte));
                values.clear();
            }
            Values::Texts(values) => values.drain(..).for_each(|text| {
                page.extend((text.len() as u32).to_le_bytes());
                page.extend(text.into_bytes());
            }),
        }
        self.there.clear();
        page
    }
}

fn keep<T>(values: &mut Vec<T>, value: T) -> usize {
    values.push(value);
    size_of::<T>()
}

/// Definition levels as runs: twice the length of each, and its level.
fn runs(there: &[bool]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for run in there.chunk_by(|a, b| a == b) {
        varint(&mut bytes, 2 * run.len() as u64);
        bytes.push(u8::from(run[0]));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_page_says_where_values_are_and_then_what() {
        let mut flags = Cells::new(Kind::Flag);
        for flag in [Some(true), None, None, Some(false), Some(true)] {
            flags.push(flag.map(Cell::Flag).as_ref());
        }
        assert_eq!(flags.rows(), 5);
        assert_eq!(flags.take_page(), [6, 0, 0, 0, 2, 1, 4, 0, 4, 1, 0b101]);
        assert_eq!(flags.rows(), 0);
    }

    #[test]
    fn val_whole_numbers_among_others_are_numbers() {
        let mut numbers = Cells::new(Kind::Number);
        numbers.push(Some(&Cell::Integer(2)));
        assert_eq!(numbers.take_page()[6..], 2_f64.to_le_bytes());
        let mut texts = Cells::new(Kind::Text);
        texts.push(Some(&Cell::Integer(7)));
        assert_eq!(texts.take_page()[6..], [1, 0, 0, 0, b'7']);
    }
}
