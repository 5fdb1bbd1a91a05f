//! `export`: writes a recording as tables.

use std::io::Write as _;
use std::path::PathBuf;

use clap_complete::engine::ArgValueCompleter;

use super::completions;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::folders::may_be_folder;
use super::output::output;
use super::progress::elapsed;
use super::values::{positive_time, time};
use crate::recording::{self, Exported};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank export recordings/crank.mcap --csv tables
  flexcrank export recordings/crank.mcap --parquet tables
  flexcrank export recordings/crank.mcap --csv tables --from 1 --to 5 --every 0.01 --columns stamp.sim_time_s,links";

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("format").args(["csv", "parquet"]).required(true).multiple(true))]
pub(super) struct Args {
    /// The recording.
    #[arg(add = ArgValueCompleter::new(completions::recordings))]
    pub file: PathBuf,
    /// Folder for CSV tables, one per topic.
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Folder for Parquet tables, one per topic.
    #[arg(long, value_name = "DIR")]
    pub parquet: Option<PathBuf>,
    /// Start at this recorded time.
    #[arg(long, value_name = "TIME", default_value = "0", value_parser = time)]
    pub from: f64,
    /// End at this recorded time.
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub to: Option<f64>,
    /// Keep one row per topic in each period of this recorded time: the first.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    pub every: Option<f64>,
    /// Only these columns, by name or prefix: stamp.sim_time_s, links.crank. Times are always included.
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    pub columns: Vec<String>,
}

pub(super) fn export(args: Args) -> CommandResult {
    let Args { file, csv, parquet, from, to, every, columns } = args;
    [&csv, &parquet].into_iter().flatten().try_for_each(|folder| may_be_folder(folder))?;
    let what = recording::Export { csv, parquet, from_s: from, to_s: to, every_s: every, columns };
    let progress = elapsed("exporting");
    let exported = recording::export(&file, &what);
    progress.finish_and_clear();
    let Exported { tables, cut_off, skipped } = exported?;
    for table in tables {
        writeln!(output(), "{} ({} rows)", table.path.display(), table.messages)?;
    }
    for topic in skipped {
        say!("warning: {topic} is not protobuf and was left out");
    }
    if cut_off {
        say!("warning: the recording ends early; everything before was exported");
        return Ok(ExitStatus::Lossy);
    }
    Ok(ExitStatus::Success)
}
