//! `sweep`: campaigns of many runs, shared among threads, processes and machines.

use std::io::Write as _;
use std::num::NonZero;
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};

use super::aligned_table::{figure, print};
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::{make_folder, may_be_folder, must_be_writable};
use super::formatting::counted;
use super::output::output;
use super::progress::{ProgressLines, bar};
use super::run_conclusion::step_remedy;
use super::short_load::{ShortLoad, resistance};
use super::signals::{Interruption, interruption_leaves};
use super::sudden_start::sudden_start;
use super::suspect_numbers::{newly_suspect, suspect_numbers};
use super::values::count;
use crate::plot::{Figure, Format, Picture as _, campaign};
use crate::runtime::{beyond_range, unbalanced};
use crate::scene::{ModelKind, SceneSource};
use crate::shown::shown_sentence;
use crate::study::sweep::{
    Campaign, Ending, Merged, OutOfRange, RefusedRuns, RefusedValue, Shard, Spec, SweepError, TableFormat, Untrusted, Worked,
    has_rows, merge, missing_rows, points, sensitivity, sensitivity_table, work,
};

/// Runs of a large campaign whose steps are looked at.
const LOOKED_AT: u64 = 500;

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

/// Ranges of missing rows that are named.
const NAMED: usize = 20;

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
    #[arg(long, value_name = "DIR", requires = "scalars", conflicts_with_all = ["shard", "jobs", "merge"])]
    pub plot: Option<PathBuf>,
    /// Scalars for --indices and --plot, separated by commas. Default of --indices: all.
    #[arg(long, value_name = "SCALAR,…", value_delimiter = ',')]
    pub scalars: Vec<String>,
}

impl Args {
    /// Refuses a table beside what is made of its rows, and scalars without it.
    fn must_be_one_command(&self) -> CommandResult<()> {
        let is_of_rows = self.indices || self.plot.is_some();
        let why = match (&self.table, is_of_rows, self.scalars.is_empty()) {
            (Some(_), true, _) => {
                "--table writes the table, and --indices and --plot show what rows hold: give one command for each"
            }
            (Some(_), false, false) => "--scalars chooses what --indices and --plot show: the table of --table has all scalars",
            (None, false, false) => "--scalars chooses what --indices and --plot show: give one of these, or leave it out",
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

/// Warns of listed values and bounds that their keys never allow, before anything is computed.
fn warn_of_refused_values(campaign: &Campaign) {
    for RefusedValue { reason, runs } in campaign.refused_values() {
        let runs = match runs {
            RefusedRuns::Counted(count) => format!("its {}", counted(count, "run")),
            RefusedRuns::WithValue => "its runs".to_owned(),
            RefusedRuns::BetweenBounds => "runs with values that it does not allow".to_owned(),
        };
        say!("warning: {}; {runs} will be refused", shown_sentence(&reason));
    }
}

/// Warns of numbers that look like mistakes: those of the scene, and those of listed values and of bounds; of each key, the first in full.
fn warn_of_suspect_numbers(campaign: &Campaign) -> CommandResult<()> {
    let spec = campaign.spec();
    // Without the campaign's pulses, so that a built-in scene is known by its name.
    let base = SceneSource::open(&spec.scene, &spec.set)?;
    suspect_numbers(&base).iter().chain(&sudden_start(&base.scene)).for_each(|warning| say!("warning: {warning}"));
    let with_values = || spec.axes.iter().flat_map(|axis| campaign.with_given_values(axis).flatten());
    if sudden_start(&base.scene).is_empty() {
        let first = with_values().map(|changed| sudden_start(&changed.scene)).find(|warnings| !warnings.is_empty());
        first.iter().flatten().for_each(|warning| say!("warning: {warning}"));
    }
    warn_of_single_elements(&base, spec);
    warn_of_short_loads(&base, campaign);
    for axis in &spec.axes {
        let of_values = campaign.with_given_values(axis).flatten().map(|changed| newly_suspect(&base.scene, &changed.scene));
        let mut suspect = of_values.filter(|warnings| !warnings.is_empty());
        suspect.next().iter().flatten().for_each(|warning| say!("warning: {warning}"));
        let more = suspect.count() as u64;
        if more > 0 {
            say!("warning: likewise {} of {}", counted(more, "more value"), axis.key);
        }
    }
    Ok(())
}

/// Warns of links that bend, and of whose peaks only what stands at their pins is seen.
fn warn_of_single_elements(base: &SceneSource, spec: &Spec) {
    for link in base.scene.chain().iter().flat_map(|chain| &chain.links) {
        let (name, key) = (link.name.as_str(), format!("{}.elements", link.name.as_str()));
        let bends = !link.rigid && base.scene.solver.model != ModelKind::Rigid;
        if bends && link.elements == 1 && spec.axes.iter().all(|axis| axis.key != key) {
            say!(
                "warning: {key} = 1: the peaks of {name}'s deflection, moment and stress are those at its pins alone, and its axial and \
                 shear forces are means over its length: set = [\"{key}=8\"] in the campaign shows them between the pins"
            );
        }
    }
}

/// Warns of runs whose steps are too long for the resistance on the slider: the first of some of them.
fn warn_of_short_loads(base: &SceneSource, campaign: &Campaign) {
    if resistance(&base.scene).is_none() {
        return;
    }
    let every = usize::try_from(campaign.runs() / LOOKED_AT).unwrap_or(usize::MAX).max(1);
    let warning = |run: u64| Some((run, ShortLoad::warning_of_step(&campaign.scene_of(run).ok()?.scene)?));
    if let Some((run, warning)) = (0..campaign.runs()).step_by(every).find_map(warning) {
        say!("warning: run {run}: {warning}");
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
    writeln!(output(), "{} runs{share}: {} computed, {} there before", worked.rows, worked.computed, worked.found)?;
    match (worked.interrupted, worked.left()) {
        (true, left) => say_reason!("interrupted: {left} runs not computed"),
        (false, 0) => {}
        (false, left) => say!("{left} runs left to other workers, who have them now"),
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

/// Prints what a table holds, and what it lacks.
fn merged(merged: &Merged, campaign: &Campaign) -> CommandResult {
    let mut out = output();
    writeln!(
        out,
        "{}: {} rows, computed in {} s, SHA-256 {}",
        merged.path.display(),
        merged.rows,
        three_digits(merged.seconds),
        merged.sha256
    )?;
    for (count, ended) in counts(merged) {
        writeln!(out, "{count:>10}  {ended}")?;
    }
    warn_of_failures(merged);
    merged.untrusted.iter().for_each(|untrusted| warn_of_untrusted(untrusted, campaign));
    merged.out_of_range.iter().for_each(warn_of_bending);
    if merged.missing.is_empty() {
        return Ok(ExitStatus::Success);
    }
    Err(Failure::Failed(are_missing(&merged.missing, campaign)))
}

/// The number of rows that are missing, and the first of them.
fn are_missing(missing: &[Range<u64>], campaign: &Campaign) -> String {
    let range = |range: &Range<u64>| match range.end - range.start {
        1 => range.start.to_string(),
        _ => format!("{}–{}", range.start, range.end - 1),
    };
    let named: Vec<String> = missing.iter().take(NAMED).map(range).collect();
    let more = if missing.len() > NAMED { ", …" } else { "" };
    let count: u64 = missing.iter().map(|range| range.end - range.start).sum();
    format!("{count} of {} rows are missing: {}{more}", campaign.runs(), named.join(", "))
}

/// Number of runs by their end; those that are done, but not to be trusted or out of the model's range, apart.
fn counts(merged: &Merged) -> Vec<(u64, &'static str)> {
    let untrusted = merged.untrusted.map_or(0, |untrusted| untrusted.count);
    let bent = merged.out_of_range.map_or(0, |bent| bent.count);
    let apart = |(ending, count): (&Ending, &u64)| match ending {
        Ending::Done => vec![
            (count - untrusted - bent, "done"),
            (bent, "done, out of the model's range: a link was bent too far"),
            (untrusted, "done, not to be trusted: the energy balance is off"),
        ],
        ending => vec![(*count, ending.as_str())],
    };
    merged.endings.iter().flat_map(apart).filter(|(count, _)| *count > 0).collect()
}

/// Warns of runs that are not to be trusted, with an example and the way to a better step.
fn warn_of_untrusted(untrusted: &Untrusted, campaign: &Campaign) {
    let Untrusted { count, first, worst_balance_j, in_play_j } = *untrusted;
    let example = unbalanced(worst_balance_j, in_play_j);
    say!("warning: {} ended unbalanced, such as run {first}: {example}", counted(count, "run"));
    let source = campaign.scene_of(first).ok();
    if let Some(remedy) = source.and_then(|source| step_remedy(std::iter::once(&source.scene))) {
        say!("not to be trusted: {remedy}; SCENE is the campaign's scene with the values of run {first}");
    }
}

/// Warns of runs that bent a link further than the model covers, with an example.
fn warn_of_bending(out_of_range: &OutOfRange) {
    let OutOfRange { count, first, bent } = *out_of_range;
    let example = beyond_range(bent).unwrap_or_default();
    say!("warning: {} bent a link too far, such as run {first}: {example}", counted(count, "run"));
}

/// Warns of runs that did not run to their end, with an example of each ending.
fn warn_of_failures(merged: &Merged) {
    for (ending, count) in merged.endings.iter().filter(|(ending, _)| **ending != Ending::Done) {
        let ended = format!("{} ended as {}", counted(*count, "run"), ending.as_str());
        match merged.causes.get(ending) {
            Some((index, cause)) => say!("warning: {ended}, such as run {index}: {}", shown_sentence(cause)),
            None => say!("warning: {ended}: see the column `cause` of {}", merged.path.display()),
        }
    }
}

/// Formats with three significant digits.
fn three_digits(value: f64) -> String {
    figure(format!("{value:.2e}").parse().unwrap_or(value))
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
