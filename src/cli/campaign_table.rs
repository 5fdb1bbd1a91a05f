//! Tables of campaigns that `plot` draws.

use std::path::Path;

use super::failure::{CommandResult, Failure};
use super::formatting::counted;
use crate::study::Table;
use crate::study::sweep::{Ending, is_trusted_row};

/// The refusal of a campaign's table without a run that ended well and can be trusted.
const NO_RUN: &str = "nothing to draw: no run ended well and can be trusted; see the columns `ending`, `cause` and `verdict`";

/// The table of a campaign without the runs that did not end well, or are not to be trusted, as `sweep --plot` draws it; other tables as
/// they are.
pub(super) fn without_failed_runs(path: &Path, mut table: Table) -> CommandResult<Table> {
    let has = |name: &&str| table.words(name).is_some() || table.column(name).is_some();
    let is_ending = |word: &String| Ending::ALL.iter().any(|ending| ending.as_str() == word);
    let endings = table.words("ending").filter(|endings| endings.iter().all(is_ending));
    let Some(endings) = endings.filter(|_| ["index", "id", "cause", "verdict"].iter().all(has)) else { return Ok(table) };
    // Without any verdict, the column is none of words.
    let verdict = |row: usize| table.words("verdict").and_then(|verdicts| verdicts.get(row)).map_or("", String::as_str);
    let is_kept: Vec<bool> = endings.iter().enumerate().map(|(row, ending)| is_trusted_row(ending, verdict(row))).collect();
    let left_out = is_kept.iter().filter(|is_kept| !**is_kept).count();
    if left_out == is_kept.len() {
        return Err(Failure::Failed(format!("{}: {NO_RUN}", path.display())));
    }
    if left_out > 0 {
        let (file, runs) = (path.display(), counted(left_out as u64, "run"));
        say!("warning: {file}: {runs} not drawn: failed, or not to be trusted (columns `ending` and `verdict`)");
    }
    table.keep_rows(&is_kept);
    Ok(table)
}
