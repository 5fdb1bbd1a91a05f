//! The files that `plot` draws: recordings and tables.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::acceleration_sampling::{ACCELERATION, rare_accelerations};
use super::campaign_table::without_failed_runs;
use super::failure::{CommandResult, Failure};
use super::sample_intervals::regular_s;
use super::sampled_deflection::MASSES;
use super::turning::{coarse_turning, first_chord};
use super::vibration_sampling::rare_samples;
use crate::plot::{self, Figure, Format, MechanismPicture, Named, PlotError};
use crate::recording::{RecordingError, RecordingMetadata, TopicColumns, begins_as_mcap, is_stamp_or_time, read_columns};
use crate::scene::{Drive, ModelKind, Scene, SceneSource, toml_hint};
use crate::shown::{shown_name, shown_s};
use crate::small_motion::{NormalMode, NormalModes, Part, Share, Subject};
use crate::study::Table;
use crate::study::trade::INTERRUPTED;
use crate::text_file;
use crate::wire::Topic;

/// The first bytes of a Parquet file.
const PARQUET: &[u8] = b"PAR1";
/// Natural frequencies that are looked at, and the ratio within which one is near another: they change with the crank's angle.
const MODES: usize = 12;
const NEAR: f64 = 1.5;
/// A link takes part in a vibration with more than this part of its strain energy.
const TAKES_PART: f64 = 0.01;
/// The column of the torque on the first link.
const DRIVING_TORQUE: &str = "driving_torque_nm";
/// The column of the resistance on the slider, which is constant or depends on the crank's angle alone.
const RESISTANCE: &str = "resistance_n";

/// A file and its numbers.
pub(super) struct Source {
    /// Its path.
    pub path: PathBuf,
    /// Its name in figures and in the names of their files: the file's name without ending.
    pub stem: String,
    /// Topics of a recording, without checkpoints, or the one table of a CSV file.
    pub tables: Vec<Named>,
    /// Whether it is a recording.
    pub recorded: bool,
    /// Whether it is complete.
    pub whole: bool,
    /// The table of an absent topic.
    none: Table,
}

impl Source {
    /// Reads a file, restricted to a range of time: simulated, or since a recording with resets began. `progress` is called with the
    /// part that is read.
    pub fn open(path: &Path, from_s: Option<f64>, to_s: Option<f64>, progress: &dyn Fn(f64)) -> CommandResult<Self> {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let recorded = has_extension_of_recordings(path) || begins_as_mcap(path);
        let picture = || picture_hint(path).filter(|_| !recorded);
        if let Some(hint) = toml_hint(path).or_else(picture).or_else(|| RecordingError::absent_scene_hint(path)) {
            return Err(Failure::Failed(format!("{}: neither a recording nor a table, but {hint}", path.display())));
        }
        let (mut tables, whole) = if recorded {
            recording(path, progress)?
        } else {
            (vec![Named { name: stem.clone(), table: csv_table(path)?, ..Named::default() }], true)
        };
        if from_s.or(to_s).is_some() {
            plot::cut(&path.display().to_string(), &mut tables, from_s, to_s)?;
        }
        Ok(Source { path: path.to_owned(), stem, tables, recorded, whole, none: Table::default() })
    }

    /// Whether its figures go by the time since it began: it is a recording with resets.
    pub fn has_session_time(&self) -> bool {
        plot::time_column(&self.tables) == plot::SESSION_TIME
    }

    /// Draws its figures over the time since it began, beside a recording with resets. Without resets, that is simulated time.
    pub fn go_by_session_time(&mut self) {
        if !self.has_session_time() {
            for topic in &mut self.tables {
                let times = topic.table.column(plot::SIMULATED_TIME).map(<[f64]>::to_vec);
                times.into_iter().for_each(|times| topic.table.push(plot::SESSION_TIME, times));
            }
        }
    }

    /// Number of folders in its path.
    pub fn depth(&self) -> usize {
        self.path.components().count().saturating_sub(1)
    }

    /// Its name with so many folders before it.
    pub fn stem_in(&self, folders: usize) -> String {
        let path = self.path.with_extension("");
        let parts: Vec<_> = path.components().map(|part| part.as_os_str().to_string_lossy()).collect();
        parts[parts.len().saturating_sub(1 + folders)..].join("/")
    }

    /// Its topic `displacements`; empty if there is none.
    fn displacements(&self) -> &Table {
        self.topic("displacements")
    }

    fn topic(&self, name: &str) -> &Table {
        let topic = self.tables.iter().find(|topic| topic.name.rsplit('/').next() == Some(name));
        topic.map_or(&self.none, |topic| &topic.table)
    }

    /// Sentences about motion that lines from sample to sample miss in the columns that are drawn. Without columns, everything is
    /// drawn; but an animation shows neither accelerations nor forces.
    pub fn missed_motion(&self, ys: &[String], is_animation: bool) -> Vec<String> {
        let [angles, displacements] = ["angles", "displacements"].map(|name| self.topic(name));
        let turning = self.coarse_turning(ys, is_animation);
        let is_drawn = |link: &str| {
            let what = (&*format!("nodes.{link}."), if link.starts_with(MASSES) { "x_m" } else { ".deflection_m" });
            self.draws_motion_of(displacements, what, ys)
        };
        let vibrations = rare_samples(displacements, is_drawn, |link, found_hz| self.natural_hz(link, found_hz));
        let draws_accelerations = !is_animation && self.draws_motion_of(angles, ("links.", ACCELERATION), ys);
        // The other sentences already say that curves of these samples are wrong, and name the rate to begin with.
        let is_coarse = regular_s(angles).and_then(|interval_s| coarse_turning(angles, interval_s)).is_some();
        let is_new = vibrations.is_empty() && !is_coarse;
        let accelerations = (draws_accelerations && is_new).then(|| rare_accelerations(angles)).flatten();
        let sentences: Vec<String> = turning.into_iter().chain(vibrations).chain(accelerations).collect();
        let is_what_if = !sentences.is_empty() && self.metadata().is_some_and(|metadata| metadata.is_what_if());
        let way = if is_what_if {
            "; this is a what-if: record its original so (with all, if their steps differ), and run `what-if` on that"
        } else {
            ""
        };
        sentences.into_iter().map(|sentence| format!("{}: {sentence}{way}", self.path.display())).collect()
    }

    /// The warning of an animation of it. If samples are too rare for a vibration, pictures are not judged by them.
    pub fn warning_of(&self, animation: &MechanismPicture) -> Option<String> {
        let is_judged = !animation.misses_vibration || rare_samples(self.displacements(), |_| true, |_, _| None).is_empty();
        animation.warning.clone().filter(|_| is_judged)
    }

    /// A sentence about a first link that turns far between samples that are drawn; `None` if it does not, or if only its angle,
    /// revolutions, times and a given torque are drawn: straight lines show even turning.
    fn coarse_turning(&self, ys: &[String], is_animation: bool) -> Option<String> {
        let angles = self.topic("angles");
        let is_first_chord = |name: &str| first_chord(angles).is_some_and(|(chord, _)| chord == name);
        let is_even = |name: &str| name.ends_with(".revolutions") || is_first_chord(name) || self.is_given_torque(name);
        let is_curved = |name: &str| !is_stamp_or_time(name) && !is_even(name);
        let names = ys.iter().filter_map(|given| self.column_name(given).ok());
        let names: Vec<&str> = names.filter(|&name| is_curved(name)).collect();
        let is_drawn = |topic: &&Table| ys.is_empty() || names.iter().any(|name| topic.column(name).is_some());
        let drawn = topics_of_motion(ys, is_animation).iter().map(|name| self.topic(name)).filter(is_drawn);
        coarse_turning(angles, drawn.filter_map(regular_s).reduce(f64::max)?)
    }

    /// Whether a sentence about samples of this topic applies to a column that is drawn: one with this beginning and ending, or a
    /// load that is not given. Loads vibrate with the links, but may be right where they have more samples than the topic.
    fn draws_motion_of(&self, topic: &Table, (beginning, ending): (&str, &str), ys: &[String]) -> bool {
        let loads = self.topic("loads");
        let are_loads_as_rare = regular_s(loads) >= regular_s(topic);
        let is_given = |name: &str| is_stamp_or_time(name) || name == RESISTANCE || self.is_given_torque(name);
        let is_load = |name: &str| are_loads_as_rare && loads.column(name).is_some() && !is_given(name);
        let is_meant = |name: &str| name.starts_with(beginning) && name.ends_with(ending) || is_load(name);
        ys.is_empty() || ys.iter().any(|given| self.column_name(given).is_ok_and(is_meant))
    }

    /// Whether a column is a torque that drives the mechanism, of which samples are exact means. The torque that a prescribed
    /// motion needs depends on accelerations.
    fn is_given_torque(&self, name: &str) -> bool {
        let is_driven_by_torque = || self.scene().is_some_and(|scene| matches!(scene.drive, Drive::Torque { .. }));
        name == DRIVING_TORQUE && is_driven_by_torque()
    }

    /// The facts and the scene of a recording.
    fn metadata(&self) -> Option<RecordingMetadata> {
        self.recorded.then(|| RecordingMetadata::read(&self.path))?.ok()
    }

    /// The scene of a recording, as it began.
    fn scene(&self) -> Option<Scene> {
        let text = self.metadata()?.scene?;
        Some(SceneSource::parse(&self.stem, &text, &[]).ok()?.scene)
    }

    /// The frequency of a vibration of a link that samples suggest, Hz: the same, or a natural frequency of the scene at rest with bending
    /// of the link if that is near and higher; or else the next above at which the link bends most. `None` where none is known.
    fn natural_hz(&self, link: &str, found_hz: f64) -> Option<f64> {
        let scene = self.scene()?;
        let start_rad = Subject::new(&scene, None).ok()?.start_rad().ok()?;
        let modes = NormalModes::new(&scene, start_rad, MODES).ok()?;
        let bends =
            |share: &Share| matches!(share.part, Part::Bending(bent) if bent.as_str() == link) && share.share > TAKES_PART;
        let vibrations = || modes.modes().iter().filter(|mode| mode.is_vibration());
        let is_near = |hz: &f64| (found_hz / NEAR..=found_hz * NEAR).contains(hz);
        let bending = vibrations().filter(|mode| mode.mode.shares.iter().any(bends)).map(NormalMode::frequency_hz);
        let apart = |hz: &f64| (hz / found_hz).ln().abs();
        if let Some(near_hz) = bending.filter(is_near).min_by(|one, other| apart(one).total_cmp(&apart(other))) {
            // What samples suggest is too low at times.
            return Some(near_hz.max(found_hz));
        }
        let mut above = vibrations().filter(|mode| mode.frequency_hz() > found_hz);
        above.find(|mode| mode.mode.shares.first().is_some_and(bends)).map(NormalMode::frequency_hz)
    }

    /// A sentence about the flexible links of a recording that are drawn straight, for want of nodes between their pins; `None` if
    /// there are none.
    pub fn straight_links(&self) -> Option<String> {
        let scene = self.scene()?;
        let has_node = |link: &str, node: u32| self.displacements().column(&format!("nodes.{link}.{node}.x_m")).is_some();
        let is_straight = |link: &str| has_node(link, 1) && !has_node(link, 2);
        // Links of other models are rigid, or one element each.
        let bends = matches!(scene.solver.model, ModelKind::Modal | ModelKind::FiniteElement);
        let flexible = scene.chain()?.links.iter().filter(|link| bends && !link.rigid).map(|link| link.name.as_str());
        let straight: Vec<&str> = flexible.filter(|&link| is_straight(link)).collect();
        let (file, links) = (self.path.display(), straight.join(" and "));
        let why = "there are no nodes between the pins; elements = 4 in the scene publishes some";
        (!straight.is_empty()).then(|| format!("{file}: no deflections of {links}: {why}"))
    }

    /// Its name in titles and legends. That of a part says so: `trade (interrupted study)`.
    pub fn label(&self) -> String {
        let part = if self.is_interrupted_study() { " (interrupted study)" } else { "" };
        format!("{}{part}", self.stem)
    }

    /// A sentence about a table of `trade` that is a part; `None` of any other file.
    pub fn interrupted_study(&self) -> Option<String> {
        let sentence = || format!("{}: a part of the configurations, because `trade` was interrupted", self.path.display());
        self.is_interrupted_study().then(sentence)
    }

    /// Whether it is a table of a `trade` that was interrupted.
    fn is_interrupted_study(&self) -> bool {
        let is_part = |table: &Table| table.column(INTERRUPTED).is_some() && plot::work_precision(table).is_some();
        !self.recorded && self.tables.first().is_some_and(|named| is_part(&named.table))
    }

    /// Its figures, each with the name of its part of the file. Their titles do not name the file.
    pub fn figures(&self, x: Option<&str>, ys: &[String]) -> Result<Vec<(String, Figure)>, PlotError> {
        self.drawn(x, ys).map_err(|refused| self.with_path(refused))
    }

    /// The full name of a column that may be given without the name of its list.
    pub fn column_name<'a>(&'a self, given: &'a str) -> Result<&'a str, PlotError> {
        plot::column_name(&self.tables, given).map_err(|refused| self.with_path(refused))
    }

    /// A refusal that names the file.
    fn with_path(&self, refused: PlotError) -> PlotError {
        match refused {
            PlotError::Request(why) => PlotError::Request(format!("{}: {why}", self.path.display())),
            refused => refused,
        }
    }

    fn drawn(&self, x: Option<&str>, ys: &[String]) -> Result<Vec<(String, Figure)>, PlotError> {
        if !ys.is_empty() {
            let is_over_time = self.recorded && x.is_none();
            let x = x.or_else(|| self.recorded.then(|| plot::time_column(&self.tables)));
            let mut figures = vec![(String::new(), plot::figure(&self.tables, x, ys)?)];
            if is_over_time {
                self.shade_levels(&mut figures);
            }
            return Ok(figures);
        }
        if self.recorded {
            let mut figures = plot::recorded(&self.tables);
            self.shade_levels(&mut figures);
            return Ok(figures);
        }
        let table = self.tables.first().map_or(&self.none, |named| &named.table);
        match plot::work_precision(table) {
            Some(figure) => Ok(vec![("work-precision".to_owned(), figure)]),
            None => plot::overview(table),
        }
    }

    fn shade_levels(&self, figures: &mut [(String, Figure)]) {
        let scene = self.scene();
        let best = scene.as_ref().and_then(|scene| scene.levels.first()).map(|level| level.name.as_str());
        plot::shade_levels(figures, &self.tables, best);
    }

    /// Name, time and origin of a recording, as an item of an HTML list.
    pub fn facts(&self) -> String {
        let name = plot::escape(&self.path.display().to_string());
        let time = plot::recorded_time(&self.tables)
            .map(|[first, last]| format!(", {} s to {} s", shown_s(first), shown_s(last)))
            .unwrap_or_default();
        let Ok(metadata) = RecordingMetadata::read(&self.path) else { return format!("<li><b>{name}</b>{time}</li>\n") };
        let [session, started, command] = ["name", "started", "command_line"].map(|key| plot::escape(metadata.fact(key)));
        let scene = plot::escape(&description(metadata.scene.as_deref().unwrap_or_default()));
        format!("<li><b>{name}</b>: {session}{time}. {scene}Recorded at {started} by <code>{command}</code></li>\n")
    }
}

/// The comment that a scene begins with, up to an empty line of it, as sentences before another one.
fn description(scene: &str) -> String {
    let comment = scene.lines().map_while(|line| line.strip_prefix('#')).map(str::trim).take_while(|line| !line.is_empty());
    let text = comment.collect::<Vec<_>>().join(" ");
    match text.chars().last() {
        None => text,
        Some('.' | '!' | '?' | ':') => text + " ",
        Some(_) => text + ". ",
    }
}

/// Topics whose samples of the motion may be drawn. Each may have a rate of its own.
fn topics_of_motion(ys: &[String], is_animation: bool) -> &'static [&'static str] {
    match (is_animation, ys.is_empty()) {
        (true, _) => &["displacements"],
        // Few samples of energies say nothing about paths and other curves.
        (false, true) => &["displacements", "angles", "loads"],
        (false, false) => &["displacements", "angles", "loads", "energies"],
    }
}

fn has_extension_of_recordings(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
}

/// The words for a picture that was given in place of its numbers.
fn picture_hint(path: &Path) -> Option<String> {
    let is_picture = path.is_file() && Format::of(path).is_some();
    is_picture.then(|| "a picture: name the file that it shows".to_owned())
}

/// Reads a CSV table, of which every column with contents has a name of its own. The refusal of a Parquet table names the commands that
/// draw it, or write CSV.
fn csv_table(path: &Path) -> CommandResult<Table> {
    let table = Table::read_csv(path).map_err(|refused| match begins_as_parquet(path) {
        true => Failure::Failed(format!(
            "{}: is a Parquet table, and `plot` reads CSV: `sweep --plot` draws a campaign; `sweep --merge --table NAME.csv` and \
             `export --csv` write CSV",
            path.display()
        )),
        false => refused.into(),
    })?;
    for (name, hint) in table.with_decimal_commas() {
        say!("warning: {}: column `{}` is taken for words: {hint}", path.display(), shown_name(name));
    }
    match repeated_name(&table) {
        Some(name) => {
            let (file, name) = (path.display(), shown_name(name));
            Err(Failure::Failed(format!("{file}: several columns have the name `{name}`: give each a name of its own")))
        }
        None => without_failed_runs(path, table),
    }
}

/// A name that several columns of a table have; those without contents do not count, as of empty columns beside the others.
fn repeated_name(table: &Table) -> Option<&str> {
    let has_numbers = |values: &[f64]| values.iter().any(|value| value.is_finite());
    let of_numbers = table.columns().filter(|(_, values)| has_numbers(values)).map(|(name, _)| name);
    let mut seen = BTreeSet::new();
    table.word_columns().map(|(name, _)| name).chain(of_numbers).find(|name| !name.is_empty() && !seen.insert(*name))
}

fn begins_as_parquet(path: &Path) -> bool {
    path.is_file() && text_file::beginning(path, PARQUET.len()).is_ok_and(|bytes| bytes.starts_with(PARQUET))
}

fn recording(file: &Path, progress: &dyn Fn(f64)) -> CommandResult<(Vec<Named>, bool)> {
    let contents = read_columns(file, progress)?;
    for topic in contents.skipped {
        say!("warning: {} is not protobuf and was left out", shown_name(&topic));
    }
    if contents.cut_off {
        say_reason!("warning: {} ends early (still being recorded, or cut off); everything before is drawn", file.display());
    }
    let named = |topic: TopicColumns| {
        let mut table = Table::default();
        topic.columns.into_iter().for_each(|(name, values)| table.push(name, values));
        Named { name: topic.name, table, texts: topic.texts }
    };
    // Checkpoints are states to resume from. Some of their fields have the names of signals: `work_in_j`.
    let is_drawn = |topic: &TopicColumns| Topic::of_key(&topic.name) != Some(Topic::Checkpoint);
    let mut topics: Vec<Named> = contents.topics.into_iter().filter(is_drawn).map(named).collect();
    plot::add_session_time(&mut topics);
    Ok((topics, !contents.cut_off))
}

#[cfg(test)]
mod tests {
    use super::description;

    #[test]
    fn regress_the_description_of_a_scene_is_the_comment_that_it_begins_with() {
        for (scene, said) in [
            ("# A press\n#  with a long rod\n#\n# Copied.\n[crank]", "A press with a long rod. "),
            ("# Pushed once.\n\n# Steel.\n[crank]", "Pushed once. "),
            ("[crank]\n# old value, wrong\nlength_m = 0.5", ""),
            ("", ""),
        ] {
            assert_eq!(description(scene), said);
        }
    }
}
