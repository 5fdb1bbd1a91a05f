//! `export`: writes a recording as tables, or as a file for ROS 2.

use std::io::Write as _;
use std::path::PathBuf;

use clap_complete::engine::ArgValueCompleter;

use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::{may_be_folder, must_have_folder, must_suit_recording};
use super::formatting::counted;
use super::output::output;
use super::progress::over_parts;
use super::values::{positive_time, time};
use crate::recording::{self, Exported};
use crate::shown::{shown_name, shown_sentence};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank export recordings/crank.mcap --csv tables
  flexcrank export recordings/crank.mcap --parquet tables
  flexcrank export recordings/crank.mcap --ros2 bag.mcap
  flexcrank export recordings/crank.mcap --csv tables --from 1 --to 5 --every 0.01 --columns links";

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("format").args(["csv", "parquet", "ros2"]).required(true).multiple(true))]
pub(super) struct Args {
    /// The recording.
    #[arg(add = ArgValueCompleter::new(completions::recordings))]
    pub file: PathBuf,
    /// Folder for CSV tables, one per topic. Tables of the same names are replaced.
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Folder for Parquet tables, one per topic. Tables of the same names are replaced.
    #[arg(long, value_name = "DIR")]
    pub parquet: Option<PathBuf>,
    /// MCAP file for ROS 2: the messages that `run --ros2` publishes, for `ros2 bag play`, RViz and PlotJuggler.
    #[arg(long, value_name = "FILE")]
    pub ros2: Option<PathBuf>,
    /// Start at this recorded time.
    #[arg(long, value_name = "TIME", default_value = "0", value_parser = time)]
    pub from: f64,
    /// End at this recorded time.
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub to: Option<f64>,
    /// Keep one row per topic in each period of this recorded time: the first.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    pub every: Option<f64>,
    /// Only these columns of tables: a name, or the group before a dot, as links.crank. log_time, publish_time and simulated time are always included.
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    pub columns: Vec<String>,
}

pub(super) fn export(args: Args) -> CommandResult {
    let Args { file, csv, parquet, ros2, from, to, every, columns } = args;
    if let Some(to) = to.filter(|to| from > *to) {
        return Err(Failure::Usage(format!("--from {from} must not be after --to {to}")));
    }
    if !columns.is_empty() && csv.is_none() && parquet.is_none() {
        return Err(Failure::Usage("--columns chooses columns of tables: it needs --csv or --parquet".to_owned()));
    }
    ros2.as_deref().map_or(Ok(()), must_suit_recording)?;
    [&csv, &parquet, &ros2].into_iter().flatten().try_for_each(|path| must_have_folder(path))?;
    [&csv, &parquet].into_iter().flatten().try_for_each(|folder| may_be_folder(folder))?;
    let what = recording::Export { csv, parquet, ros2, from_s: from, to_s: to, every_s: every, columns };
    let (bar, progress) = over_parts();
    let exported = recording::export(&file, &what, &progress);
    bar.finish_and_clear();
    let Exported { tables, replaced, ros2, cut_off, skipped } = exported?;
    for table in tables {
        writeln!(output(), "{} ({} rows)", shown_sentence(&table.path.display().to_string()), table.messages)?;
    }
    if replaced > 0 {
        say!("replaced {} of the same names", counted(replaced as u64, "table"));
    }
    if let Some(bag) = ros2 {
        writeln!(output(), "{} ({} messages)", bag.path.display(), bag.messages)?;
    }
    for topic in skipped {
        say!("warning: {} is not protobuf and was left out", shown_name(&topic));
    }
    if cut_off {
        say_reason!("warning: the recording ends early (still being recorded, or cut off); everything before was exported");
        return Ok(ExitStatus::Lossy);
    }
    Ok(ExitStatus::Success)
}
