//! `plot`: figures from recordings and tables, and those of the thesis.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::make_folder;
use super::values::number;
use crate::plot::{self, Figure, Format, Named, Picture, Titled, thesis};
use crate::recording::read_columns;
use crate::scene::SceneSource;
use crate::study::{self, Table, cycle};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank plot recordings/crank.mcap -o plots
  flexcrank plot recordings/crank.mcap --y links.crank.chord_rad,links.rod.chord_rad -o angles.svg
  flexcrank plot recordings/crank.mcap --animation=0.25 -o crank.svg
  flexcrank plot turn.csv --x crank_angle_rad --y driving_torque_nm --title Torque -o torque.png
  flexcrank plot --thesis thesis-figures";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Recordings (.mcap) or tables (CSV).
    #[arg(required_unless_present = "thesis", value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Folder for the figures, or the file (.svg, .png) for a single one.
    #[arg(long, short, value_name = "DIR|FILE", default_value = "plots")]
    pub output: PathBuf,
    /// Formats of the figures in a folder.
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', default_value = "svg,png")]
    pub format: Vec<PictureFormat>,
    /// Column of the horizontal axis. Default: a recording's simulated time, a table's first column.
    #[arg(long, value_name = "COLUMN", requires = "y")]
    pub x: Option<String>,
    /// Draw these columns in one figure, instead of the default figures.
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    pub y: Vec<String>,
    /// Title of the figures.
    #[arg(long)]
    pub title: Option<String>,
    /// Animate the mechanism instead: one SVG that moves by itself, at most 10 s long; SPEED in recorded seconds per second.
    #[arg(long, value_name = "SPEED", num_args = 0..=1, require_equals = true, default_missing_value = "1", value_parser = playing_speed)]
    #[arg(conflicts_with_all = ["x", "y", "title"])]
    pub animation: Option<f64>,
    /// Compute and draw every figure of the thesis into this folder, with an index.html.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["files", "output", "x", "y", "title", "animation"])]
    pub thesis: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum PictureFormat {
    Svg,
    Png,
}

impl Args {
    /// The requested formats, without repetition.
    fn formats(&self) -> Vec<Format> {
        let mut formats = Vec::new();
        for format in &self.format {
            let format = match format {
                PictureFormat::Svg => Format::Svg,
                PictureFormat::Png => Format::Png,
            };
            if !formats.contains(&format) {
                formats.push(format);
            }
        }
        formats
    }
}

fn playing_speed(text: &str) -> Result<f64, String> {
    number(text, 1e-3, 1e3)
}

/// The request does not fit the files: a usage error.
#[derive(Debug, thiserror::Error)]
pub(super) enum BadPlot {
    #[error("{0}: a picture ends in .svg or .png; for several, name a folder")]
    Ending(PathBuf),
    #[error("{file} would hold {figures} figures: name a folder with -o, or choose one figure with --y")]
    Several { file: PathBuf, figures: usize },
    #[error("{0}: an animation ends in .svg")]
    NotSvg(PathBuf),
    #[error("two figures would be written to {0}: plot these files one by one, into different folders")]
    Twice(PathBuf),
}

impl From<BadPlot> for Failure {
    fn from(error: BadPlot) -> Self {
        Failure::Usage(error.to_string())
    }
}

/// Default column of the horizontal axis of a recording.
const RECORDED_TIME: &str = "stamp.sim_time_s";

pub(super) fn plot(args: &Args) -> CommandResult {
    if let Some(folder) = &args.thesis {
        return write_thesis(folder, &args.formats());
    }
    if let Some(speed) = args.animation {
        return write_animations(args, speed);
    }
    let mut pictures = Vec::new();
    let mut done = ExitStatus::Success;
    for file in &args.files {
        let (figures, all) = figures(file, args)?;
        done = if all { done } else { ExitStatus::Lossy };
        pictures.extend(figures);
    }
    for (path, format, figure) in places(pictures, args)? {
        Picture::from(figure).write(&path, format)?;
        writeln!(std::io::stdout(), "{}", path.display())?;
    }
    Ok(done)
}

/// Animates each recording: into the one file named, or into a folder.
fn write_animations(args: &Args, speed: f64) -> CommandResult {
    let output = &args.output;
    let into_file = Format::of(output) == Some(Format::Svg) && !output.is_dir();
    if into_file && args.files.len() > 1 {
        return Err(BadPlot::Several { file: output.clone(), figures: args.files.len() }.into());
    }
    if !into_file && output.extension().is_some() && !output.is_dir() {
        return Err(BadPlot::NotSvg(output.clone()).into());
    }
    let mut done = ExitStatus::Success;
    for file in &args.files {
        let (tables, whole) = recording(file)?;
        done = if whole { done } else { ExitStatus::Lossy };
        let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let none = Table::default();
        let displacements = tables.iter().find(|topic| topic.name.rsplit('/').next() == Some("displacements"));
        let animation = plot::animation(&stem, displacements.map_or(&none, |topic| &topic.table), speed)?;
        let path = if into_file { output.clone() } else { output.join(format!("{stem}-animation.svg")) };
        path.parent().filter(|folder| !folder.as_os_str().is_empty()).map_or(Ok(()), make_folder)?;
        std::fs::write(&path, animation.svg).map_err(Failure::file(&path))?;
        let plot::Animation { magnified, recorded_s, .. } = animation;
        writeln!(std::io::stdout(), "{} ({recorded_s:.2} s, bending drawn {magnified} times as large)", path.display())?;
    }
    Ok(done)
}

/// Figures of a file with their file names, and whether the file was complete.
fn figures(file: &Path, args: &Args) -> CommandResult<(Vec<(String, Figure)>, bool)> {
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let recorded = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"));
    let (tables, whole) = if recorded { recording(file)? } else { (vec![table(&stem, file)?], true) };
    let mut figures = if !args.y.is_empty() {
        let x = args.x.as_deref().or(recorded.then_some(RECORDED_TIME));
        vec![(stem.clone(), plot::figure(&stem, &tables, x, &args.y)?)]
    } else if recorded {
        let own = |Titled { file, figure }: Titled| (format!("{stem}-{file}"), figure);
        plot::recorded(&tables).into_iter().map(own).collect()
    } else if let Some(figure) = plot::work_precision(&stem, &tables[0].table) {
        vec![(format!("{stem}-work-precision"), figure)]
    } else {
        // A figure of the whole file has the file's name.
        let own =
            |(part, figure): (String, Figure)| (if part.is_empty() { stem.clone() } else { format!("{stem}-{part}") }, figure);
        plot::overview(&stem, &tables[0].table)?.into_iter().map(own).collect()
    };
    if let Some(title) = &args.title {
        let one = figures.len() == 1;
        for (_, figure) in &mut figures {
            figure.title = if one || figure.title == stem { title.clone() } else { format!("{title}: {}", figure.title) };
        }
    }
    Ok((figures, whole))
}

fn table(stem: &str, file: &Path) -> CommandResult<Named> {
    Ok(Named { name: stem.to_owned(), table: Table::read_csv(file)? })
}

fn recording(file: &Path) -> CommandResult<(Vec<Named>, bool)> {
    let contents = read_columns(file)?;
    for topic in contents.skipped {
        say!("warning: {topic} is not protobuf and was left out");
    }
    if contents.cut_off {
        say!("warning: {} ends early; everything before is drawn", file.display());
    }
    let named = |topic: crate::recording::TopicColumns| {
        let mut table = Table::default();
        topic.columns.into_iter().for_each(|(name, values)| table.push(name, values));
        Named { name: topic.name, table }
    };
    Ok((contents.topics.into_iter().map(named).collect(), !contents.cut_off))
}

/// File and format of every figure.
fn places(figures: Vec<(String, Figure)>, args: &Args) -> CommandResult<Vec<(PathBuf, Format, Figure)>> {
    let output = &args.output;
    let is_file = output.extension().is_some() && !output.is_dir();
    if is_file {
        let format = Format::of(output).ok_or_else(|| BadPlot::Ending(output.clone()))?;
        let count = figures.len();
        let Ok([(_, figure)]) = <[_; 1]>::try_from(figures) else {
            return Err(BadPlot::Several { file: output.clone(), figures: count }.into());
        };
        let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty());
        folder.map_or(Ok(()), make_folder)?;
        return Ok(vec![(output.clone(), format, figure)]);
    }
    make_folder(output)?;
    let mut taken = BTreeSet::new();
    let mut places = Vec::new();
    for (name, figure) in figures {
        for format in args.formats() {
            let path = output.join(format!("{name}.{}", format.extension()));
            if !taken.insert(path.clone()) {
                return Err(BadPlot::Twice(path).into());
            }
            places.push((path, format, figure.clone()));
        }
    }
    Ok(places)
}

/// Crank-to-rod ratios of the thesis's chapter 4.
const RATIOS: [f64; 3] = [0.1, 0.25, 0.5];
/// Scenes of chapter 5 and their durations: ten seconds of the oscillators, three periods of either beam, one turn of the
/// crank-slider; s.
const OSCILLATORS: [(&str, f64); 3] =
    [("thesis-oscillator", 10.0), ("thesis-two-masses", 10.0), ("thesis-two-masses-stiff", 10.0)];
const BEAM: (&str, f64) = ("thesis-beam", 3.0 * 3.5589);
const BEAM_WITH_TIP_MASS: (&str, f64) = ("thesis-beam-tip", 3.0 * 10.5528);
const CRANK_SLIDER: (&str, f64) = ("thesis-crank-slider", 22.8);

fn write_thesis(folder: &Path, formats: &[Format]) -> CommandResult {
    let figures = thesis::figures(&thesis_tables()?);
    make_folder(folder)?;
    for figure in &figures {
        for format in formats {
            figure.picture.write(&folder.join(format!("{}.{}", figure.file, format.extension())), *format)?;
        }
    }
    let page = folder.join("index.html");
    std::fs::write(&page, thesis::page(&figures, formats)).map_err(Failure::file(&page))?;
    writeln!(std::io::stdout(), "{} figures, all on {}", figures.len(), page.display())?;
    Ok(ExitStatus::Success)
}

fn thesis_tables() -> CommandResult<thesis::Tables> {
    let compressor = SceneSource::open("thesis-compressor", &[])?;
    let options = cycle::Options { ratios: RATIOS.to_vec(), dimensionless: true, ..cycle::Options::default() };
    let run = |(scene, until_s): (&str, f64)| -> CommandResult<Table> {
        Ok(study::history(&SceneSource::open(scene, &[])?.scene, until_s)?)
    };
    let [one, two, stiff] = OSCILLATORS;
    Ok(thesis::Tables {
        oscillators: [run(one)?, run(two)?, run(stiff)?],
        compressor: cycle::cycle(&compressor, &options)?,
        beam: run(BEAM)?,
        beam_with_tip_mass: run(BEAM_WITH_TIP_MASS)?,
        crank_slider: run(CRANK_SLIDER)?,
    })
}
