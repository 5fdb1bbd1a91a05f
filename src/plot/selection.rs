//! Figures of columns that are asked for by name, or of all of them.

use std::borrow::Cow;

use super::error::PlotError;
use super::figure::{Axis, Figure, Mark, Panel, Series};
use super::joined::{Column, joined};
use super::quantity;
use super::rows::{Rows, abscissa, has_numbers, numbers};
use super::session_time::{self, broken_at_resets};
use crate::nearest::column_hint;
use crate::study::Table;
use crate::wire::Topic;

/// A table and its name in errors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Named {
    /// Name of a file or topic.
    pub name: String,
    /// Its numbers.
    pub table: Table,
    /// Its columns of text with their texts; the numbers of such a column are the places of its texts.
    pub texts: Vec<(String, Vec<String>)>,
}

impl Named {
    /// The texts of a column of text; `None` of other columns.
    pub(super) fn texts_of(&self, column: &str) -> Option<&[String]> {
        self.texts.iter().find(|(name, _)| name == column).map(|(_, texts)| texts.as_slice())
    }

    /// Names of the columns that can be drawn: those with numbers.
    fn drawable_columns(&self) -> impl Iterator<Item = &str> {
        let columns = self.table.columns();
        columns.filter(move |(name, values)| has_numbers(values) && self.texts_of(name).is_none()).map(|(name, _)| name)
    }

    /// Whether it has a column of this name that can be drawn.
    fn can_draw(&self, column: &str) -> bool {
        self.drawable_columns().any(|name| name == column)
    }
}

/// A figure of the columns `ys` over the column `x`, with a panel for each unit. Its title names the columns, each of which may be
/// given without the name of its list: `pivot.fx_n`. Columns of different topics of a recording are joined by simulated time.
///
/// Without `x`, the table's simulated time, or else its first column with numbers. Lines are broken at resets.
///
/// A table with a `ratio` column, as `cycle` makes it, gives a panel for each column and a curve for each ratio. Other tables
/// with several rows at one x give a curve for each word of a column that tells the rows apart, or for each value of a second key of
/// a campaign, or else points.
///
/// # Errors
/// [`PlotError::Request`] for a name that is not there, for a column without numbers, and for columns of different topics with too few
/// instants in common.
pub fn figure(tables: &[Named], x: Option<&str>, ys: &[String]) -> Result<Figure, PlotError> {
    let ys = ys.iter().map(|y| column_name(tables, y)).collect::<Result<Vec<&str>, PlotError>>()?;
    let x = x.map(|x| column_name(tables, x)).transpose()?;
    let mut figure = Figure { title: quantity::title(&ys), ..Figure::default() };
    for y in ys {
        let table = table_of(tables, x, y)?;
        let x = x.or_else(|| abscissa(&table)).unwrap_or_default();
        let [xs, values] = [x, y].map(|name| table.column(name).unwrap_or_default());
        figure.x = over(x);
        let axis = quantity::axis(y);
        let mark = match Rows::of(&table, x, y) {
            Rows::Line => Mark::Line,
            Rows::Points => Mark::Points,
            Rows::Curves(curves) => {
                figure = curves.iter().fold(figure.panel(axis), |figure, (name, rows)| {
                    let [xs, ys] = [xs, values].map(|column| at_rows(column, rows));
                    figure.line(name, &xs, &ys)
                });
                continue;
            }
        };
        figure.signals = true;
        let (xs, ys) = broken_at_resets(&table, xs, values);
        let series = Series { label: axis.label, xs, ys, mark };
        match figure.panels.iter_mut().find(|panel| panel.y.unit == axis.unit) {
            Some(panel) => panel.series.push(series),
            None => figure.panels.push(Panel { y: Axis::new("", axis.unit), series: vec![series] }),
        }
    }
    Ok(figure)
}

/// The table that has both columns, or a joined one; without `x`, the one that has `y`.
fn table_of<'a>(tables: &'a [Named], x: Option<&str>, y: &str) -> Result<Cow<'a, Table>, PlotError> {
    let of_both = tables.iter().find(|named| named.can_draw(y) && x.is_none_or(|x| named.can_draw(x)));
    let topic_of = |column: &str| tables.iter().find(|named| named.can_draw(column)).ok_or_else(|| unknown(tables, column));
    match (of_both, x) {
        (Some(named), _) => Ok(Cow::Borrowed(&named.table)),
        (None, Some(x)) => {
            let [x, y] = [Column { topic: topic_of(x)?, name: x }, Column { topic: topic_of(y)?, name: y }];
            joined(&x, &y).map(Cow::Owned)
        }
        (None, None) => Err(unknown(tables, y)),
    }
}

/// The name of a column that may be given without the name of its list, as in `watch`: `joints.pivot.fx_n` for `pivot.fx_n`.
/// Other names, and those that several lists have, are returned unchanged.
fn full_name<'a>(tables: &'a [Named], given: &'a str) -> &'a str {
    let names = |named: &'a Named| named.table.columns().map(|(name, _)| name);
    // Commands have no lists: `torque_nm` does not mean `torque.torque_nm`.
    let with_lists = tables.iter().filter(|named| Topic::of_key(&named.name).is_none_or(Topic::is_telemetry));
    let mut in_lists = with_lists.flat_map(names).filter(|name| name.split_once('.').is_some_and(|(_, rest)| rest == given));
    match in_lists.next() {
        Some(full) if !tables.iter().flat_map(names).any(|name| name == given) && in_lists.all(|other| other == full) => full,
        _ => given,
    }
}

/// Gives a column that is named without its list a second name, the full one: `links.rod.chord_rad` for `rod.chord_rad`. Tables that
/// have neither, or a column of the full name, stay as they are.
pub fn add_under_full_name(tables: &mut [Named], full: &str) {
    // Names without a point belong to no list: a table's `torque_nm` is not `torque.torque_nm`.
    let Some((_, short)) = full.split_once('.').filter(|(_, short)| short.contains('.')) else { return };
    add_name(tables, short, full);
}

/// Gives a column a second name, unless there is a column of that name.
pub fn add_name(tables: &mut [Named], column: &str, second: &str) {
    if tables.iter().any(|named| named.can_draw(second)) {
        return;
    }
    if let Some(named) = tables.iter_mut().find(|named| named.can_draw(column)) {
        let values = named.table.column(column).unwrap_or_default().to_vec();
        named.table.push(second, values);
    }
}

/// The full name of a column that may be given without the name of its list.
///
/// # Errors
/// [`PlotError::Request`] for a name that is not there, and for a column without numbers, as of text.
pub fn column_name<'a>(tables: &'a [Named], given: &'a str) -> Result<&'a str, PlotError> {
    let name = full_name(tables, given);
    if tables.iter().any(|named| named.can_draw(name)) {
        return Ok(name);
    }
    let is_there = |table: &Table| table.column(name).is_some() || table.words(name).is_some();
    match tables.iter().any(|named| is_there(&named.table)) {
        true => Err(PlotError::Request(format!("column `{name}` has no numbers to draw"))),
        false => Err(unknown(tables, given)),
    }
}

/// One figure for each unit among the columns of numbers, over the simulated time or else the first of them, without a title;
/// each with the name of its first column, or none where it shows everything.
/// Where every column is several curves, a figure for each column.
///
/// # Errors
/// [`PlotError::Request`] when there are fewer than two columns of numbers.
pub fn overview(table: &Table) -> Result<Vec<(String, Figure)>, PlotError> {
    let x = abscissa(table).ok_or_else(|| PlotError::Request("nothing to draw: no column of numbers".to_owned()))?;
    let several = matches!(Rows::of(table, x, ""), Rows::Curves(_));
    let mut groups: Vec<(String, Vec<String>)> = Vec::new();
    for name in numbers(table).filter(|name| *name != x) {
        // A dimensionless value has no unit to share: columns are grouped by divisor.
        let kind = match name.split_once("_over_") {
            _ if several => name.to_owned(),
            Some((_, divisor)) => divisor.to_owned(),
            None => quantity::axis(name).unit,
        };
        match groups.iter_mut().find(|(other, _)| *other == kind) {
            Some((_, names)) => names.push(name.to_owned()),
            None => groups.push((kind, vec![name.to_owned()])),
        }
    }
    if groups.is_empty() {
        return Err(alone(x));
    }
    let tables = [Named { table: table.clone(), ..Named::default() }];
    let untitled = |names: &[String]| Ok(Figure { title: String::new(), ..figure(&tables, Some(x), names)? });
    if x == "ratio" {
        let names: Vec<String> = groups.into_iter().flat_map(|(_, names)| names).collect();
        return Ok(vec![(String::new(), untitled(&names)?)]);
    }
    let drawn = |(_, names): (String, Vec<String>)| Ok((names[0].clone(), untitled(&names)?));
    groups.into_iter().map(drawn).collect()
}

/// The refusal of a table whose only column of numbers is this one.
fn alone(x: &str) -> PlotError {
    let why = "the only column of numbers, so that it was taken as the horizontal axis";
    PlotError::Request(format!("nothing to draw: `{x}` is {why}; a second one is needed (columns of text are not drawn)"))
}

/// Times and ratios have names, and crank angles have ticks at multiples of π.
fn over(column: &str) -> Axis {
    if let Some(axis) = session_time::axis(column) {
        return axis;
    }
    let axis = quantity::axis(column);
    match axis.unit.as_str() {
        "rad" => Axis::angle(axis.label),
        _ if column == "ratio" => Axis::new("crank-to-rod ratio λ", ""),
        _ => axis,
    }
}

/// The values of a column at rows; NaN beyond its end.
fn at_rows(column: &[f64], rows: &[usize]) -> Vec<f64> {
    rows.iter().map(|row| column.get(*row).copied().unwrap_or(f64::NAN)).collect()
}

fn unknown(tables: &[Named], name: &str) -> PlotError {
    let columns: Vec<(&str, Vec<&str>)> =
        tables.iter().map(|named| (named.name.as_str(), named.drawable_columns().collect())).collect();
    PlotError::Request(format!("no column `{name}`{}", column_hint(name, &columns)))
}
