//! Specification of one key: its range and default, which the validation uses, and its row in the scene reference.

/// The value of a key that is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Default<T> {
    /// The key must be given.
    Required,
    /// The key has no default; what it describes is absent.
    Absent,
    /// This value.
    Value(T),
    /// Computed from other keys, in these words.
    Derived(&'static str),
}

/// A number, or a list of numbers, in a range.
#[derive(Debug, Clone, Copy)]
pub(super) struct Number {
    pub name: &'static str,
    pub form: &'static str,
    pub unit: &'static str,
    pub low: f64,
    pub high: f64,
    pub default: Default<f64>,
    pub meaning: &'static str,
}

/// A whole number in a range.
#[derive(Debug, Clone, Copy)]
pub(super) struct Count {
    pub name: &'static str,
    pub low: usize,
    pub high: usize,
    pub default: Default<usize>,
    pub meaning: &'static str,
}

/// `true` or `false`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Boolean {
    pub name: &'static str,
    pub default: bool,
    pub meaning: &'static str,
}

/// One of a few words.
#[derive(Debug, Clone, Copy)]
pub(super) struct Word {
    pub name: &'static str,
    pub words: fn() -> Vec<&'static str>,
    pub default: Default<&'static str>,
    pub meaning: &'static str,
}

/// A table or list, with rules of its own in words.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    pub name: &'static str,
    pub form: &'static str,
    pub unit: &'static str,
    pub is_required: bool,
    pub range: &'static str,
    pub meaning: &'static str,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Key {
    Number(Number),
    Count(Count),
    Boolean(Boolean),
    Word(Word),
    Form(Form),
}

/// A table of a scene file and its keys.
#[derive(Debug, Clone, Copy)]
pub(super) struct Table {
    /// As the reference heads it: `[crank]`, `[rod]` or `[beam]`.
    pub title: &'static str,
    pub keys: &'static [Key],
}

/// One line of the scene reference.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyRow {
    /// The table that the key stands in, such as `[slider]`.
    pub table: &'static str,
    /// The key.
    pub key: &'static str,
    /// Number, whole number, boolean, word, or the form of a list.
    pub kind: String,
    /// Its SI unit; `1` for a number without one, empty where there is no number.
    pub unit: &'static str,
    /// Its default; `required` where it must be given, `–` where it has none.
    pub default: String,
    /// The values allowed.
    pub range: String,
    /// Its meaning.
    pub meaning: &'static str,
}

impl Number {
    /// Whether `value` is in the range; a NaN is not.
    pub(super) fn allows(&self, value: f64) -> bool {
        value >= self.low && value <= self.high
    }

    /// The range in words: `1e-9 to 1e6`.
    pub(super) fn range(&self) -> String {
        format!("{} to {}", short(self.low), short(self.high))
    }
}

impl Key {
    fn name(&self) -> &'static str {
        match self {
            Key::Number(Number { name, .. })
            | Key::Count(Count { name, .. })
            | Key::Boolean(Boolean { name, .. })
            | Key::Word(Word { name, .. })
            | Key::Form(Form { name, .. }) => name,
        }
    }

    pub(super) fn row(&self, table: &'static str) -> KeyRow {
        let (kind, unit, default, range, meaning) = match *self {
            Key::Number(key) => (key.form, key.unit, said(key.default, |value| short(*value)), key.range(), key.meaning),
            Key::Count(key) => {
                ("whole number", "", said(key.default, usize::to_string), format!("{} to {}", key.low, key.high), key.meaning)
            }
            Key::Boolean(key) => ("boolean", "", key.default.to_string(), "true or false".to_owned(), key.meaning),
            Key::Word(key) => ("word", "", said(key.default, |word| (*word).to_owned()), (key.words)().join(", "), key.meaning),
            Key::Form(key) => {
                let default = if key.is_required { "required" } else { "–" };
                (key.form, key.unit, default.to_owned(), key.range.to_owned(), key.meaning)
            }
        };
        KeyRow { table, key: self.name(), kind: kind.to_owned(), unit, default, range, meaning }
    }
}

fn said<T>(default: Default<T>, show: impl Fn(&T) -> String) -> String {
    match default {
        Default::Required => "required".to_owned(),
        Default::Absent => "–".to_owned(),
        Default::Value(value) => show(&value),
        Default::Derived(words) => words.to_owned(),
    }
}

/// A bound as a person would write it.
pub(super) fn short(bound: f64) -> String {
    if bound == 0.0 || (1e-3..1e5).contains(&bound.abs()) { format!("{bound}") } else { format!("{bound:e}") }
}
