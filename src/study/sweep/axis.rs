//! A key that varies, and its values.

/// Whole numbers of at most this size are exact.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// A key that varies.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Key of the scene, as in `--set`.
    pub key: String,
    /// Its values.
    pub levels: Levels,
}

/// The values of a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Levels {
    /// Numbers between two bounds.
    Range {
        /// The least.
        min: f64,
        /// The greatest.
        max: f64,
        /// Whether equal ratios are equally likely, instead of equal differences.
        log: bool,
        /// Number of values on a grid, both bounds included; 0 elsewhere.
        count: u64,
    },
    /// Listed values, equally likely.
    Listed(Vec<toml::Value>),
}

/// A value of a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number from a range.
    Number(f64),
    /// A listed value.
    Listed(toml::Value),
}

impl Axis {
    /// Number of values on a grid.
    pub(super) fn grid_count(&self) -> u64 {
        match &self.levels {
            Levels::Range { count, .. } => *count,
            Levels::Listed(values) => values.len() as u64,
        }
    }

    /// The value at `place` of a grid.
    pub(super) fn on_grid(&self, place: u64) -> Value {
        match &self.levels {
            Levels::Range { min, max, log, count } => {
                let last = count.saturating_sub(1).max(1);
                let share = place as f64 / last as f64;
                // Free of rounding where it is a whole number, as keys of counts need it.
                let even = (min * (last - place.min(last)) as f64 + max * place as f64) / last as f64;
                match self.at(share) {
                    Value::Number(_) if !log && even.fract() == 0.0 => Value::Number(even),
                    Value::Number(within) if 0 < place && place < last => {
                        let size = if *log { within } else { min.abs().max(max.abs()) };
                        Value::Number(without_rounding(within, size).clamp(*min, *max))
                    }
                    bound => bound,
                }
            }
            Levels::Listed(values) => Value::Listed(values[(place as usize).min(values.len() - 1)].clone()),
        }
    }

    /// The value at `share` of the way, from 0 to 1.
    pub(super) fn at(&self, share: f64) -> Value {
        match &self.levels {
            // Both bounds are met exactly.
            Levels::Range { min, max, log: false, .. } => Value::Number(min * (1.0 - share) + max * share),
            Levels::Range { min, max, log: true, .. } => {
                let value = (min.ln() * (1.0 - share) + max.ln() * share).exp();
                Value::Number(match share {
                    0.0 => *min,
                    1.0 => *max,
                    _ => value.clamp(*min, *max),
                })
            }
            Levels::Listed(values) => {
                let place = (share * values.len() as f64) as usize;
                Value::Listed(values[place.min(values.len() - 1)].clone())
            }
        }
    }

    /// Whether all values are numbers.
    pub fn is_number(&self) -> bool {
        match &self.levels {
            Levels::Range { .. } => true,
            Levels::Listed(values) => values.iter().all(|value| value.is_float() || value.is_integer()),
        }
    }
}

/// A number that comes of others of this size, without the digits beyond their 15th: 0.15 for 0.15000000000000002.
fn without_rounding(number: f64, size: f64) -> f64 {
    let places = 14.0 - size.log10().floor();
    // Larger numbers have no places to leave out, and smaller ones than this have too many to write.
    if !(0.0..=300.0).contains(&places) {
        return number;
    }
    format!("{number:.*}", places as usize).parse().map_or(number, |rounded: f64| rounded + 0.0)
}

impl Value {
    /// The value as TOML. A whole number has no point: keys of counts take it, and keys of measures as well.
    pub(super) fn toml(&self) -> String {
        match self {
            Value::Number(number) if number.fract() == 0.0 && number.abs() <= EXACT => (*number as i64).to_string(),
            // Rust writes the shortest digits that read back to the same bits, always with a point or an exponent.
            Value::Number(number) => format!("{number:?}"),
            Value::Listed(value) => value.to_string(),
        }
    }

    /// The value as a number; `None` for words and lists.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Number(number) => Some(*number),
            Value::Listed(value) => value.as_float().or(value.as_integer().map(|integer| integer as f64)),
        }
    }

    /// The value as a word: as TOML, without quotes around a string.
    pub fn word(&self) -> String {
        match self {
            Value::Listed(toml::Value::String(word)) => word.clone(),
            other => other.toml(),
        }
    }
}
