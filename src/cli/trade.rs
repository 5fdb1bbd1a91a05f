//! `trade`: measures speed against accuracy, and chooses the cheapest settings that suffice.

use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::{ArgGroup, ValueEnum};
use clap_complete::engine::{ArgValueCandidates, ArgValueCompleter};
use indicatif::ProgressBar;

use super::aligned_table::figure;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::must_be_targets;
use super::formatting::counted;
use super::output::print_json;
use super::progress::{ProgressLines, bar};
use super::signals::{Interruption, interruption_leaves, interruption_leaves_files};
use super::suspect_numbers::suspect_numbers;
use super::trade_choice::{decide, decide_levels};
use super::trade_modes::{among, lost, print_modes};
use super::trade_table::{print_study, words};
use super::values::{positive, positive_time, step};
use super::written::write_table;
use crate::nearest::did_you_mean;
use crate::plot::{Figure, Format, Picture as _, work_precision};
use crate::scene::{INTEGRATORS, IntegratorKind, MODELS, ModelKind, Scene, SceneSource, builtin};
use crate::study::trade::{
    Chosen, Configuration, Demands, Grid, LostModes, OutputGroup, Progress, Question, Selection, Study, choose, choose_levels,
    study, table,
};

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank trade                                        the default scene, everything that suits it
  flexcrank trade ref-r2s --models modal,finite-element --steps 1e-3,5e-4,1e-4 --csv trade.csv --plot trade.svg
  flexcrank trade ref-r2s --tolerance 1e-3 --real-time-factor 5 --outputs angle,slider
  flexcrank trade --tolerance 1e-3 --real-time-factor 20 --outputs angle,slider,deflection,energy
  flexcrank trade mine.toml --tolerance 1e-2 --write chosen.toml
  flexcrank trade --levels 4 --real-time-factor 5 --write levels.toml
  flexcrank trade ref-r2s --models modal --steps 1e-3,5e-4 --fixed-cost

Errors are relative: crank angle in rad, slider over its stroke (of a chain without slider, tip over its length), deflection of each link's \
    middle and joint forces over their peaks (a deflection whose peak is below 1e-6 of its link's length, over that length), \
    energy balance over the largest kinetic and strain energy. Each is the largest over the \
    instants at which runs are compared, which the first line of the output names. A spike between two instants is not seen; trade \
    warns if the chosen step is too long for a short load of the slider. A run has some 80 to 200 instants: with a shorter --until they are closer. All --steps divide the time between two instants, \
    so long steps leave fewer; below 50 there is a warning. Energy errors grow over time: if energy is among the outputs, --tolerance \
    also checks the choice over ten minutes of the scene, and --budget does not bound that check.

Levels of detail are settings between which a running service can switch. --levels prints them as [[level]] tables, or with --write \
    writes the scene with them. All reach --real-time-factor. The first is the best of those, within --tolerance if that is given; \
    its keys become the scene's own. The last is the cheapest with an error of at most 0.5 in the outputs that count. Each costs at \
    most 0.7 of the one before, by its quickest repeat; their steps divide one another. Each is verified on another speed and pulse (where nothing drives it, with a fifth more load), and \
    error_rad is the larger error of the crank's chord angle. Before they are accepted, a run switches between neighbours, both ways.

Columns (all with --wide, --csv and --json; without these, FE is finite-element, RK4 runge-kutta, and rigid/axial a rigid crank and \
    a rod with axial flexibility): links of modal stretch where they are called axial, and those of finite-element always. error is the \
    largest that counts. s/s is seconds of computing per simulated second: median, and half the spread of the repeats. p99.9 and worst \
    are costs of single steps. newton and factor are iterations and factorizations per step. order is the observed order \
    against the next longer step, mesh the one against the next coarser mesh. corr. is there with --fixed-cost. `*` marks the front: no other \
    configuration is cheaper and as accurate, or more accurate and as cheap. `<` marks an error below the reference's own uncertainty, `~` one \
    less than ten times as large. In --csv and --json, reference_error is that uncertainty in the output that error is of, and \
    error_is_bound is 1 for `<`: error is then an upper bound, as far as that estimate is right. reference_ten_times_better is 1 if no output that counts has either \
    mark. In the picture, triangles stand for `<` and rings for `~`.

Vibrations, after the table, are those without damping, numbered by frequency; swings of the chain, which strain nothing, are not among \
    them. energy is the mean part of a mode in the energy of \
    all vibrations, moving the same of what moves, output the most by which its vibration changes an output that counts: for forces, \
    by the forces that it exerts at the joints. Energy is not judged there. Those that change an output by more than --tolerance, or \
    1e-3, are a reason to look, not a measurement: the errors in the table are measured. \
    A configuration loses one by its model if it has no such mode or one off by a tenth, and by its step if that moves the eigenvalue \
    by a tenth. lost_modes, worst_mode, worst_frequency_error and worst_damping_error are columns of --csv and --json. \
    lost_modes is `none` where none of those is lost. All four are empty where that is not known, as after Ctrl-C. The column interrupted then \
    says that the table is a part.";

/// Part of the tolerance at which a row of ever shorter steps ends: the rest is a margin for the run that verifies.
const ENOUGH: f64 = 0.25;

/// A vibration that changes outputs by less than this is not missed, unless another tolerance is asked for.
const MISSED: f64 = 1e-3;

/// Where the results go, and in which form.
#[derive(Debug, clap::Args)]
struct OutputArgs {
    /// Write the complete table to this file, with root-mean-square errors, timing spreads and counts. One of the same
    /// name is replaced.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print all columns: 180 characters a line.
    #[arg(long, conflicts_with = "json")]
    wide: bool,
    /// Print each row of the complete table as one line of JSON, instead of the table.
    #[arg(long)]
    json: bool,
    /// Draw the work–precision diagram to this file, .svg or .png.
    #[arg(long, value_name = "FILE", value_parser = picture)]
    plot: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
#[command(group = ArgGroup::new("choice").args(["tolerance", "levels"]).multiple(true))]
pub(super) struct Args {
    /// A built-in scene or a TOML file.
    #[arg(default_value = builtin::DEFAULT, add = ArgValueCompleter::new(completions::scenes))]
    scene: String,
    /// Only these models.
    #[arg(long, value_name = "MODEL,…", value_delimiter = ',', value_parser = model, add = ArgValueCandidates::new(completions::models))]
    models: Vec<ModelKind>,
    /// Only these integrators.
    #[arg(long, value_name = "INTEGRATOR,…", value_delimiter = ',', value_parser = integrator, add = ArgValueCandidates::new(completions::integrators))]
    integrators: Vec<IntegratorKind>,
    /// Only these steps. Default: from the sampling interval down, while shorter steps gain accuracy.
    #[arg(long, value_name = "TIME,…", value_delimiter = ',', value_parser = step)]
    steps: Vec<f64>,
    /// Elements per link for finite-element; even, so that there is a middle node.
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = elements)]
    elements: Vec<usize>,
    /// Modes for modal, of the slowest link; the other links get those up to the same frequency.
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = modes)]
    modes: Vec<usize>,
    /// Simulated duration. Default: 2 s, a second after the last pulse, two turns of a prescribed motion after its ramp, but at
    /// most 10 s of them, or to the last row of drive.table; more, as a ringing after that, needs --until. It is rounded up to a whole number
    /// of instants at which runs are compared.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    until: Option<f64>,
    /// Outputs whose errors count; energy counts over ten minutes with --tolerance. `tip` is another word for slider.
    #[arg(long, value_name = "OUTPUT,…", value_delimiter = ',', default_values = ["angle", "slider", "deflection"])]
    outputs: Vec<OutputGroupWord>,
    /// Time budget of the table; the reference takes up to a third of it on an idle core, most of it on a slow or busy one, and two
    /// runs at least. The list of vibrations takes some seconds more, and the verification of a choice has a reference of its own.
    #[arg(long, value_name = "TIME", default_value = "4min", value_parser = positive_time)]
    budget: f64,
    /// Choose the cheapest settings with errors within this tolerance, or explain why there are none.
    #[arg(long, value_name = "ERROR", value_parser = positive)]
    tolerance: Option<f64>,
    /// Choose this many levels of detail, 2 to 8, from the best setting that is fast enough to the cheapest that is of use.
    #[arg(long, value_name = "N", value_parser = levels)]
    levels: Option<usize>,
    /// Simulated seconds per second that the choice, or every level, must reach, by its slowest repeat.
    #[arg(long, value_name = "FACTOR", default_value = "1", requires = "choice", value_parser = positive)]
    real_time_factor: f64,
    /// Write a copy of the scene with the chosen settings or levels; the file must not exist.
    #[arg(long, value_name = "FILE", requires = "choice")]
    write: Option<PathBuf>,
    /// Also report the number of Newton corrections in a stage that suffices for steps of fixed cost (run --fixed-cost), in the column corr.,
    /// and judge the energy balance of such steps.
    /// --budget does not bound the seconds that each configuration takes for it.
    #[arg(long)]
    fixed_cost: bool,
    #[command(flatten)]
    output: OutputArgs,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum OutputGroupWord {
    Angle,
    #[value(alias = "tip")]
    Slider,
    Deflection,
    Forces,
    Energy,
}

impl From<OutputGroupWord> for OutputGroup {
    fn from(word: OutputGroupWord) -> Self {
        match word {
            OutputGroupWord::Angle => OutputGroup::Angle,
            OutputGroupWord::Slider => OutputGroup::Slider,
            OutputGroupWord::Deflection => OutputGroup::Deflection,
            OutputGroupWord::Forces => OutputGroup::Forces,
            OutputGroupWord::Energy => OutputGroup::Energy,
        }
    }
}

pub(super) fn trade(args: &Args) -> CommandResult {
    let source = SceneSource::open(&args.scene, &args.overrides)?;
    if args.levels.is_some() && args.models == [ModelKind::Incremental] {
        return Err(Failure::Usage(
            "--models: incremental carries its own state, so that no run can switch to it or from it".into(),
        ));
    }
    if source.scene.solver.corrections.is_some() {
        return Err(Failure::Usage(
            "the scene names solver.corrections, which suits one configuration: leave it out (--fixed-cost reports it for each)"
                .into(),
        ));
    }
    if let Some(taken) = args.write.as_ref().filter(|path| path.exists()) {
        return Err(Failure::Failed(format!("{}: exists already, and scenes are never overwritten", taken.display())));
    }
    let targets = [("--write", &args.write), ("--csv", &args.output.csv), ("--plot", &args.output.plot)];
    must_be_targets(&args.scene, &targets.map(|(option, path)| (option, path.as_deref())))?;
    suspect_numbers(&source).iter().for_each(|warning| say!("warning: {warning}"));
    let question = question(args);
    warn_of_values(args, &question, &source.scene);
    let interruption = Interruption::watch()?;
    let lines = ProgressLines::begin();
    let families = bar(0, "{bar:20} {pos}/{len} families, {elapsed}{left}  {wide_msg}");
    let mut study = study(&source.scene, &question, &mut |progress| {
        interruption.keeps(!progress.reference);
        match progress.reference {
            true => interruption_leaves("nothing was written: only the reference was being computed".to_owned()),
            false => interruption_leaves_files(),
        }
        show(&families, &lines, &progress);
        if interruption.is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    if args.fixed_cost && !study.interrupted {
        study.rate_fixed_cost(&source.scene, &mut |running| {
            families.set_message(format!("corrections: {running}"));
            lines.report(|| format!("corrections: {running}"));
            if interruption.is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
    }
    families.finish_and_clear();
    // After all timings, which they would disturb.
    let modes = lost_modes(args, &source.scene, &study);
    // A failure of printing is told last: all files are written, a chosen scene among them.
    let shown = show_study(args, &study, modes.as_ref());
    write(args, &study, modes.as_ref(), shown.is_ok())?;
    interruption.keeps(false);
    if study.interrupted {
        say_reason!("warning: interrupted: the table is a part, {} configurations{}", study.rows.len(), args.not_chosen());
        return shown.and(Ok(ExitStatus::Interrupted));
    }
    if (args.tolerance.is_none() && args.levels.is_none()) || (shown.is_err() && args.write.is_none()) {
        if interruption.is_asked() && args.tolerance.is_none() && args.levels.is_none() && shown.is_ok() {
            say!("the table was computed to its end: nothing is lost");
        }
        return shown.and(Ok(ExitStatus::Success));
    }
    if interruption.is_asked() {
        say_reason!("warning: interrupted: the table is whole{}", args.not_chosen());
        return shown.and(Ok(ExitStatus::Interrupted));
    }
    interruption_leaves(format!("the table is whole{}", args.not_chosen()));
    let demands = Demands { tolerance: args.tolerance.unwrap_or(f64::INFINITY), real_time_factor: args.real_time_factor };
    let verifying = bar(0, "verifying, {elapsed}  {wide_msg}");
    let mut show = |running: &Configuration| {
        verifying.set_message(running.to_string());
        lines.report(|| format!("verifying: {running}"));
    };
    if let Some(count) = args.levels {
        let levels = choose_levels(&source, &study, &demands, count, args.budget, &mut show);
        verifying.finish_and_clear();
        let decided = decide_levels(args.write.as_deref(), count, levels);
        return decided.and_then(|ended| shown.map(|()| ended));
    }
    let choice = choose(&source.scene, &study, &demands, args.budget, &mut show);
    verifying.finish_and_clear();
    let lost = |chosen: &Chosen| {
        modes.as_ref().map(|modes| format!("{}, lost: {}", among(modes), lost(&study, modes, &chosen.row).join("; ")))
    };
    decide(args.write.as_deref(), &source, &choice, lost).and_then(|ended| shown.map(|()| ended))
}

impl Args {
    /// The rest of a message about an interruption, after which there is no choice.
    fn not_chosen(&self) -> String {
        let unwritten = self.write.as_ref().map(|path| format!(", and {} is not written", path.display()));
        match self.tolerance.is_some() || self.levels.is_some() {
            true => format!("; nothing is chosen{}", unwritten.unwrap_or_default()),
            false => String::new(),
        }
    }
}

/// Warns of values that were probably meant in another unit: steps in milliseconds, a tolerance in per cent.
fn warn_of_values(args: &Args, question: &Question, scene: &Scene) {
    let grid = scene.chain().and_then(|_| question.grid(scene).ok());
    if let Some(grid) = grid.filter(Grid::has_few_instants) {
        say!(
            "warning: with these --steps, runs are compared at only {}, {} s apart: errors between them are not seen; shorter \
             --steps or a longer --until give more; a step without a unit is in seconds",
            counted(grid.count as u64, "instant"),
            grid.interval_s
        );
    }
    if let Some(tolerance) = args.tolerance.filter(|tolerance| *tolerance > 1.0) {
        let [percent, meant] = [100.0 * tolerance, 0.01 * tolerance].map(figure);
        say!("warning: --tolerance {tolerance} is {percent} %: errors are relative, and {tolerance} % is {meant}");
    }
}

/// The vibrations that each configuration loses; none of a study that was interrupted.
fn lost_modes(args: &Args, scene: &Scene, study: &Study) -> Option<LostModes> {
    if study.interrupted {
        return None;
    }
    let tolerance = args.tolerance.unwrap_or(MISSED);
    LostModes::new(scene, study, tolerance).map_err(|none| say!("no list of vibrations: {none}")).ok()
}

/// Prints the study, as a table or as JSON.
fn show_study(args: &Args, study: &Study, modes: Option<&LostModes>) -> CommandResult<()> {
    if args.output.json {
        return Ok(table(study, modes).rows_as_json().iter().try_for_each(print_json)?);
    }
    print_study(&args.scene, study, args.output.wide)?;
    modes.map_or(Ok(()), |modes| print_modes(study, modes))
}

/// Writes the table and the picture; the table is told on standard output if `told`.
fn write(args: &Args, study: &Study, modes: Option<&LostModes>, told: bool) -> CommandResult<()> {
    let table = table(study, modes);
    let written = args.output.csv.as_deref().map_or(Ok(()), |path| write_table(path, &table, told && !args.output.json));
    let part = if study.interrupted { " (interrupted study)" } else { "" };
    let title = format!("{}: error in {}{part}", args.scene, words(study));
    if let (Some(path), Some(figure)) = (&args.output.plot, work_precision(&table)) {
        let figure = Figure { title, ..figure };
        figure.write(path, Format::of(path).unwrap_or(Format::Svg))?;
        say!("wrote {}", path.display());
    }
    written
}

fn question(args: &Args) -> Question {
    let mut outputs = Vec::new();
    for output in args.outputs.iter().map(|word| OutputGroup::from(*word)) {
        // `slider` and `tip` are one.
        if !outputs.contains(&output) {
            outputs.push(output);
        }
    }
    Question {
        selection: Selection {
            models: args.models.clone(),
            integrators: args.integrators.clone(),
            elements: args.elements.clone(),
            modes: args.modes.clone(),
            steps_s: args.steps.clone(),
            link_by_link: args.tolerance.is_some() || args.levels.is_some(),
        },
        outputs,
        until_s: args.until,
        budget_s: args.budget,
        enough: args.tolerance.map(|tolerance| ENOUGH * tolerance),
    }
}

fn show(bar: &ProgressBar, lines: &ProgressLines, progress: &Progress<'_>) {
    let Progress { done, of, running, reference } = *progress;
    let message = format!("{}{running}", if reference { "reference: " } else { "" });
    lines.report(|| format!("{done} of {of} families done, running {message}"));
    bar.set_length(of as u64);
    bar.set_position(done as u64);
    bar.set_message(message);
}

/// A model of chains: `trade` takes no oscillator.
fn model(word: &str) -> Result<ModelKind, String> {
    let of_chains: Vec<(&str, ModelKind)> = MODELS.into_iter().filter(|(_, kind)| *kind != ModelKind::MassSpring).collect();
    find(word, &of_chains)
}

fn integrator(word: &str) -> Result<IntegratorKind, String> {
    find(word, &INTEGRATORS)
}

fn find<T: Copy>(word: &str, words: &[(&str, T)]) -> Result<T, String> {
    let found = words.iter().find(|(other, _)| *other == word).map(|(_, kind)| *kind);
    let names = || words.iter().map(|(name, _)| *name);
    found.ok_or_else(|| format!("one of {}{}", names().collect::<Vec<_>>().join(", "), did_you_mean(word, names())))
}

fn picture(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    Format::of(&path).map(|_| path).ok_or_else(|| "a picture ends in .svg or .png".to_owned())
}

fn levels(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|number| (2..=8).contains(number)).ok_or_else(|| "a whole number from 2 to 8".to_owned())
}

fn elements(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| (2..=1000).contains(number) && number % 2 == 0);
    number.ok_or_else(|| "an even number from 2 to 1000".to_owned())
}

fn modes(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|number| (1..=20).contains(number)).ok_or_else(|| "a whole number from 1 to 20".to_owned())
}
