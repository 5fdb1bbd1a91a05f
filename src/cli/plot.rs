//! `plot`: figures from recordings and tables, and those of the thesis.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::ValueEnum;

use super::exit_status::ExitStatus;
use super::folders::make_folder;
use super::plot_source::Source;
use super::thesis_figures::write_thesis;
use super::values::{not_negative, number};
use crate::plot::{self, Entry, Figure, Format, Picture, Strobe, TimeRange};

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank plot recordings/crank.mcap -o plots            every figure, and plots/index.html with all of them
  flexcrank plot recordings/crank.mcap --from 1 --to 1.5 -o plots
  flexcrank plot before.mcap after.mcap --overlay -o plots
  flexcrank plot recordings/crank.mcap --y links.crank.chord_rad,links.rod.chord_rad -o angles.svg
  flexcrank plot recordings/crank.mcap --animation=0.25 -o crank.svg
  flexcrank plot turn.csv --x crank_angle_rad --y driving_torque_nm --title Torque -o torque.png
  flexcrank plot --thesis thesis-figures";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Recordings (.mcap) or tables (CSV).
    #[arg(required_unless_present = "thesis", value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Folder for the figures, with an index.html for recordings; or the file (.svg, .png) for a single figure.
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
    /// Draw from this simulated time on, s.
    #[arg(long, value_name = "S", value_parser = not_negative)]
    pub from: Option<f64>,
    /// Draw up to this simulated time, s.
    #[arg(long, value_name = "S", value_parser = not_negative)]
    pub to: Option<f64>,
    /// Lay the files over one another: a panel for each signal, a curve for each file.
    #[arg(long, conflicts_with = "animation")]
    pub overlay: bool,
    /// Animate the mechanism instead: one SVG that moves by itself, at most 10 s long; SPEED in recorded seconds per second.
    #[arg(long, value_name = "SPEED", num_args = 0..=1, require_equals = true, default_missing_value = "1", value_parser = playing_speed)]
    #[arg(conflicts_with_all = ["x", "y", "title"])]
    pub animation: Option<f64>,
    /// Compute and draw every figure of the thesis into this folder, with an index.html.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["files", "output", "x", "y", "title", "from", "to", "overlay", "animation"])]
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

    /// Whether the output is a file rather than a folder.
    fn into_file(&self) -> bool {
        self.output.extension().is_some() && !self.output.is_dir()
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
    #[error("--from {from} must be less than --to {to}")]
    Range { from: f64, to: f64 },
    #[error("--overlay needs two files or more")]
    Overlay,
}

/// A picture, the name of its file, and its place on the page.
struct Drawn {
    section: String,
    file: String,
    picture: Picture,
    sentence: String,
}

pub(super) fn plot(args: &Args) -> anyhow::Result<ExitStatus> {
    if let Some(folder) = &args.thesis {
        return write_thesis(folder, &args.formats());
    }
    if let (Some(from), Some(to)) = (args.from, args.to)
        && from >= to
    {
        return Err(BadPlot::Range { from, to }.into());
    }
    if args.overlay && args.files.len() < 2 {
        return Err(BadPlot::Overlay.into());
    }
    let range = TimeRange { from_s: args.from, to_s: args.to };
    let mut sources = args.files.iter().map(|file| Source::open(file, &range)).collect::<anyhow::Result<Vec<_>>>()?;
    let stems: BTreeSet<String> = sources.iter().map(|source| source.stem.clone()).collect();
    if args.overlay && stems.len() < sources.len() {
        sources.iter_mut().for_each(Source::name_by_path);
    }
    match args.animation {
        Some(speed) => write_animations(args, &sources, speed)?,
        None => write_figures(args, &sources)?,
    }
    Ok(if sources.iter().all(|source| source.whole) { ExitStatus::Success } else { ExitStatus::Lossy })
}

fn write_figures(args: &Args, sources: &[Source]) -> anyhow::Result<()> {
    let figures = if args.overlay { overlaid(args, sources)? } else { one_by_one(args, sources)? };
    if args.into_file() {
        let format = Format::of(&args.output).ok_or_else(|| BadPlot::Ending(args.output.clone()))?;
        let count = figures.len();
        let Ok([Drawn { picture, .. }]) = <[_; 1]>::try_from(figures) else {
            return Err(BadPlot::Several { file: args.output.clone(), figures: count }.into());
        };
        make_parent(&args.output)?;
        picture.write(&args.output, format)?;
        return print(&args.output);
    }
    let mut taken = BTreeSet::new();
    if let Some(twice) = figures.iter().find(|drawn| !taken.insert(&drawn.file)) {
        return Err(BadPlot::Twice(args.output.join(&twice.file)).into());
    }
    make_folder(&args.output)?;
    let mut entries = Vec::new();
    let recorded = sources.iter().filter(|source| source.recorded && args.y.is_empty());
    for source in recorded.clone() {
        if let Ok(strobe) = Strobe::new(&source.stem, source.displacements()) {
            let sentence = format!("{}.", strobe.caption);
            let file = format!("{}-strobe", source.stem);
            entries.push(write(args, Drawn { section: source.stem.clone(), file, picture: strobe.into(), sentence })?);
            entries.push(write_slow_animation(args, source)?);
        }
    }
    for drawn in figures {
        entries.push(write(args, drawn)?);
    }
    let facts: Vec<String> = recorded.map(Source::facts).collect();
    if facts.is_empty() {
        return Ok(());
    }
    // A section holds all pictures of its file.
    entries.sort_by_key(|entry| sources.iter().position(|source| source.stem == entry.section));
    let stems: Vec<&str> = sources.iter().map(|source| source.stem.as_str()).collect();
    let title = args.title.clone().unwrap_or_else(|| stems.join(", "));
    let page = args.output.join("index.html");
    let text = plot::page(&title, &format!("<ul>\n{}</ul>", facts.concat()), &entries);
    std::fs::write(&page, text).with_context(|| page.display().to_string())?;
    print(&page)
}

/// Writes a picture in all formats and prints the paths.
fn write(args: &Args, drawn: Drawn) -> anyhow::Result<Entry> {
    for format in args.formats() {
        let path = args.output.join(format!("{}.{}", drawn.file, format.extension()));
        drawn.picture.write(&path, format)?;
        print(&path)?;
    }
    Ok(Entry {
        section: drawn.section,
        number: String::new(),
        file: drawn.file,
        title: drawn.picture.title().to_owned(),
        sentence: drawn.sentence,
        endings: args.formats().into_iter().map(Format::extension).collect(),
    })
}

/// Writes the animation for the page, at a speed that can be followed.
fn write_slow_animation(args: &Args, source: &Source) -> anyhow::Result<Entry> {
    let speed = plot::speed_to_follow(source.displacements());
    let animation = plot::animation(&source.stem, source.displacements(), speed)?;
    let file = format!("{}-animation", source.stem);
    let path = args.output.join(format!("{file}.svg"));
    std::fs::write(&path, animation.svg).with_context(|| path.display().to_string())?;
    print(&path)?;
    let plot::Animation { magnified, recorded_s, .. } = animation;
    Ok(Entry {
        section: source.stem.clone(),
        number: String::new(),
        file,
        title: format!("{}: the mechanism, moving", source.stem),
        sentence: format!("{recorded_s:.2} s at {speed} of their speed, bending drawn {magnified} times as large."),
        endings: vec!["svg"],
    })
}

fn print(path: &Path) -> anyhow::Result<()> {
    Ok(writeln!(std::io::stdout(), "{}", path.display())?)
}

fn make_parent(path: &Path) -> anyhow::Result<()> {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).map_or(Ok(()), make_folder)
}

/// Animates each recording: into the one file named, or into a folder.
fn write_animations(args: &Args, sources: &[Source], speed: f64) -> anyhow::Result<()> {
    let output = &args.output;
    if args.into_file() && Format::of(output) != Some(Format::Svg) {
        return Err(BadPlot::NotSvg(output.clone()).into());
    }
    if args.into_file() && sources.len() > 1 {
        return Err(BadPlot::Several { file: output.clone(), figures: sources.len() }.into());
    }
    for source in sources {
        let animation = plot::animation(&source.stem, source.displacements(), speed)?;
        let path = if args.into_file() { output.clone() } else { output.join(format!("{}-animation.svg", source.stem)) };
        make_parent(&path)?;
        std::fs::write(&path, animation.svg).with_context(|| path.display().to_string())?;
        let plot::Animation { magnified, recorded_s, .. } = animation;
        writeln!(std::io::stdout(), "{} ({recorded_s:.2} s, bending drawn {magnified} times as large)", path.display())?;
    }
    Ok(())
}

/// The figures of every file.
fn one_by_one(args: &Args, sources: &[Source]) -> anyhow::Result<Vec<Drawn>> {
    let mut drawn = Vec::new();
    for source in sources {
        let figures = source.figures(args.x.as_deref(), &args.y)?;
        let one = figures.len() == 1;
        for (part, figure) in figures {
            let file = named(&source.stem, &part);
            drawn.push(entitled(args, figure, &source.stem, one, (source.stem.clone(), file)));
        }
    }
    Ok(drawn)
}

/// The figures of all files, laid over one another part by part.
fn overlaid(args: &Args, sources: &[Source]) -> anyhow::Result<Vec<Drawn>> {
    let mut parts: Vec<(String, Vec<(String, Figure)>)> = Vec::new();
    for source in sources {
        for (part, figure) in source.figures(args.x.as_deref(), &args.y)? {
            match parts.iter_mut().find(|(other, _)| *other == part) {
                Some((_, figures)) => figures.push((source.stem.clone(), figure)),
                None => parts.push((part, vec![(source.stem.clone(), figure)])),
            }
        }
    }
    let one = parts.len() == 1;
    let stems: Vec<&str> = sources.iter().map(|source| source.stem.as_str()).collect();
    let all = stems.join(", ");
    let draw = |(part, figures): (String, Vec<(String, Figure)>)| {
        let mut figure = plot::overlaid(&figures);
        if stems.contains(&figure.title.as_str()) {
            figure.title.clone_from(&all);
        }
        entitled(args, figure, &all, one, ("Overlaid".to_owned(), named("overlay", &part)))
    };
    Ok(parts.into_iter().map(draw).collect())
}

/// Name of a figure's file; a figure of the whole file has the file's name.
fn named(stem: &str, part: &str) -> String {
    if part.is_empty() { stem.to_owned() } else { format!("{stem}-{part}") }
}

/// A figure under the title that was asked for, if one was.
fn entitled(args: &Args, mut figure: Figure, place: &str, one: bool, (section, file): (String, String)) -> Drawn {
    if let Some(title) = &args.title {
        figure.title = if one || figure.title == place { title.clone() } else { format!("{title}: {}", figure.title) };
    }
    Drawn { section, file, picture: figure.into(), sentence: String::new() }
}
