//! `sweep`: campaigns of many runs, shared among threads, processes and machines.

mod merged;
mod warnings;

use std::io::Write as _;
use std::num::NonZero;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use self::merged::{are_missing, merged};
use self::warnings::{warn_of_refused_values, warn_of_suspect_numbers};
use super::aligned_table::print;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::{make_folder, may_be_folder, must_be_writable};
use super::formatting::counted;
use super::output::output;
use super::progress::{ProgressLines, bar};
use super::signals::{Interruption, interruption_leaves};
use super::values::count;
use crate::plot::{Figure, Format, Picture as _, campaign};
use crate::study::sweep::{
    Campaign, Shard, Spec, SweepError, TableFormat, Worked, has_rows, merge, missing_rows, points, sensitivity,
    sensitivity_table, work,
};

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank files sweep.toml > sweep.toml              a campaign to begin with
  flexcrank sweep sweep.toml                           run it on all cores; once more: only what is missing
  flexcrank sweep sweep.toml --shard 3/16              the third of sixteen shares
  flexcrank sweep sweep.toml --merge                   one table of all rows; names those that are missing
  flexcrank sweep sweep.toml --merge --table runs.csv   the same as CSV
  flexcrank sweep sweep.toml --indices                 sensitivity of each scalar to each key
  flexcrank sweep sweep.toml --plot plots --scalars pivot_peak_force_n   pictures of one of them

Rows are kept in SPEC's folder NAME.sweep as soon as they are computed. Several workers may share the folder, with or without \
    shares: none computes a row that another has. In a Slurm job array, and in an indexed job of Kubernetes with its number of \
    completions in JOB_COMPLETIONS, the share follows from the environment. A worker that has computed the last row of a campaign \
    without shares merges the table.

Exit codes: 0 done, 1 failed, or rows are missing after --merge, 2 usage, bad specification or scene, 130 interrupted: rows are kept.";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The campaign: a TOML file.
    pub spec: PathBuf,
    /// Folder of the campaign. Default: NAME.sweep beside SPEC.
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Compute this share only: the I-th of N, from 1. Default: the scheduler's, or everything.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Number of runs at a time. Default: one per core.
    #[arg(long, value_name = "N", value_parser = count)]
    pub jobs: Option<u64>,
    /// Compute nothing: write the table of all rows.
    #[arg(long, conflicts_with_all = ["shard", "jobs"])]
    pub merge: bool,
    /// The table, .parquet or .csv, of all scalars. Default: table.parquet in the campaign's folder. --indices and --plot are commands of
    /// their own, once the rows are there.
    #[arg(long, value_name = "FILE", conflicts_with = "shard", value_parser = table_name)]
    pub table: Option<PathBuf>,
    /// Compute nothing: write sensitivity indices to indices.csv, and print them.
    #[arg(long, conflicts_with_all = ["shard", "jobs", "merge"])]
    pub indices: bool,
    /// Compute nothing: draw scalars over each key and as parallel coordinates into this folder, as SVG.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["shard", "jobs", "merge"])]
    pub plot: Option<PathBuf>,
    /// Scalars for --indices and --plot, separated by commas. Default of --indices: all.
    #[arg(long, value_name = "SCALAR,…", value_delimiter = ',')]
    pub scalars: Vec<String>,
}

impl Args {
    /// Refuses a table beside what is made of its rows, scalars without it, and pictures without scalars.
    fn must_be_one_command(&self) -> CommandResult<()> {
        let is_of_rows = self.indices || self.plot.is_some();
        let why = match (&self.table, is_of_rows, self.scalars.is_empty()) {
            (Some(_), true, _) => {
                "--table writes the table, and --indices and --plot show what rows hold: give one command for each"
            }
            (Some(_), false, false) => "--scalars chooses what --indices and --plot show: the table of --table has all scalars",
            (None, false, false) => "--scalars chooses what --indices and --plot show: give one of these, or leave it out",
            (None, _, true) if self.plot.is_some() => "--plot draws what --scalars names, as in --scalars pivot_peak_force_n",
            _ => return Ok(()),
        };
        Err(Failure::Usage(why.to_owned()))
    }
}

fn table_name(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    TableFormat::of(&path).map(|_| path).ok_or_else(|| "a table ends in .csv or .parquet".to_owned())
}

pub(super) fn sweep(args: &Args) -> CommandResult {
    args.must_be_one_command()?;
    // From here on, so that no signal leaves an empty folder.
    let interruption = Interruption::watch()?;
    let campaign = Campaign::open(&args.spec)?;
    let folder = args.output.clone().unwrap_or_else(|| Spec::usual_folder(&args.spec));
    if args.indices || args.plot.is_some() {
        args.plot.as_ref().map_or(Ok(()), |plots| draw(&campaign, &folder, &args.scalars, plots))?;
        return if args.indices { indices(&campaign, &folder, &args.scalars) } else { Ok(ExitStatus::Success) };
    }
    let table = args.table.clone().unwrap_or_else(|| folder.join("table.parquet"));
    if args.merge {
        must_have_rows(&campaign, &folder)?;
        must_be_writable(&table)?;
        return merged(&merge(&campaign, &folder, &table)?, &campaign);
    }
    let shard = match args.shard {
        Some(shard) => Some(shard),
        None => Shard::of_environment(|name| std::env::var(name).ok())?,
    };
    if let (Some(table), Some(_)) = (&args.table, shard) {
        let why = "the scheduler gives this worker a share, and a share is no table: give it with --merge, once all are done";
        return Err(Failure::Usage(format!("--table {}: {why}", table.display())));
    }
    make_folder(&folder)?;
    must_be_writable(&table)?;
    warn_of_refused_values(&campaign);
    warn_of_suspect_numbers(&campaign)?;
    interruption_leaves("the rows so far are kept".to_owned());
    interruption.keeps(true);
    let failed = |error| failed_with_rows(error, &campaign, &folder);
    let worked = compute(&campaign, &folder, shard, args.jobs, &interruption).map_err(failed)?;
    interruption.keeps(false);
    tell(&worked, &campaign)?;
    match (worked.interrupted, worked.left(), shard) {
        (true, ..) => Ok(ExitStatus::Interrupted),
        (false, 0, None) => merged(&merge(&campaign, &folder, &table).map_err(failed)?, &campaign),
        (false, ..) => Ok(ExitStatus::Success),
    }
}

fn compute(
    campaign: &Campaign,
    folder: &Path,
    shard: Option<Shard>,
    jobs: Option<u64>,
    interruption: &Interruption,
) -> Result<Worked, SweepError> {
    let jobs = jobs.and_then(|jobs| NonZero::new(usize::try_from(jobs).ok()?));
    let threads = jobs.or(std::thread::available_parallelism().ok()).unwrap_or(NonZero::<usize>::MIN);
    let (lines, bar) = (ProgressLines::begin(), bar(campaign.runs(), "{wide_bar} {pos}/{len} runs{left}"));
    let worked = work(campaign, folder, shard, threads, &|done| {
        bar.set_position(done);
        lines.report(|| format!("{done} of {} runs done", campaign.runs()));
        if interruption.is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.finish_and_clear();
    worked
}

/// The failure of a worker or of its table, as on a full disk, with what it leaves.
fn failed_with_rows(error: SweepError, campaign: &Campaign, folder: &Path) -> Failure {
    match error {
        SweepError::File { .. } | SweepError::Table(_) if has_rows(campaign, folder).is_ok_and(|has_rows| has_rows) => {
            Failure::Failed(format!("{error}; the rows so far are kept: the same command goes on"))
        }
        error => error.into(),
    }
}

/// Prints the result of a worker.
fn tell(worked: &Worked, campaign: &Campaign) -> CommandResult<()> {
    let share =
        if worked.rows < campaign.runs() { format!(" of this share, of {} in all", campaign.runs()) } else { String::new() };
    let runs = counted(worked.rows, "run");
    writeln!(output(), "{runs}{share}: {} computed, {} there before", worked.computed, worked.found)?;
    match (worked.interrupted, worked.left()) {
        (true, left) => say_reason!("interrupted: {} not computed", counted(left, "run")),
        (false, 0) => {}
        (false, left) => say!("{} left to other workers, who have them now", counted(left, "run")),
    }
    Ok(())
}

/// Refuses a folder in which there is nothing to read.
fn must_have_rows(campaign: &Campaign, folder: &Path) -> CommandResult<()> {
    may_be_folder(folder)?;
    match has_rows(campaign, folder)? {
        true => Ok(()),
        false => Err(Failure::Failed(format!("no rows of this campaign in {}: run the sweep first", folder.display()))),
    }
}

/// Draws each scalar over each key, and its parallel coordinates.
fn draw(campaign: &Campaign, folder: &Path, scalars: &[String], plots: &Path) -> CommandResult<()> {
    let points = points(campaign, folder, scalars)?;
    if points.scalars.iter().all(|scalar| scalar.values.is_empty()) {
        must_have_rows(campaign, folder)?;
        let runs = counted(points.left_out, "run");
        let why = match points.left_out - points.ended_badly {
            0 => "see the columns `ending`, `cause` and `verdict`".to_owned(),
            others => format!("{} missing, or without one of the scalars", counted(others, "run")),
        };
        return Err(Failure::Failed(format!("nothing to draw: no run ended well and can be trusted ({runs}); {why}")));
    }
    if points.left_out > 0 {
        let left_out = counted(points.left_out, "run");
        say!("warning: {left_out} not drawn: missing, failed, not to be trusted, or without one of the scalars");
    }
    make_folder(plots)?;
    let write = |name: String, figure: Figure| -> CommandResult<()> {
        let path = plots.join(format!("{name}.svg"));
        figure.write(&path, Format::Svg)?;
        Ok(writeln!(output(), "{}", path.display())?)
    };
    for (place, scalar) in points.scalars.iter().enumerate() {
        for (key, axis) in points.keys.iter().enumerate() {
            write(format!("{}-over-{}", scalar.name, axis.name), campaign::over_key(&points, place, key))?;
        }
        write(format!("{}-parallel", scalar.name), campaign::parallel(&points, place))?;
    }
    Ok(())
}

fn indices(campaign: &Campaign, folder: &Path, scalars: &[String]) -> CommandResult {
    let indices = sensitivity(campaign, folder, scalars)?;
    if indices.is_empty() {
        return Err(no_indices(campaign, folder)?);
    }
    let path = folder.join("indices.csv");
    sensitivity_table(campaign, &indices).write_csv(&path)?;
    let mut rows = vec![["scalar", "key", "first", "±", "total", "±"].map(str::to_owned).to_vec()];
    for scalar in &indices {
        for (key, axis) in scalar.keys.iter().zip(&campaign.spec().axes) {
            let numbers = [key.first, key.first_error, key.total, key.total_error].map(|number| format!("{number:.4}"));
            rows.push([scalar.column.clone(), axis.key.clone()].into_iter().chain(numbers).collect());
        }
    }
    print(&rows, 2)?;
    writeln!(output(), "{}", path.display())?;
    let left_out = indices.iter().map(|scalar| scalar.left_out).max().unwrap_or(0);
    if left_out > 0 {
        say!(
            "warning: up to {left_out} samples are left out: one of their runs is missing, failed, not to be trusted, or without \
             the scalar"
        );
    }
    Ok(ExitStatus::Success)
}

/// Why no scalar has indices, and the way to them.
fn no_indices(campaign: &Campaign, folder: &Path) -> CommandResult<Failure> {
    must_have_rows(campaign, folder)?;
    let missing = missing_rows(campaign, folder)?;
    let why = match missing.is_empty() {
        true => "runs failed, are not to be trusted, or are all the same".to_owned(),
        false => format!("{}; compute them first: run the sweep", are_missing(&missing, campaign)),
    };
    Ok(Failure::Failed(format!("no scalar has indices: {why}")))
}
