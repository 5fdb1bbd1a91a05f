//! The finished runs of a campaign as coordinates, for pictures.

use std::path::Path;

use super::campaign::Campaign;
use super::merge::each_row;
use super::sensitivity::{NoIndices, places};
use super::{Axis, Levels, Value};

/// The values of a key or of a scalar, one for each run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coordinate {
    /// Its name.
    pub name: String,
    /// Its values; of words, the places in `words`.
    pub values: Vec<f64>,
    /// Whether it varies by ratios.
    pub is_log: bool,
    /// Listed values that are not numbers; empty for numbers.
    pub words: Vec<String>,
}

/// Coordinates of the runs that ended well and know all of the scalars.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    /// The keys that vary.
    pub keys: Vec<Coordinate>,
    /// The scalars.
    pub scalars: Vec<Coordinate>,
    /// Runs left out: missing, not run to their end, not to be trusted, or without one of the scalars.
    pub left_out: u64,
    /// Those of them that did not run to their end, or are not to be trusted.
    pub ended_badly: u64,
}

/// The points of these scalars.
///
/// # Errors
/// [`NoIndices`] if a scalar is unknown, or the rows cannot be read.
pub fn points(campaign: &Campaign, folder: &Path, scalars: &[String]) -> Result<Points, NoIndices> {
    let places = places(campaign.columns(), scalars)?;
    let named = |place: &usize| Coordinate { name: campaign.columns()[*place].name.clone(), ..Coordinate::default() };
    let keys = campaign.spec().axes.iter().map(of_key).collect();
    let mut points = Points { keys, scalars: places.iter().map(named).collect(), ..Points::default() };
    each_row(campaign, folder, |sample, row| {
        let outcome = row.map(|row| &row.outcome).filter(|outcome| outcome.ended_well());
        let numbers = outcome
            .and_then(|outcome| places.iter().map(|place| outcome.numbers.get(*place).copied()?).collect::<Option<Vec<_>>>());
        let Some(numbers) = numbers else {
            points.left_out += 1;
            points.ended_badly += u64::from(row.is_some() && outcome.is_none());
            return Ok(());
        };
        points.keys.iter_mut().zip(&sample.values).for_each(|(key, value)| key.add(value));
        points.scalars.iter_mut().zip(numbers).for_each(|(scalar, number)| scalar.values.push(number));
        Ok(())
    })?;
    Ok(points)
}

fn of_key(axis: &Axis) -> Coordinate {
    let words = match &axis.levels {
        Levels::Listed(values) if !axis.is_number() => values.iter().map(|value| Value::Listed(value.clone()).word()).collect(),
        Levels::Listed(_) | Levels::Range { .. } => Vec::new(),
    };
    Coordinate {
        name: axis.key.clone(),
        is_log: matches!(axis.levels, Levels::Range { log: true, .. }),
        words,
        values: Vec::new(),
    }
}

impl Coordinate {
    fn add(&mut self, value: &Value) {
        let word = || self.words.iter().position(|word| *word == value.word()).unwrap_or_default() as f64;
        let number = value.number().filter(|_| self.words.is_empty());
        self.values.push(number.unwrap_or_else(word));
    }
}
