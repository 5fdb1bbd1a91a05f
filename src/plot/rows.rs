//! The rows of a table as curves: one line, several lines, or points.

use std::ops::Range;

use indexmap::IndexMap;

use crate::study::Table;
use crate::study::sweep::INDEX;

/// Column of the simulated time.
pub const SIMULATED_TIME: &str = "stamp.sim_time_s";
/// Most curves of one table: more would look alike.
const MOST: usize = 28;

/// The way that the rows of a table are drawn.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Rows {
    /// One line through all.
    Line,
    /// Several lines: names in the legend, and rows.
    Curves(Vec<(String, Vec<usize>)>),
    /// Points: the rows have no order.
    Points,
}

impl Rows {
    /// The rows of `y` over `x`: a curve for each ratio of a table from `cycle`. Otherwise one line if `x` rises or falls from row to
    /// row, or a curve for each word of a column if it does so within the rows of each word, or for each value of a second key of a
    /// campaign.
    pub fn of(table: &Table, x: &str, y: &str) -> Self {
        let ratios = ratios(table).map(runs).filter(|runs| runs.len() > 1 && x != "ratio" && y != "ratio");
        match ratios {
            Some(runs) => {
                let curve = |(ratio, rows): (f64, Range<usize>)| (format!("λ = {ratio}"), rows.collect::<Vec<usize>>());
                Rows::Curves(runs.into_iter().map(curve).collect())
            }
            None => Rows::in_order(table, x, y),
        }
    }

    /// The rows by the order of `x`, or of the first column: rows in the order of time may draw a path. The index of a campaign
    /// only numbers its runs.
    fn in_order(table: &Table, x: &str, y: &str) -> Self {
        let names = [Some(x), numbers(table).next().filter(|name| *name != INDEX)];
        let orders: Vec<&[f64]> = names.into_iter().flatten().filter_map(|name| table.column(name)).collect();
        // Rows of a recording follow one another, also where a reset has begun the time again.
        let is_recorded = table.column(SIMULATED_TIME).is_some();
        if is_recorded || orders.iter().any(|order| is_monotone(order.iter().copied())) {
            return Rows::Line;
        }
        let fits = |curves: &Vec<(String, Vec<usize>)>| {
            let part = |order: &[f64], rows: &[usize]| is_monotone(rows.iter().filter_map(|row| order.get(*row).copied()));
            // A name for each row tells no curves apart.
            let few = curves.len() <= MOST && 2 * curves.len() <= table.rows();
            few && orders.iter().any(|order| curves.iter().all(|(_, rows)| part(order, rows)))
        };
        let words = table.word_columns().map(|(_, words)| grouped(words, |word| word.as_str(), |word| word.clone()));
        words.into_iter().find(fits).or_else(|| grid(table, x, y)).map_or(Rows::Points, Rows::Curves)
    }
}

/// Names of the columns with numbers. The ratios that curves are named after are no data.
pub(super) fn numbers(table: &Table) -> impl Iterator<Item = &str> {
    let is_named_after = ratios(table).is_some();
    let is_data = move |name: &str| name != "ratio" || !is_named_after;
    table.columns().filter(move |(name, values)| is_data(name) && has_numbers(values)).map(|(name, _)| name)
}

/// The column that the others are drawn over where none is asked for: the simulated time of exported topics, or else the first with
/// numbers.
pub(super) fn abscissa(table: &Table) -> Option<&str> {
    numbers(table).find(|name| *name == SIMULATED_TIME).or_else(|| numbers(table).next())
}

/// Whether there is anything to draw among values.
pub(super) fn has_numbers(values: &[f64]) -> bool {
    values.iter().any(|value| value.is_finite())
}

/// The ratios of a table that goes through many rows for each; where every row has its own, it is a column like others.
fn ratios(table: &Table) -> Option<&[f64]> {
    table.column("ratio").filter(|ratios| runs(ratios).iter().any(|(_, rows)| rows.len() > 1))
}

/// Rows with the same value, in succession.
pub(super) fn runs(values: &[f64]) -> Vec<(f64, Range<usize>)> {
    let mut runs: Vec<(f64, Range<usize>)> = Vec::new();
    for (row, value) in values.iter().enumerate() {
        match runs.last_mut() {
            Some((of, rows)) if of.to_bits() == value.to_bits() => rows.end = row + 1,
            _ => runs.push((*value, row..row + 1)),
        }
    }
    runs
}

/// The runs of a campaign over a grid of the key `x` and another: a curve for each value of the other key, in the order of `x`. Runs
/// may be missing, as those that failed.
fn grid(table: &Table, x: &str, y: &str) -> Option<Vec<(String, Vec<usize>)>> {
    let xs = table.column(x).filter(|_| table.column(INDEX).is_some() && is_key(x))?;
    let places = grouped(xs, |x| x.to_bits(), f64::to_string).len();
    let is_grid = |curves: &Vec<(String, Vec<usize>)>| {
        let is_distinct = |(_, rows): &(String, Vec<usize>)| rows.windows(2).all(|pair| xs[pair[0]] < xs[pair[1]]);
        let most = places * curves.len();
        curves.len() > 1 && curves.len() <= MOST && 2 * table.rows() > most && curves.iter().all(is_distinct)
    };
    let keys = table.columns().filter(|(name, _)| is_key(name) && ![x, y].contains(name));
    let curves = keys.map(|(name, values)| {
        let mut curves = grouped(values, |value| value.to_bits(), |value| format!("{name} = {value}"));
        curves.iter_mut().for_each(|(_, rows)| rows.sort_by(|one, other| xs[*one].total_cmp(&xs[*other])));
        curves
    });
    curves.into_iter().find(is_grid)
}

/// Whether a column of a campaign is a key of its scene. Results are single words: `pivot_peak_force_n`.
fn is_key(name: &str) -> bool {
    name.contains('.')
}

/// The rows of every entry, with a name for the legend, in the order of their first rows.
fn grouped<'a, T, K: std::hash::Hash + Eq>(
    entries: &'a [T],
    key: impl Fn(&'a T) -> K,
    name: impl Fn(&T) -> String,
) -> Vec<(String, Vec<usize>)> {
    let mut rows: IndexMap<K, Vec<usize>> = IndexMap::new();
    for (row, entry) in entries.iter().enumerate() {
        rows.entry(key(entry)).or_default().push(row);
    }
    rows.into_values().map(|rows| (name(&entries[rows[0]]), rows)).collect()
}

/// Whether values rise from each to the next, or fall from each to the next. Gaps are passed over.
fn is_monotone(values: impl Iterator<Item = f64>) -> bool {
    let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let pairs = || values.windows(2);
    pairs().all(|pair| pair[0] < pair[1]) || pairs().all(|pair| pair[0] > pair[1])
}
