//! One table of all rows, in the order of their indices: the same bytes whoever computed them.

use std::collections::BTreeMap;
use std::io;
use std::num::NonZero;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;
use std::thread::{self, available_parallelism};

use sha2::{Digest as _, Sha256};

use super::SweepError;
use super::axis::Value;
use super::campaign::{Campaign, Sample};
use super::chunk;
use super::row::Row;
use super::run::Ending;
use super::scalars::OUT_OF_RANGE;
use crate::recording::{ColumnType, Columns, CsvSheet, FieldValue, ParquetSheet, Sheet};

/// Column that numbers the runs.
pub(crate) const INDEX: &str = "index";
/// Chunks that a reader has in memory before they are asked for.
const CHUNKS_AHEAD: usize = 4;

/// Format of a merged table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// Text.
    Csv,
    /// Typed columns, compressed.
    Parquet,
}

impl TableFormat {
    /// The format that a file name's ending asks for.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        let formats = [("csv", TableFormat::Csv), ("parquet", TableFormat::Parquet)];
        formats.into_iter().find(|(name, _)| ending.eq_ignore_ascii_case(name)).map(|(_, format)| format)
    }
}

/// Runs that ran to their end, but are not to be trusted: their energy balance was off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Untrusted {
    /// Their number.
    pub count: u64,
    /// The first of them.
    pub first: u64,
    /// Largest energy balance of the first, J.
    pub worst_balance_j: f64,
    /// Energy in play of the first, J.
    pub in_play_j: f64,
}

/// Runs that are to be trusted, but bent a link further than the model covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfRange {
    /// Their number.
    pub count: u64,
    /// The first of them.
    pub first: u64,
    /// Largest deflection of the first, over the link's length.
    pub bent: f64,
}

/// A merged table.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// Its file.
    pub path: PathBuf,
    /// SHA-256 of the file, in hexadecimal.
    pub sha256: String,
    /// Rows in it.
    pub rows: u64,
    /// Runs without a row.
    pub missing: Vec<Range<u64>>,
    /// Number of rows by their end.
    pub endings: BTreeMap<Ending, u64>,
    /// Runs that are done, but not to be trusted; `None` if there are none.
    pub untrusted: Option<Untrusted>,
    /// Runs that are done and to be trusted, but out of the model's range; `None` if there are none.
    pub out_of_range: Option<OutOfRange>,
    /// For each end that has a cause, the first run that ended so, and the cause.
    pub causes: BTreeMap<Ending, (u64, String)>,
    /// Computing time of all rows, s.
    pub seconds: f64,
}

/// Writes the rows in `folder` as one table: `index`, `id`, the keys that vary, `ending`, `cause`, `verdict`, then numbers. The ending
/// of `path` chooses the format. Computing times are left out: they differ from machine to machine.
///
/// # Errors
/// [`SweepError`] if the ending asks for no format, or a file cannot be read or written.
pub fn merge(campaign: &Campaign, folder: &Path, path: &Path) -> Result<Merged, SweepError> {
    let mut sheet = sheet(path, &columns(campaign))?;
    let mut merged = Merged {
        path: path.to_owned(),
        sha256: String::new(),
        rows: 0,
        missing: Vec::new(),
        endings: BTreeMap::new(),
        untrusted: None,
        out_of_range: None,
        causes: BTreeMap::new(),
        seconds: 0.0,
    };
    let out_of_range = campaign.columns().iter().position(|column| column.name == OUT_OF_RANGE);
    each_row(campaign, folder, |sample, row| {
        let Some(row) = row else {
            miss(&mut merged.missing, sample.index);
            return Ok(());
        };
        merged.add(row, out_of_range);
        let cells = cells(campaign, sample, row);
        Ok(sheet.write(&cells.iter().map(Option::as_ref).collect::<Vec<_>>())?)
    })?;
    sheet.finish()?;
    merged.sha256 = sha256(path).map_err(SweepError::file(path))?;
    Ok(merged)
}

/// The file of a table, in the format that its ending asks for.
fn sheet(path: &Path, columns: &Columns) -> Result<Box<dyn Sheet>, SweepError> {
    let file = path.to_owned();
    let sheet: Box<dyn Sheet> = match TableFormat::of(path) {
        Some(TableFormat::Csv) => Box::new(CsvSheet::create(file, columns)?),
        Some(TableFormat::Parquet) => Box::new(ParquetSheet::create(file, columns)?),
        None => return Err(SweepError::TableName(file)),
    };
    Ok(sheet)
}

/// Whether `folder` has a row of this campaign.
///
/// # Errors
/// [`SweepError`] if a file cannot be read.
pub fn has_rows(campaign: &Campaign, folder: &Path) -> Result<bool, SweepError> {
    for number in 0..campaign.chunks() {
        let path = chunk::path(folder, campaign, number);
        // The samples of a chunk without a file need not be known.
        let is_there = path.try_exists().map_err(SweepError::file(&path))?;
        if is_there && read(campaign, folder, number)?.1.iter().any(Option::is_some) {
            return Ok(true);
        }
    }
    Ok(false)
}

impl Merged {
    /// Adds a row, with the place of the scalar [`OUT_OF_RANGE`].
    fn add(&mut self, row: &Row, out_of_range: Option<usize>) {
        let outcome = &row.outcome;
        self.rows += 1;
        self.seconds += row.seconds;
        *self.endings.entry(outcome.ending).or_default() += 1;
        if outcome.is_untrusted() {
            let [worst_balance_j, in_play_j] = ["worst_balance_j", "in_play_j"].map(|name| outcome.of_whole_run(name));
            let first = Untrusted { count: 0, first: row.index, worst_balance_j, in_play_j };
            self.untrusted.get_or_insert(first).count += 1;
        }
        let bent = out_of_range.and_then(|place| outcome.numbers.get(place).copied().flatten()).unwrap_or(0.0);
        if outcome.ended_well() && bent > 0.0 {
            self.out_of_range.get_or_insert(OutOfRange { count: 0, first: row.index, bent }).count += 1;
        }
        if !outcome.cause.is_empty() {
            self.causes.entry(outcome.ending).or_insert_with(|| (row.index, outcome.cause.clone()));
        }
    }
}

/// Adds a run, which follows all others, to those without a row.
fn miss(missing: &mut Vec<Range<u64>>, index: u64) {
    match missing.last_mut() {
        Some(last) if last.end == index => last.end += 1,
        _ => missing.push(index..index + 1),
    }
}

/// The runs of this campaign without a row in `folder`.
///
/// # Errors
/// [`SweepError`] if a file cannot be read.
pub fn missing_rows(campaign: &Campaign, folder: &Path) -> Result<Vec<Range<u64>>, SweepError> {
    let mut missing = Vec::new();
    each_row(campaign, folder, |sample, row| {
        if row.is_none() {
            miss(&mut missing, sample.index);
        }
        Ok(())
    })?;
    Ok(missing)
}

/// Calls `each` with every sample and its row, in order; with `None` where there is no row. All cores read, a few chunks ahead.
pub(super) fn each_row(
    campaign: &Campaign,
    folder: &Path,
    mut each: impl FnMut(&Sample, Option<&Row>) -> Result<(), SweepError>,
) -> Result<(), SweepError> {
    let readers = available_parallelism().map_or(1, NonZero::get);
    thread::scope(|scope| {
        let reader = |first: usize| {
            let (send, receive) = sync_channel(CHUNKS_AHEAD);
            scope.spawn(move || {
                // The sending fails once nobody reads any more, after an error.
                (first as u64..campaign.chunks())
                    .step_by(readers)
                    .map(|chunk| read(campaign, folder, chunk))
                    .all(|read| send.send(read).is_ok())
            });
            receive
        };
        let chunks: Vec<_> = (0..readers).map(reader).collect();
        let mut in_order = chunks.iter().cycle().map_while(|reader| reader.recv().ok());
        in_order.try_for_each(|chunk| {
            let (samples, rows) = chunk?;
            samples.iter().zip(&rows).try_for_each(|(sample, row)| each(sample, row.as_ref()))
        })
    })
}

fn read(campaign: &Campaign, folder: &Path, chunk: u64) -> Result<(Vec<Sample>, chunk::Rows), SweepError> {
    let samples: Vec<Sample> = campaign.samples(chunk).collect();
    let rows = chunk::read(&chunk::path(folder, campaign, chunk), &samples, campaign.columns().len())?;
    Ok((samples, rows))
}

fn columns(campaign: &Campaign) -> Columns {
    let keys = campaign.spec().axes.iter().map(|axis| {
        let kind = if axis.is_number() { ColumnType::Number } else { ColumnType::Text };
        (axis.key.clone(), kind)
    });
    let numbers = campaign.columns().iter().map(|column| {
        let kind = if column.is_count { ColumnType::Integer } else { ColumnType::Number };
        (column.name.clone(), kind)
    });
    let named = |name: &str, kind| (name.to_owned(), kind);
    let first = [named(INDEX, ColumnType::Integer), named("id", ColumnType::Text)];
    let words = ["ending", "cause", "verdict"].map(|name| named(name, ColumnType::Text));
    first.into_iter().chain(keys).chain(words).chain(numbers).collect()
}

fn cells(campaign: &Campaign, sample: &Sample, row: &Row) -> Vec<Option<FieldValue>> {
    let word = |word: &str| (!word.is_empty()).then(|| FieldValue::Text(word.to_owned()));
    let key = |value: &Value, is_number: bool| match value.number().filter(|_| is_number) {
        Some(number) => FieldValue::Number(number),
        None => FieldValue::Text(value.word()),
    };
    let keys = sample.values.iter().zip(&campaign.spec().axes).map(|(value, axis)| Some(key(value, axis.is_number())));
    let number = |(number, is_count): (Option<f64>, bool)| {
        number.map(|number| if is_count { FieldValue::Integer(number as i64) } else { FieldValue::Number(number) })
    };
    let outcome = &row.outcome;
    let numbers = outcome.numbers.iter().copied().zip(campaign.columns().iter().map(|column| column.is_count)).map(number);
    let first = [Some(FieldValue::Integer(sample.index as i64)), word(&sample.id)];
    let words = [word(outcome.ending.as_str()), word(&outcome.cause), word(outcome.verdict)];
    first.into_iter().chain(keys).chain(words).chain(numbers).collect()
}

fn sha256(path: &Path) -> io::Result<String> {
    let mut hash = Sha256::new();
    let mut file = std::fs::File::open(path)?;
    let mut part = vec![0; 64 * 1024];
    loop {
        let read = io::Read::read(&mut file, &mut part)?;
        if read == 0 {
            break;
        }
        hash.update(&part[..read]);
    }
    Ok(format!("{:x}", hash.finalize()))
}
