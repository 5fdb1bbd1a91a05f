//! The specification of a campaign: a TOML file, validated once.

use std::fmt;
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};

use serde::de::{self, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};
use toml_edit::Document;

use super::axis::{Axis, Levels};
use super::misread::{at_line, misread};
use super::sobol;
use crate::recording::begins_as_mcap;
use crate::scene::builtin;
use crate::shown::Shown;
use crate::text_file;

/// Size limit of a specification, bytes.
const SIZE_LIMIT: usize = 1024 * 1024;
/// Most runs of a campaign.
const MOST_RUNS: u64 = 1_000_000_000;
/// Most keys that vary in a campaign: a Sobol design takes two dimensions of each.
const MOST_KEYS: usize = sobol::DIMENSIONS / 2;
/// Most chunks of a campaign.
const MOST_CHUNKS: u64 = 1_000_000;
/// Step limit of a run unless the specification sets one.
const MOST_STEPS: u64 = 10_000_000;

/// A specification was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {}", Shown(place, 300), Shown(problem, 2000))]
pub struct SpecError {
    place: String,
    problem: String,
}

impl SpecError {
    /// A refusal of the specification at `place`.
    pub(super) fn new(place: &str, problem: String) -> Self {
        SpecError { place: place.to_owned(), problem }
    }

    /// The refusal of a scene in place of a specification.
    fn scene(name: &str) -> Self {
        let problem = format!(
            "is a scene, not a campaign: `flexcrank run {name}` runs it; `flexcrank files sweep.toml` prints a campaign, whose \
             `scene` names one"
        );
        SpecError::new(name, problem)
    }

    /// The refusal of a recording in place of a specification.
    fn recording(name: &str) -> Self {
        let problem = format!(
            "is a recording, not a campaign: `flexcrank replay {name}` plays it; `flexcrank files sweep.toml` prints a campaign"
        );
        SpecError::new(name, problem)
    }
}

/// The choice of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Every combination of the values.
    Grid,
    /// Independent random values.
    Random,
    /// One value in each of as many equal intervals as there are samples, for every key.
    LatinHypercube,
    /// Saltelli's design on a Sobol sequence, from which sensitivity indices follow.
    Sobol,
}

/// A campaign as its file describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Spec {
    /// Built-in scene, or scene file.
    pub scene: String,
    /// `KEY=VALUE` changes of every run.
    pub set: Vec<String>,
    /// Pulses added to the scene's own, as TOML.
    pub pulses: String,
    /// Simulated time from which scalars are taken, s.
    pub from_s: f64,
    /// Simulated time of each run, s.
    pub until_s: f64,
    /// Most steps of a run.
    pub max_steps: u64,
    /// The choice of samples.
    pub method: Method,
    /// Number of samples; of a grid, its size.
    pub samples: u64,
    /// Seed of random choices.
    pub seed: u64,
    /// Runs of a chunk: the work that a worker claims at a time.
    pub chunk: u64,
    /// The keys that vary.
    pub axes: Vec<Axis>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSpec {
    scene: String,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default)]
    from_s: f64,
    until_s: f64,
    max_steps: Option<NonZeroU64>,
    method: Method,
    samples: Option<NonZeroU64>,
    #[serde(default)]
    seed: u64,
    chunk: Option<NonZeroU64>,
    vary: Vec<RawAxis>,
    #[serde(default)]
    pulse: Vec<toml::Table>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAxis {
    key: String,
    min: Option<f64>,
    max: Option<f64>,
    #[serde(default)]
    log: bool,
    count: Option<GridCount>,
    values: Option<Vec<toml::Value>>,
}

impl Spec {
    /// Reads and validates a file. A scene file named in it is looked for beside it.
    ///
    /// # Errors
    /// [`SpecError`] if it cannot be read, or anything in it is refused.
    pub fn open(path: &Path) -> Result<Self, SpecError> {
        let place = path.display().to_string();
        if begins_as_mcap(path) {
            return Err(SpecError::recording(&place));
        }
        let text = text_file::read(path, SIZE_LIMIT).map_err(|cause| match builtin::find(&place) {
            Ok(_) => SpecError::scene(&place),
            Err(_) => SpecError::new(&place, format!("cannot be read: {cause}")),
        })?;
        let mut spec = Self::parse(&place, &text)?;
        let beside = path.parent().unwrap_or(Path::new("")).join(&spec.scene);
        if builtin::find(&spec.scene).is_err() && beside.is_file() {
            spec.scene = beside.display().to_string();
        }
        Ok(spec)
    }

    /// Validates `text`; `origin` names it in errors.
    ///
    /// # Errors
    /// [`SpecError`] if anything in it is refused.
    pub fn parse(origin: &str, text: &str) -> Result<Self, SpecError> {
        if toml::from_str::<toml::Table>(text).is_ok_and(|table| is_scene(&table)) {
            return Err(SpecError::scene(origin));
        }
        let raw: RawSpec = toml::from_str(text).map_err(|error| misread(origin, text, &error))?;
        raw.validate().map_err(|refused| SpecError { place: refused.place(origin, text), problem: refused.problem })
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        match self.method {
            Method::Sobol => self.samples * (self.axes.len() as u64 + 2),
            Method::Grid | Method::Random | Method::LatinHypercube => self.samples,
        }
    }

    /// The folder of a campaign unless another is named: `NAME.sweep` beside the specification.
    pub fn usual_folder(path: &Path) -> PathBuf {
        path.with_extension("sweep")
    }
}

/// Whether a table has a mechanism or its solver, as a scene has and no campaign.
fn is_scene(table: &toml::Table) -> bool {
    let has = |key: &str| table.contains_key(key);
    ["crank", "beam", "oscillator", "solver"].into_iter().any(has) && !has("vary")
}

/// A refusal of the whole specification, or of a key that varies.
struct Refused {
    /// Place of the key among those that vary.
    axis: Option<usize>,
    problem: String,
}

impl From<String> for Refused {
    fn from(problem: String) -> Self {
        Refused { axis: None, problem }
    }
}

impl Refused {
    fn of_axis(place: usize, key: &str, problem: &str) -> Self {
        Refused { axis: Some(place), problem: format!("vary.{place} ({}): {problem}", Shown(key, 100)) }
    }

    /// The origin, with the line of the key's table.
    fn place(&self, origin: &str, text: &str) -> String {
        let begin = |axis: usize| Some(Document::parse(text).ok()?.as_item().get("vary")?.get(axis)?.span()?.start);
        self.axis.and_then(begin).map_or(origin.to_owned(), |byte| at_line(origin, text, byte))
    }
}

impl RawSpec {
    fn validate(self) -> Result<Spec, Refused> {
        if !(self.until_s > 0.0 && self.until_s <= 1e9) {
            return Err(format!("until_s = {:?}: must be a time above 0, at most 1e9 s", self.until_s).into());
        }
        if !(self.from_s >= 0.0 && self.from_s < self.until_s) {
            return Err(
                format!("from_s = {:?}: must be a time from 0 on, before until_s = {:?}", self.from_s, self.until_s).into()
            );
        }
        if self.vary.is_empty() || self.vary.len() > MOST_KEYS {
            return Err(format!("vary: 1 to {MOST_KEYS} keys vary, each in a table [[vary]]").into());
        }
        let is_grid = self.method == Method::Grid;
        if is_grid && self.samples.is_some() {
            return Err("samples: a grid has as many as its values make; give each [[vary]] a count instead".to_owned().into());
        }
        let axis = |(place, axis): (usize, &RawAxis)| {
            axis.validate(is_grid).map_err(|problem| Refused::of_axis(place, &axis.key, &problem))
        };
        let axes = self.vary.iter().enumerate().map(axis).collect::<Result<Vec<_>, _>>()?;
        if let Some((place, axis)) =
            axes.iter().enumerate().find(|(place, axis)| axes[..*place].iter().any(|other| other.key == axis.key))
        {
            return Err(Refused::of_axis(place, &axis.key, "varies already"));
        }
        let samples = samples(self.samples, is_grid, &axes)?;
        let mut spec = Spec {
            pulses: pulses(&self.pulse)?,
            scene: self.scene,
            set: self.set,
            from_s: self.from_s,
            until_s: self.until_s,
            max_steps: self.max_steps.map_or(MOST_STEPS, NonZeroU64::get),
            method: self.method,
            samples,
            seed: self.seed,
            chunk: 1,
            axes,
        };
        let runs = samples.checked_mul(spec.axes.len() as u64 + 2).map_or(u64::MAX, |_| spec.runs());
        if runs > MOST_RUNS {
            return Err(format!("a campaign has at most {MOST_RUNS} runs").into());
        }
        // Some two thousand files at most: enough to share, few enough for any file system.
        let usual = runs.div_ceil(2048).next_power_of_two();
        spec.chunk = self.chunk.map_or(usual, NonZeroU64::get).clamp(runs.div_ceil(MOST_CHUNKS), MOST_RUNS);
        Ok(spec)
    }
}

/// The number of samples; that of a grid follows from its axes.
fn samples(given: Option<NonZeroU64>, is_grid: bool, axes: &[Axis]) -> Result<u64, String> {
    match (given, is_grid) {
        (_, true) => Ok(axes.iter().fold(1, |product: u64, axis| product.saturating_mul(axis.grid_count()))),
        (None, false) => Err("samples: is missing; it is a whole number from 1".to_owned()),
        (Some(samples), false) => Ok(samples.get()),
    }
}

/// The pulses as tables of a scene.
fn pulses(pulses: &[toml::Table]) -> Result<String, String> {
    let table = |pulse| toml::to_string(pulse).map(|keys| format!("\n[[pulse]]\n{keys}"));
    pulses.iter().map(table).collect::<Result<_, _>>().map_err(|error| format!("pulse: {error}"))
}

/// The number of values of a range on a grid, both bounds included.
#[derive(Debug, Clone, Copy)]
struct GridCount(u64);

impl<'de> Deserialize<'de> for GridCount {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct FromTwo;
        impl Visitor<'_> for FromTwo {
            type Value = GridCount;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("a whole number from 2")
            }

            fn visit_i64<E: de::Error>(self, count: i64) -> Result<GridCount, E> {
                let refuse = || E::invalid_value(Unexpected::Signed(count), &self);
                u64::try_from(count).ok().filter(|count| *count >= 2).map(GridCount).ok_or_else(refuse)
            }
        }
        deserializer.deserialize_i64(FromTwo)
    }
}

impl RawAxis {
    fn validate(&self, is_grid: bool) -> Result<Axis, String> {
        let refuse = |problem: &str| Err(problem.to_owned());
        if self.key.is_empty() || self.key.contains(|c: char| c == '=' || c.is_whitespace() || c.is_control()) {
            return refuse("key must be a key of the scene, such as rod.length_m or pulse.0.torque_nm");
        }
        let levels = match (self.min, self.max, &self.values) {
            (None, None, Some(values)) if self.count.is_none() && !self.log => {
                if values.is_empty() {
                    return refuse("values must not be empty");
                }
                Levels::Listed(values.clone())
            }
            (Some(min), Some(max), None) => {
                if !(min.is_finite() && max.is_finite() && min < max) {
                    return refuse(&format!("min = {min:?}, max = {max:?}: min must be a number below max"));
                }
                if self.log && min <= 0.0 {
                    return refuse(&format!("min = {min:?}: log needs a min above 0"));
                }
                let count = match (self.count, is_grid) {
                    (Some(GridCount(count)), true) => count,
                    (None, true) => return refuse("on a grid, count must be a whole number from 2"),
                    (None, false) => 0,
                    (Some(_), false) => return refuse("count is for method \"grid\""),
                };
                Levels::Range { min, max, log: self.log, count }
            }
            _ => return refuse("give min and max, with log = true or count where needed; or values alone"),
        };
        Ok(Axis { key: self.key.clone(), levels })
    }
}

#[cfg(test)]
mod tests {
    use super::Spec;

    const RANDOM: &str = "scene = \"crank-slider\"\nuntil_s = 0.1\nmethod = \"random\"\nsamples = 4\n";
    const VARY: &str = "[[vary]]\nkey = \"slider.mass_kg\"\nmin = 1.0\nmax = 2.0\n";

    #[test]
    fn regress_text_without_quotes_and_lists_without_brackets_are_refused_with_what_to_write() {
        let campaign = "scene = \"crank-slider\"\nuntil_s = 0.1\nmethod = \"grid\"\n\
                        [[vary]]\nkey = \"slider.mass_kg\"\nvalues = [1.0]\n";
        for (was, is, said) in [
            ("\"crank-slider\"", "film-cutter.toml", "1: not TOML: scene: text must be quoted: \"film-cutter.toml\""),
            ("\"crank-slider\"", "thesis-crank-slider", "1: not TOML: scene: text must be quoted: \"thesis-crank-slider\""),
            ("until_s = 0.1", "set = [model=rigid]", "2: not TOML: set: text must be quoted: \"model=rigid\""),
            ("until_s = 0.1", "until_s = 0.1 s", "2: not TOML: `0.1 s`: write the number alone, as its key names the unit"),
            ("\"grid\"", "full", "3: not TOML: method: text must be quoted: \"full\""),
            ("method = \"grid\"", "until_s = 2", "3: not TOML: until_s is there twice"),
            ("[1.0]", "1.0, 1.2", "6: not TOML: values: a list stands in brackets: [1.0, 1.2]"),
            ("[1.0]", "1,5", "6: not TOML: a number has a decimal point, not a comma: 1.5"),
            ("[1.0]", "12,000,000", "6: not TOML: a number has no commas: 12_000_000 or 1.2e7"),
        ] {
            let refused = Spec::parse("test", &campaign.replace(was, is)).err().map(|refused| refused.to_string());
            assert_eq!(refused, Some(format!("test:{said}")));
        }
    }

    #[test]
    fn regress_a_key_of_an_axis_outside_of_it_is_refused_with_its_place() {
        let said = |text: &str| Spec::parse("test", text).err().map(|refused| refused.to_string()).unwrap_or_default();
        let refused = said(&format!("{RANDOM}log = true\n{VARY}"));
        assert!(refused.starts_with("test:5: log: unknown key") && refused.ends_with("; it is a key of [[vary]]"), "{refused}");
        assert!(!said(&format!("{RANDOM}{VARY}samples = 3\n")).contains("it is a key of"));
        assert_eq!(said(&format!("{RANDOM}{VARY}log = true\n")), "");
    }

    /// `samples = 20.5` was to be a whole number from 0, which was refused then, and `max_steps = 0` was read as 1.
    #[test]
    fn regress_whole_numbers_are_refused_with_their_own_least_values() {
        for (was, is, said) in [
            ("samples = 4", "samples = 20.5", "4: samples = 20.5: must be a whole number from 1"),
            ("samples = 4", "samples = 0", "4: samples = 0: must be a whole number from 1"),
            ("samples = 4", "samples = -3", "4: samples = -3: must be a whole number from 1"),
            ("samples = 4", "samples = 4\nmax_steps = 0", "5: max_steps = 0: must be a whole number from 1"),
            ("samples = 4", "samples = 4\nchunk = 0", "5: chunk = 0: must be a whole number from 1"),
            ("samples = 4", "samples = 4\nseed = -1", "5: seed = -1: must be a whole number from 0"),
            ("max = 2.0", "max = 2.0\ncount = 1", "9: count = 1: must be a whole number from 2"),
        ] {
            let refused = Spec::parse("test", &format!("{RANDOM}{VARY}").replace(was, is)).err().map(|error| error.to_string());
            assert_eq!(refused, Some(format!("test:{said}")));
        }
    }
}
