//! `plot`: figures from recordings and tables, and those of the thesis.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::{Path, PathBuf, is_separator};

use indexmap::IndexMap;

use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::{make_folder, must_have_folder};
use super::output::output;
use super::overlay::overlaid;
use super::overlay_places::names_here;
use super::plot_source::Source;
use super::progress::{bar, over_parts};
use super::thesis_figures::write_thesis;
use super::values::{finite, number, time};
use crate::plot::{self, Entry, Figure, Format, MechanismPicture};
use crate::whole_file::write_whole;

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank plot recordings/crank.mcap -o plots            every figure, and plots/index.html with all of them
  flexcrank plot recordings/crank.mcap --list              name them
  flexcrank plot recordings/crank.mcap --from 1 --to 1.5 -o plots
  flexcrank plot before.mcap after.mcap --overlay -o plots
  flexcrank plot recordings/crank.mcap --y links.crank.chord_rad,links.rod.chord_rad -o angles.svg
  flexcrank plot recordings/crank.mcap --x crank.chord_rad --y driving_torque_nm -o torque.svg
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
    pub format: Vec<Format>,
    /// Column of the horizontal axis. Default: a recording's time, as for --from; a table's stamp.sim_time_s, or else its first
    /// column of numbers. Columns of different topics are joined by simulated time.
    #[arg(long, value_name = "COLUMN", requires = "y")]
    pub x: Option<String>,
    /// Draw these columns in one figure instead: named as by export, with or without the name of the list.
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    pub y: Vec<String>,
    /// Title of the figures.
    #[arg(long)]
    pub title: Option<String>,
    /// Draw from this simulated time on; where a recording has resets, from this time since the recording began.
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub from: Option<f64>,
    /// Draw up to this time, counted as for --from.
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub to: Option<f64>,
    /// Lay the files over one another: a panel for each signal, a curve for each file.
    #[arg(long, conflicts_with_all = ["animation", "thesis"])]
    pub overlay: bool,
    /// Animate the mechanism instead: one SVG that moves by itself, at most 10 s long. SPEED is in recorded seconds per second;
    /// without it, the first turn takes two seconds or more.
    #[arg(long, value_name = "SPEED", num_args = 0..=1, require_equals = true, value_parser = playing_speed)]
    #[arg(conflicts_with_all = ["x", "y", "title"])]
    pub animation: Option<Option<f64>>,
    /// List the figures, by file name and title, and draw none.
    #[arg(long)]
    pub list: bool,
    /// Compute and draw every figure of the thesis into this folder, with an index.html.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["files", "output", "x", "y", "title", "from", "to", "overlay", "animation", "list"])]
    pub thesis: Option<PathBuf>,
}

fn playing_speed(text: &str) -> Result<f64, String> {
    number(text, 1e-3, 1e3)
}

pub(super) fn plot(args: &Args) -> CommandResult {
    if let Some(folder) = &args.thesis {
        return write_thesis(folder, &args.format);
    }
    if let (Some(from), Some(to)) = (args.from, args.to)
        && from >= to
    {
        return Err(refused(format!("--from {from} must be less than --to {to}")));
    }
    if let Some(speed) = args.files.iter().find(|file| is_speed(args, file)) {
        let given = speed.display();
        return Err(refused(format!("{given}: no such file; a speed follows an equals sign: --animation={given}")));
    }
    if args.overlay && args.files.len() < 2 {
        return Err(refused("--overlay needs two files or more".to_owned()));
    }
    let (bar, progress) = over_parts();
    let open = |(number, file): (usize, &PathBuf)| {
        Source::open(file, args.from, args.to, &|done| progress((number as f64 + done) / args.files.len() as f64))
    };
    let sources = args.files.iter().enumerate().map(open).collect::<CommandResult<Vec<_>>>();
    bar.finish_and_clear();
    let mut sources = sources?;
    if args.overlay && sources.iter().any(Source::has_session_time) {
        sources.iter_mut().for_each(Source::go_by_session_time);
    }
    let sentences = |source: &Source| {
        let straight_links = args.y.is_empty().then(|| source.straight_links()).flatten();
        let asked = args.y.iter().chain(&args.x);
        let columns: Vec<String> = match args.overlay {
            true => asked.flat_map(|given| names_here(&sources, source, given)).collect(),
            false => asked.cloned().collect(),
        };
        let missed_motion = source.missed_motion(&columns, args.animation.is_some());
        straight_links.into_iter().chain(source.interrupted_study()).chain(missed_motion)
    };
    let mut warnings: Vec<String> = sources.iter().flat_map(sentences).collect();
    tell_apart(&mut sources);
    let into_file = is_file_name(&args.output) && !args.output.is_dir();
    // The default figures of recordings come with pictures of the mechanism, and in a folder with a page.
    let default_figures = args.y.is_empty() && args.animation.is_none();
    // The warnings of animations, each with the names of its files.
    let (mut entries, mut of_animations) = (Vec::new(), IndexMap::<String, Vec<String>>::new());
    let mut collect_warning = |source: &Source, animation: &MechanismPicture| {
        if let Some(warning) = source.warning_of(animation) {
            of_animations.entry(warning).or_default().push(source.stem.clone());
        }
    };
    match args.animation {
        None => {
            let count = if args.overlay { sources.len() } else { 1 };
            for together in sources.chunks_mut(count) {
                let mut pictures: Vec<(&Source, &str, MechanismPicture)> = Vec::new();
                for source in together.iter().filter(|source| source.recorded && default_figures) {
                    // A scene without links has neither strobe figure nor animation, and a single position no animation.
                    let strobe = MechanismPicture::strobe(&source.stem, &source.tables);
                    let animation = MechanismPicture::animation(&source.stem, &source.tables, None);
                    animation.iter().for_each(|animation| collect_warning(source, animation));
                    pictures.extend(strobe.map(|strobe| (source, "strobe", strobe)));
                    pictures.extend(animation.map(|animation| (source, "animation", animation)));
                }
                MechanismPicture::magnify_alike(pictures.iter_mut().map(|(.., picture)| picture));
                entries.extend(pictures.into_iter().map(|(source, part, picture)| mechanism(source, part, picture)));
                entries.extend(figures(args, together)?);
            }
        }
        Some(speed) => {
            for source in &sources {
                let animation = MechanismPicture::animation(&source.stem, &source.tables, speed)?;
                collect_warning(source, &animation);
                entries.push(mechanism(source, "animation", animation));
            }
        }
    }
    if !args.list {
        warnings.extend(of_animations.into_iter().map(|(warning, stems)| format!("{}: {warning}", stems.join(", "))));
    }
    // A refusal comes without warnings.
    let in_file = (into_file && !args.list).then(|| sole_picture(args, &entries)).transpose()?;
    warnings.iter().for_each(|warning| say!("warning: {warning}"));
    if args.list {
        let width = entries.iter().map(|entry| entry.file.chars().count()).max().unwrap_or(0);
        let list = |entry: &Entry| writeln!(output(), "{:<width$}  {}", entry.file, entry.picture.title());
        entries.iter().try_for_each(list)?;
        return Ok(status(&sources));
    }
    if let Some((entry, format)) = in_file {
        entry.picture.write(&args.output, format)?;
        print(args, &args.output, entry)?;
        return Ok(status(&sources));
    }
    write_folder(args, &entries)?;
    let facts: Vec<String> = sources.iter().filter(|source| source.recorded && default_figures).map(Source::facts).collect();
    if !facts.is_empty() {
        let page = args.output.join("index.html");
        let title = args.title.clone().unwrap_or_else(|| stems(&sources));
        let text = plot::page(&title, &format!("<ul>\n{}</ul>", facts.concat()), &entries, &args.format);
        write_whole(&page, text.as_bytes()).map_err(Failure::file(&page))?;
        writeln!(output(), "{}", page.display())?;
    }
    Ok(status(&sources))
}

/// Whether a file is none, but the speed of an animation without its equals sign.
fn is_speed(args: &Args, file: &Path) -> bool {
    let is_number = file.to_str().is_some_and(|text| finite(text).is_some());
    args.animation == Some(None) && is_number && !file.exists()
}

/// Names of files in different folders begin with the folder, `before/take`, as far as that tells them apart; those of one file that is
/// given twice end in a number.
fn tell_apart(sources: &mut [Source]) {
    let distinct =
        |sources: &[Source]| sources.iter().map(|source| source.stem.as_str()).collect::<BTreeSet<_>>().len() == sources.len();
    let depth = sources.iter().map(Source::depth).max().unwrap_or(0);
    for folders in 1..=depth {
        if distinct(sources) {
            return;
        }
        sources.iter_mut().for_each(|source| source.stem = source.stem_in(folders));
    }
    if !distinct(sources) {
        sources.iter_mut().zip(1..).for_each(|(source, number)| source.stem = format!("{}-{number}", source.stem));
    }
}

fn status(sources: &[Source]) -> ExitStatus {
    if sources.iter().all(|source| source.whole) { ExitStatus::Success } else { ExitStatus::Lossy }
}

/// Whether a path names a file, not a folder: it has an ending, and none like that of `step0.5`.
fn is_file_name(path: &Path) -> bool {
    let ends_in_separator = path.to_string_lossy().ends_with(is_separator);
    let ending = path.extension().map(|ending| ending.to_string_lossy());
    !ends_in_separator && ending.is_some_and(|ending| !ending.starts_with(|first: char| first.is_ascii_digit()))
}

/// The request does not fit the files: a usage error.
fn refused(why: String) -> Failure {
    Failure::Usage(why)
}

/// The only figure, for the file that is to hold it, and its format there.
fn sole_picture<'a>(args: &Args, entries: &'a [Entry]) -> CommandResult<(&'a Entry, Format)> {
    let (path, name) = (&args.output, args.output.display());
    let Some(format) = Format::of(path) else {
        return Err(refused(format!("{name}: a picture ends in .svg or .png; for several, name a folder ({name}/)")));
    };
    let [entry] = entries else {
        let count = entries.len();
        let one = match (args.y.is_empty(), args.overlay) {
            (true, _) if args.animation.is_some() => "give one recording",
            (true, _) => "choose one figure with --y",
            (false, false) => "lay the files over one another with --overlay",
            (false, true) => "choose one horizontal axis with --x, a column that all files have",
        };
        return Err(refused(format!("{name} would hold {count} figures: name a folder with -o, or {one}")));
    };
    if entry.picture.formats(&[format]) != [format] {
        return Err(refused(format!("{name}: an animation ends in .svg")));
    }
    must_have_folder(path)?;
    Ok((entry, format))
}

fn write_folder(args: &Args, entries: &[Entry]) -> CommandResult<()> {
    let mut taken = BTreeSet::new();
    if let Some(twice) = entries.iter().find(|entry| !taken.insert(&entry.file)) {
        let path = args.output.join(&twice.file);
        let why =
            format!("two figures would be written to {}: plot these files one by one, into different folders", path.display());
        return Err(refused(why));
    }
    make_folder(&args.output)?;
    let progress = bar(entries.len() as u64, "{wide_bar} {pos}/{len} figures{left}");
    for entry in entries {
        let written = entry.write(&args.output, &args.format)?;
        progress.suspend(|| written.iter().try_for_each(|path| print(args, path, entry)))?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(())
}

fn mechanism(source: &Source, part: &str, picture: MechanismPicture) -> Entry {
    let file = format!("{}-{part}", file_name(&source.stem));
    let (section, sentence) = (source.stem.clone(), picture.caption());
    Entry { section, number: "", file, sentence, picture: Box::new(picture) }
}

/// Prints a path; the caption of an animation follows its path.
fn print(args: &Args, path: &Path, entry: &Entry) -> CommandResult<()> {
    let caption = if args.animation.is_some() { format!(" ({})", entry.sentence) } else { String::new() };
    Ok(writeln!(output(), "{}{caption}", path.display())?)
}

/// A file's name with folders before it, as the name of a file.
fn file_name(stem: &str) -> String {
    stem.replace('/', "-")
}

fn stems(sources: &[Source]) -> String {
    sources.iter().map(|source| source.stem.as_str()).collect::<Vec<_>>().join(", ")
}

/// The figures of files, laid over one another part by part if there are several files.
fn figures(args: &Args, sources: &mut [Source]) -> CommandResult<Vec<Entry>> {
    let (all, x) = (stems(sources), args.x.as_deref());
    let own_stems: Vec<String> = sources.iter().map(|source| source.stem.clone()).collect();
    let (parts, names, overlay) = match sources {
        [source] => (source.figures(x, &args.y)?, source.label(), false),
        several => (overlaid(several, x, &args.y)?, all.clone(), true),
    };
    let one = parts.len() == 1;
    let entry = |(part, mut figure): (String, Figure)| {
        let drawn: Vec<&str> =
            figure.files_drawn().into_iter().filter_map(|place| Some(own_stems.get(place)?.as_str())).collect();
        figure.title = match (&args.title, figure.title) {
            (None, words) if words.is_empty() && !drawn.is_empty() => drawn.join(", "),
            (None, words) if words.is_empty() => names.clone(),
            // The legend names files that lie over one another.
            (None, words) if overlay => words,
            (None, words) => format!("{words}: {names}"),
            (Some(title), words) if one || words.is_empty() => title.clone(),
            (Some(title), words) => format!("{title}: {words}"),
        };
        let stem = if overlay { "overlay".to_owned() } else { file_name(&all) };
        // A figure of the whole file has the file's name.
        let file = if part.is_empty() { stem } else { format!("{stem}-{part}") };
        Entry { section: all.clone(), number: "", file, sentence: String::new(), picture: Box::new(figure) }
    };
    Ok(parts.into_iter().map(entry).collect())
}
