//! `trade`: measures speed against accuracy, and chooses the cheapest settings that suffice.

use std::fs::File;
use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::ValueEnum;
use clap_complete::engine::{ArgValueCandidates, ArgValueCompleter};
use indicatif::ProgressBar;

use super::aligned_table::print;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::must_be_writable;
use super::output::{output, print_json};
use super::progress::bar;
use super::signals::Interruption;
use super::values::{positive, positive_time, step};
use crate::plot::{Format, Picture as _, work_precision};
use crate::scene::{INTEGRATORS, IntegratorKind, MODELS, ModelKind, SceneSource, builtin};
use crate::study::trade::{
    Choice, Chosen, Configuration, Demands, Measured, OutputGroup, Progress, Question, Row, Selection, Study, choose, study,
    table,
};

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank trade                                        the default scene, everything that suits it
  flexcrank trade ref-r2s --models modal,finite-element --steps 1e-3,5e-4,1e-4 --csv trade.csv --plot trade.svg
  flexcrank trade ref-r2s --tolerance 1e-3 --real-time-factor 5 --outputs angle,slider
  flexcrank trade --tolerance 1e-3 --real-time-factor 20 --outputs angle,slider,deflection,energy
  flexcrank trade mine.toml --tolerance 1e-2 --write chosen.toml

Errors are relative: crank angle in rad, slider over its stroke, deflection of each link's middle and joint forces \
    over their peaks, energy balance over the largest kinetic and strain energy; the largest over the run's instants. \
    Energy errors grow over time: if energy is among the outputs, --tolerance also checks the choice over ten minutes \
    of the scene, and --budget does not bound that check.

Columns (all with --wide, --csv and --json): error is the largest that counts. s/s is seconds of computing per simulated second: median, and half the spread of the repeats. p99.9 and worst \
    are costs of single steps. newton and factor are iterations and factorizations per step. order is the observed order \
    against the next longer step, mesh the one against the next coarser mesh. `*` marks the front: no other \
    configuration is both cheaper and more accurate. `<` marks an error below the reference's own uncertainty, `~` one \
    less than ten times as large.";

#[derive(Debug, clap::Args)]
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
    /// Simulated duration. Default: 2 s, or a second after the last pulse, or two turns of a prescribed motion.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    until: Option<f64>,
    /// Outputs whose errors count; energy counts over ten minutes with --tolerance.
    #[arg(long, value_name = "OUTPUT,…", value_delimiter = ',', default_values = ["angle", "slider", "deflection"])]
    outputs: Vec<OutputGroupWord>,
    /// Time budget; the reference takes up to a third of it.
    #[arg(long, value_name = "TIME", default_value = "4min", value_parser = positive_time)]
    budget: f64,
    /// Choose the cheapest settings with errors within this tolerance, or explain why there are none.
    #[arg(long, value_name = "ERROR", value_parser = positive)]
    tolerance: Option<f64>,
    /// Simulated seconds per second that the choice must reach.
    #[arg(long, value_name = "FACTOR", default_value = "1", requires = "tolerance", value_parser = positive)]
    real_time_factor: f64,
    /// Write a copy of the scene with the chosen settings; the file must not exist.
    #[arg(long, value_name = "FILE", requires = "tolerance")]
    write: Option<PathBuf>,
    /// Write the complete table to this file, with root-mean-square errors, timing spreads and counts.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print all columns: 170 characters a line.
    #[arg(long, conflicts_with = "json")]
    wide: bool,
    /// Print each row of the complete table as one line of JSON, instead of the table.
    #[arg(long)]
    json: bool,
    /// Draw the work–precision diagram to this file, .svg or .png.
    #[arg(long, value_name = "FILE", value_parser = picture)]
    plot: Option<PathBuf>,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum OutputGroupWord {
    Angle,
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
    if let Some(taken) = args.write.as_ref().filter(|path| path.exists()) {
        return Err(Failure::Failed(format!("{}: exists already, and scenes are never overwritten", taken.display())));
    }
    [&args.write, &args.csv, &args.plot].into_iter().flatten().try_for_each(|path| must_be_writable(path))?;
    let interruption = Interruption::watch()?;
    let families = bar(0, "{bar:20} {pos}/{len} families, {elapsed}{left}  {wide_msg}");
    let study = study(&source.scene, &question(args), &mut |progress| {
        // Without a reference, there is nothing to keep.
        interruption.keeps(!progress.reference);
        show(&families, &progress);
        if interruption.is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    interruption.keeps(false);
    families.finish_and_clear();
    show_study(args, &study)?;
    write(args, &study)?;
    if study.interrupted {
        say!("warning: interrupted: the table is a part, {} configurations", study.rows.len());
        return Ok(ExitStatus::Interrupted);
    }
    let Some(tolerance) = args.tolerance else { return Ok(ExitStatus::Success) };
    let demands = Demands { tolerance, real_time_factor: args.real_time_factor };
    let verifying = bar(0, "verifying, {elapsed}  {wide_msg}");
    let mut show = |running: &Configuration| verifying.set_message(running.to_string());
    let choice = choose(&source.scene, &study, &demands, args.budget, &mut show);
    verifying.finish_and_clear();
    decide(args, &source, &choice)
}

/// Prints the study, as a table or as JSON.
fn show_study(args: &Args, study: &Study) -> CommandResult<()> {
    if args.json { Ok(table(study).rows_as_json().iter().try_for_each(print_json)?) } else { print_study(args, study) }
}

fn write(args: &Args, study: &Study) -> CommandResult<()> {
    let table = table(study);
    if let Some(path) = &args.csv {
        table.write_csv(path)?;
        say!("wrote {}", path.display());
    }
    let title = format!("{}: error in {}", args.scene, words(&study.outputs));
    if let (Some(path), Some(figure)) = (&args.plot, work_precision(&title, &table)) {
        figure.write(path, Format::of(path).unwrap_or(Format::Svg))?;
        say!("wrote {}", path.display());
    }
    Ok(())
}

fn words(outputs: &[OutputGroup]) -> String {
    outputs.iter().map(|output| output.as_str()).collect::<Vec<_>>().join(", ")
}

fn question(args: &Args) -> Question {
    Question {
        selection: Selection {
            models: args.models.clone(),
            integrators: args.integrators.clone(),
            elements: args.elements.clone(),
            modes: args.modes.clone(),
            steps_s: args.steps.clone(),
            link_by_link: args.tolerance.is_some(),
        },
        outputs: args.outputs.iter().map(|word| OutputGroup::from(*word)).collect(),
        until_s: args.until,
        budget_s: args.budget,
        enough: args.tolerance.map(|tolerance| 0.25 * tolerance),
    }
}

/// Prints and writes the chosen settings, or explains why none were found.
fn decide(args: &Args, source: &SceneSource, choice: &Choice) -> CommandResult {
    let mut out = output();
    match choice {
        Err(refusal) => {
            say!("refused: {refusal}");
            Ok(ExitStatus::Refused)
        }
        Ok(chosen) => {
            let keys = chosen.row.configuration.keys(&source.scene);
            let copy = SceneSource::parse(&source.origin, &source.text, &keys)?;
            writeln!(out, "\n{}", sections(chosen, &keys))?;
            if let Some(path) = &args.write {
                File::create_new(path).and_then(|mut file| file.write_all(copy.text.as_bytes())).map_err(Failure::file(path))?;
                say!("wrote {}", path.display());
            }
            Ok(ExitStatus::Success)
        }
    }
}

/// The settings as TOML, with their measured errors and speed.
fn sections(chosen: &Chosen, keys: &[String]) -> String {
    let error = chosen.row.outcome.as_ref().map_or(f64::NAN, |measured| measured.error);
    let trial = &chosen.trial;
    let mut text = format!(
        "# error {:.2e} at {:.4} times real time; on another speed and pulse {:.2e} at {:.4}\n",
        error, chosen.real_time_factor, trial.error, trial.real_time_factor
    );
    if let Some(error) = trial.long_energy {
        text += &format!("# energy balance over ten minutes: {error:.2e}\n");
    }
    if chosen.passed_over > 0 {
        text += &format!("# ({} cheaper ones held at first, but not when they were verified)\n", chosen.passed_over);
    }
    let mut table = "";
    for (name, rest) in keys.iter().filter_map(|key| key.split_once('.')) {
        if name != table {
            text += &format!("[{name}]\n");
            table = name;
        }
        text += &format!("{}\n", rest.replacen('=', " = ", 1));
    }
    text
}

const HEAD: [&str; 20] = [
    "",
    "model",
    "integrator",
    "links",
    "step s",
    "s/s",
    "±",
    "steps/s",
    "p99.9 µs",
    "worst µs",
    "angle",
    "slider",
    "deflection",
    "forces",
    "energy",
    "order",
    "mesh",
    "newton",
    "factor",
    "note",
];

fn print_study(args: &Args, study: &Study) -> CommandResult<()> {
    let name = &args.scene;
    let row = |(row, measured): (&Row, &Measured)| {
        let all = line(study, row, measured);
        if args.wide { all } else { narrow(&all, measured.error) }
    };
    let head = if args.wide { &HEAD[..] } else { &NARROW_HEAD[..] };
    let head = head.iter().map(|&name| name.to_owned()).collect();
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(study.measured().map(row)).collect();
    let mut out = output();
    let grid = &study.grid;
    writeln!(out, "{name}: {} s, compared at {} instants, {} s apart", grid.until_s(), grid.count, grid.interval_s)?;
    let estimate = OutputGroup::COMPARED.map(|output| format!("{} {:.1e}", output.as_str(), study.reference.estimate.of(output)));
    writeln!(out, "reference: {}", study.reference.configuration)?;
    writeln!(out, "  differs from the refinement before by {}\n", estimate.join(", "))?;
    print(&rows, 4)?;
    for row in &study.rows {
        if let Err(failed) = &row.outcome {
            writeln!(out, "  {}: {failed}", row.configuration)?;
        }
    }
    writeln!(out, "\nfront, by {}:", words(&study.outputs))?;
    for (row, measured) in study.front() {
        writeln!(out, "  {:>9.2e} s/s  error {:.1e}  {}", measured.timing.seconds_per_s, measured.error, row.configuration)?;
    }
    if study.left_out > 0 {
        writeln!(out, "{} finer configurations were skipped: --budget allows no more", study.left_out)?;
    }
    if study.cut_short {
        say!("warning: the time budget ran out: another run may compute more or fewer configurations");
    }
    Ok(())
}

/// The head of the table that fits 80 columns.
const NARROW_HEAD: [&str; 8] = ["", "model", "integrator", "links", "step s", "s/s", "error", "angle"];

/// The cells that fit 80 columns: configuration, cost, the largest error that counts, and that of the crank angle. `row` has all.
fn narrow(row: &[String], error: f64) -> Vec<String> {
    let cell = |head: &str| HEAD.iter().position(|other| *other == head).and_then(|place| row.get(place)).cloned();
    let short = |head: &str| {
        let cell = cell(head).unwrap_or_default();
        [("finite-element", "FE"), ("generalized-alpha", "gen.-alpha"), ("elements", "el.")]
            .iter()
            .fold(cell, |cell, (long, short)| cell.replace(long, short))
    };
    let error = format!("{error:.1e}");
    NARROW_HEAD.iter().map(|head| if *head == "error" { error.clone() } else { short(head) }).collect()
}

/// One row of the table: a configuration with its measurements.
fn line(study: &Study, row: &Row, m: &Measured) -> Vec<String> {
    let Configuration { family, step_s } = &row.configuration;
    let error = |output: OutputGroup| {
        let (error, estimate) = (m.errors.of(output), study.reference.estimate.of(output));
        match error {
            error if error < estimate => format!("<{estimate:.1e}"),
            error if error < 10.0 * estimate => format!("~{error:.1e}"),
            error => format!("{error:.1e}"),
        }
    };
    let timing = &m.timing;
    let spread = 50.0 * (timing.slowest_per_s - timing.quickest_per_s) / timing.seconds_per_s;
    let order = |order: Option<f64>| order.filter(|order| order.is_finite()).map_or(String::new(), |order| format!("{order:.1}"));
    let per_step = |count: u64| format!("{:.2}", count as f64 / m.effort.steps.max(1) as f64);
    let [angle, slider, deflection, forces, energy] = OutputGroup::ALL.map(error);
    vec![
        if m.on_front { "*".to_owned() } else { String::new() },
        family.model.as_str().to_owned(),
        family.integrator.as_str().to_owned(),
        family.discretization(),
        format!("{step_s:.2e}"),
        format!("{:.2e}", timing.seconds_per_s),
        format!("{spread:.0}%"),
        format!("{:.0}", 1.0 / (step_s * timing.seconds_per_s)),
        format!("{:.1}", 1e6 * timing.step_p999_s),
        format!("{:.0}", 1e6 * timing.step_worst_s),
        angle,
        slider,
        deflection,
        forces,
        energy,
        order(m.order),
        order(m.mesh_order),
        per_step(m.effort.newton_iterations),
        per_step(m.effort.factorizations),
        match (m.out_of_range, m.effort.retried) {
            (true, _) => "out of range".to_owned(),
            (_, 0) => String::new(),
            (_, retried) => format!("{retried} retried"),
        },
    ]
}

fn show(bar: &ProgressBar, progress: &Progress<'_>) {
    bar.set_length(progress.of as u64);
    bar.set_position(progress.done as u64);
    bar.set_message(format!("{}{}", if progress.reference { "reference: " } else { "" }, progress.running));
}

fn model(word: &str) -> Result<ModelKind, String> {
    find(word, &MODELS)
}

fn integrator(word: &str) -> Result<IntegratorKind, String> {
    find(word, &INTEGRATORS)
}

fn find<T: Copy>(word: &str, words: &[(&str, T)]) -> Result<T, String> {
    let found = words.iter().find(|(other, _)| *other == word).map(|(_, kind)| *kind);
    found.ok_or_else(|| format!("one of {}", words.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", ")))
}

fn picture(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    Format::of(&path).map(|_| path).ok_or_else(|| "a picture ends in .svg or .png".to_owned())
}

fn elements(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| (2..=1000).contains(number) && number % 2 == 0);
    number.ok_or_else(|| "an even number from 2 to 1000".to_owned())
}

fn modes(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|number| (1..=20).contains(number)).ok_or_else(|| "a whole number from 1 to 20".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_the_table_fits_80_columns() {
        let longest = |head: &str| match head {
            "" => "*",
            "model" => "finite-element",
            "integrator" => "generalized-alpha",
            "links" => "16 elements, crank rigid",
            "step s" => "2.50e-4",
            "s/s" => "1.23e-2",
            _ => "<1.2e-8",
        };
        let row: Vec<String> = HEAD.iter().map(|head| longest(head).to_owned()).collect();
        let cells = narrow(&row, 1.2e-8);
        let width: usize = cells.iter().zip(NARROW_HEAD).map(|(cell, head)| 2 + cell.chars().count().max(head.len())).sum();
        assert!(width <= 80, "{width}: {cells:?}");
        assert_eq!(cells[1..4], ["FE", "gen.-alpha", "16 el., crank rigid"]);
    }
}
