//! A campaign: the specification with its scene, and the scene and identity of each run.

use std::path::Path;

use sha2::{Digest as _, Sha256};
use toml_edit::{DocumentMut, Item};

use super::SweepError;
use super::axis::{Axis, Levels, Value};
use super::run::{Column, Limits, Outcome, columns, run};
use super::sampling;
use super::spec::{Method, Spec, SpecError};
use crate::scene::{SceneError, SceneSource};

/// Samples that are tried before a campaign begins.
const TRIED: u64 = 16;
/// Values of a list that are tried before a campaign begins.
const TRIED_VALUES: usize = 100;

/// A campaign, ready to run.
pub struct Campaign {
    spec: Spec,
    base: SceneSource,
    columns: Vec<Column>,
    /// The part of every identity that all runs share.
    shared: Sha256,
}

/// A listed value, or a bound, that its key never allows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedValue {
    /// Key, value and the reason.
    pub reason: String,
    /// The runs that will be refused.
    pub runs: RefusedRuns,
}

/// The runs that a refused value concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RefusedRuns {
    /// The number of runs with this value, of a grid.
    Counted(u64),
    /// Those with this value.
    WithValue,
    /// Those between the bounds that the key does not allow.
    BetweenBounds,
}

/// The values of a run, and its identity.
pub(super) struct Sample {
    pub index: u64,
    pub values: Vec<Value>,
    /// SHA-256, in hexadecimal.
    pub id: String,
}

impl Campaign {
    /// Reads a specification and its scene.
    ///
    /// # Errors
    /// [`SweepError`] if either is refused, or if the scene refuses every sample of a few.
    pub fn open(path: &Path) -> Result<Self, SweepError> {
        Self::new(&path.display().to_string(), Spec::open(path)?)
    }

    /// The campaign of a specification; `origin` names it in errors.
    ///
    /// # Errors
    /// [`SweepError`] if the scene is refused, or if it refuses every sample of a few.
    pub fn new(origin: &str, spec: Spec) -> Result<Self, SweepError> {
        let mut base = SceneSource::open(&spec.scene, &spec.set)
            .map_err(|refused| SpecError::new(origin, refusal_of_all(&spec, &refused)))?;
        if !spec.pulses.is_empty() {
            let origin = format!("pulses of {origin} in {}", spec.scene);
            base = SceneSource::parse(&origin, &format!("{}\n{}", with_pulses_as_tables(&base.text), spec.pulses), &[])?;
        }
        let shared = Sha256::new()
            .chain_update(concat!("flexcrank ", env!("CARGO_PKG_VERSION"), " sweep 1\n"))
            .chain_update(format!("until_s={:?}\nmax_steps={}\n", spec.until_s, spec.max_steps))
            // Rows of campaigns without it keep their ids.
            .chain_update(if spec.from_s > 0.0 { format!("from_s={:?}\n", spec.from_s) } else { String::new() })
            .chain_update(&base.text);
        let mut campaign = Campaign { columns: columns(&base.scene), spec, base, shared };
        // Values that vary may give an open chain its end.
        if let Some(accepted) = campaign.first_accepted().map_err(|problem| SpecError::new(origin, problem))? {
            campaign.columns = columns(&accepted.scene);
        }
        Ok(campaign)
    }

    /// The first scene that is accepted, of those of a few samples; `None` without samples.
    ///
    /// # Errors
    /// A refusal, if all are refused, as a misspelt key is: better now than in a table of refusals.
    fn first_accepted(&self) -> Result<Option<SceneSource>, String> {
        let tried = TRIED.min(self.runs());
        let mut first = None;
        for place in 0..tried {
            let index = (u128::from(place) * u128::from(self.runs()) / u128::from(tried)) as u64;
            let values = sampling::values(&self.spec, index);
            match self.scene(&values) {
                Ok(accepted) => return Ok(Some(accepted)),
                Err(refused) => first = first.or(Some((values, refused))),
            }
        }
        first.map_or(Ok(None), |(values, refused)| Err(self.refusal(&values, &refused)))
    }

    /// The refusal of a sample in the words of the specification.
    fn refusal(&self, values: &[Value], refused: &SceneError) -> String {
        match culprit(&self.base, &self.overrides(values), refused) {
            Some(place) => {
                let key = &self.spec.axes[place].key;
                let hints = [self.range_hint(refused), list_hint(key, refused)].concat();
                format!("vary.{place}.key = {key:?}: {}{hints}", reason(refused))
            }
            None => format!("the scene refuses every sample that was tried: {refused}"),
        }
    }

    /// A hint at the list to write in place of a range whose value a key refused because it is not whole; else nothing.
    fn range_hint(&self, refused: &SceneError) -> &'static str {
        let is_of_range = |axis: &Axis| axis.key == refused.key && matches!(axis.levels, Levels::Range { .. });
        let is_whole = refused.value.as_deref().is_some_and(|value| value.parse::<i64>().is_ok());
        let hints = refused.problem.starts_with("must be a whole number") && !is_whole;
        if hints && self.spec.axes.iter().any(is_of_range) { "; ranges are of real numbers: list values = [2, 4, 6]" } else { "" }
    }

    /// The listed values and bounds that their keys never allow, whatever the other keys are.
    pub fn refused_values(&self) -> Vec<RefusedValue> {
        self.spec.axes.iter().flat_map(|axis| self.refused_values_of(axis)).collect()
    }

    fn refused_values_of(&self, axis: &Axis) -> Vec<RefusedValue> {
        let runs = match (&axis.levels, self.spec.method) {
            (Levels::Listed(_), Method::Grid) => RefusedRuns::Counted(self.runs() / axis.grid_count()),
            (Levels::Listed(_), _) => RefusedRuns::WithValue,
            // A bound may be no value of any run.
            (Levels::Range { .. }, _) => RefusedRuns::BetweenBounds,
        };
        let refused = |with_value: Result<SceneSource, SceneError>| {
            let refused = with_value.err()?;
            let own = refused.all().find(|refused| refused.never_allowed && refused.key == axis.key)?;
            Some(RefusedValue { reason: reason(own) + self.range_hint(own), runs })
        };
        self.with_given_values(axis).filter_map(refused).collect()
    }

    /// The scene with each listed value of a key alone, or with each bound of its range. Of a long list, the first values are tried.
    pub fn with_given_values(&self, axis: &Axis) -> impl Iterator<Item = Result<SceneSource, SceneError>> {
        let values: Vec<Value> = match &axis.levels {
            Levels::Listed(values) => values.iter().take(TRIED_VALUES).cloned().map(Value::Listed).collect(),
            Levels::Range { min, max, .. } => [*min, *max].map(Value::Number).to_vec(),
        };
        values.into_iter().map(move |value| self.base.with(&[format!("{}={}", axis.key, value.toml())]))
    }

    /// The specification.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// The columns of numbers that every run leaves.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        self.spec.runs()
    }

    /// Number of chunks.
    pub(super) fn chunks(&self) -> u64 {
        self.runs().div_ceil(self.spec.chunk)
    }

    /// The samples of a chunk.
    pub(super) fn samples(&self, chunk: u64) -> impl Iterator<Item = Sample> {
        let first = chunk * self.spec.chunk;
        (first..(first + self.spec.chunk).min(self.runs())).map(|index| self.sample(index))
    }

    fn sample(&self, index: u64) -> Sample {
        let values = sampling::values(&self.spec, index);
        // The scene in force follows from the shared text and these changes, and from nothing else.
        let hash =
            self.overrides(&values).iter().fold(self.shared.clone(), |hash, change| hash.chain_update("\n").chain_update(change));
        Sample { index, values, id: format!("{:x}", hash.finalize()) }
    }

    fn overrides(&self, values: &[Value]) -> Vec<String> {
        self.spec.axes.iter().zip(values).map(|(axis, value)| format!("{}={}", axis.key, value.toml())).collect()
    }

    /// The scene of a run.
    ///
    /// # Errors
    /// [`SceneError`] if it refuses the values of the run.
    pub fn scene_of(&self, run: u64) -> Result<SceneSource, SceneError> {
        self.scene(&sampling::values(&self.spec, run))
    }

    fn scene(&self, values: &[Value]) -> Result<SceneSource, SceneError> {
        self.base.with(&self.overrides(values))
    }

    /// Runs a sample; `None` if `stop` asked for an end before.
    pub(super) fn run(&self, sample: &Sample, stop: &dyn Fn() -> bool) -> Option<Outcome> {
        let limits = Limits { from_s: self.spec.from_s, until_s: self.spec.until_s, max_steps: self.spec.max_steps };
        // The values of a sample stand in the specification, not on the command line.
        let in_spec = |mut refused: SceneError| {
            let hint = self.range_hint(&refused);
            refused.problem.push_str(hint);
            match refused.place.starts_with("--set ") {
                true => SceneError { place: "vary".to_owned(), ..refused },
                false => refused,
            }
        };
        run(|| self.scene(&sample.values).map_err(in_spec), limits, self.columns.len(), stop)
    }
}

/// The refusal of the scene, or of a change of every run, in the words of the specification.
fn refusal_of_all(spec: &Spec, refused: &SceneError) -> String {
    let changed = SceneSource::open(&spec.scene, &[]).ok().and_then(|base| culprit(&base, &spec.set, refused));
    let is_whole = refused.place == spec.scene && refused.key.is_empty();
    match changed {
        Some(place) => format!("set {:?}: {}", spec.set[place], reason(refused)),
        None if is_whole => format!("scene = {:?}: {}", spec.scene, refused.problem),
        None if refused.place.starts_with("--set ") => format!("set {:?}: {}", &refused.place[6..], reason(refused)),
        None => format!("scene: {refused}"),
    }
}

/// The text of a scene whose pulses, if they are a list in one value, are tables, so that further ones can follow.
fn with_pulses_as_tables(text: &str) -> String {
    let Ok(mut scene) = text.parse::<DocumentMut>() else { return text.to_owned() };
    if scene.get("pulse").is_none_or(Item::is_array_of_tables) {
        return text.to_owned();
    }
    if let Some(Ok(pulses)) = scene.remove("pulse").map(Item::into_array_of_tables) {
        scene.insert("pulse", Item::ArrayOfTables(pulses));
    }
    scene.to_string()
}

/// The place of the change that the scene refuses by itself for the same reason as all together.
fn culprit(base: &SceneSource, changes: &[String], refused: &SceneError) -> Option<usize> {
    changes.iter().position(|change| {
        let alone = base.with(std::slice::from_ref(change));
        alone.is_err_and(|alone| alone.all().any(|alone| alone.problem == refused.problem))
    })
}

/// A hint at the place of a list in a campaign whose entries a key misses; else nothing.
fn list_hint(key: &str, refused: &SceneError) -> &'static str {
    match refused.problem.contains("has no entries") {
        true if key.starts_with("pulse.") => " in the campaign's `set`, or its pulses in [[pulse]] tables",
        true => " in the campaign's `set`",
        false => "",
    }
}

/// The reason of a refusal; an unknown key stands before it already.
fn reason(refused: &SceneError) -> String {
    let SceneError { key, value, problem, .. } = refused;
    match value {
        _ if key.is_empty() || problem.starts_with("unknown key") => problem.clone(),
        Some(value) => format!("{key} = {value}: {problem}"),
        None => format!("{key}: {problem}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Campaign, Spec};
    use crate::study::sweep::Ending;

    /// Whole numbers of a range were given as 2.0, which keys of counts refuse.
    #[test]
    fn regress_a_range_of_whole_numbers_suits_keys_of_counts() -> Result<(), Box<dyn std::error::Error>> {
        let campaign = |count: u64| {
            let set = "set = [\"solver.model=finite-element\"]\nuntil_s = 0.004\nmethod = \"grid\"\n";
            let axis = format!("[[vary]]\nkey = \"crank.elements\"\nmin = 2\nmax = 4\ncount = {count}\n");
            Campaign::new("test", Spec::parse("test", &format!("scene = \"crank-slider\"\n{set}{axis}"))?)
        };
        let whole = campaign(3)?;
        assert_eq!(whole.refused_values(), []);
        for run in 0..3 {
            let outcome = whole.run(&whole.sample(run), &|| false).ok_or("no outcome")?;
            assert_eq!((outcome.ending, outcome.cause.as_str()), (Ending::Done, ""), "{} elements", run + 2);
        }
        let halves = campaign(5)?;
        let outcome = halves.run(&halves.sample(1), &|| false).ok_or("no outcome")?;
        let why = "vary: crank.elements = 2.5: must be a whole number; ranges are of real numbers: list values = [2, 4, 6]";
        assert_eq!((outcome.ending, outcome.cause.as_str()), (Ending::Refused, why));
        Ok(())
    }

    #[test]
    fn regress_a_range_without_whole_numbers_names_the_list_to_write() -> Result<(), Box<dyn std::error::Error>> {
        let axis = "[[vary]]\nkey = \"crank.elements\"\nmin = 2.1\nmax = 2.9\n";
        let text = format!("scene = \"crank-slider\"\nuntil_s = 0.004\nmethod = \"random\"\nsamples = 4\n{axis}");
        let refused = Campaign::new("test", Spec::parse("test", &text)?).err().ok_or("accepted")?.to_string();
        assert!(refused.starts_with("test: vary.0.key = \"crank.elements\": crank.elements = 2."), "{refused}");
        let hint = ": must be a whole number; ranges are of real numbers: list values = [2, 4, 6]";
        assert!(refused.ends_with(hint), "{refused}");
        Ok(())
    }

    /// `--set` was recommended, which `sweep` does not have.
    #[test]
    fn regress_a_pulse_that_no_scene_has_leads_to_the_tables_of_a_campaign() -> Result<(), Box<dyn std::error::Error>> {
        let axis = "[[vary]]\nkey = \"pulse.0.torque_nm\"\nmin = 0.1\nmax = 0.4\ncount = 2\n";
        let text = format!("scene = \"crank-slider\"\nset = [\"pulse=[]\"]\nuntil_s = 0.004\nmethod = \"grid\"\n{axis}");
        let refused = Campaign::new("test", Spec::parse("test", &text)?).err().ok_or("accepted")?.to_string();
        let way = "give all of them, as in 'pulse=[{ … }]' in the campaign's `set`, or its pulses in [[pulse]] tables";
        assert!(refused.ends_with(way), "{refused}");
        // As it says: beside pulses that a change set, too.
        let pulse = "[[pulse]]\nstart_s = 0.001\ntorque_nm = 0.0\nduration_s = 0.001\n";
        let second = text.replace("pulse=[]", "pulse=[{ start_s = 0.0, torque_nm = 1.0, duration_s = 0.002 }]");
        for (text, key) in [(&text, "pulse.0"), (&second.replace("pulse.0", "pulse.1"), "pulse.1")] {
            let campaign = Campaign::new("test", Spec::parse("test", &format!("{text}{pulse}"))?)?;
            let outcome = campaign.run(&campaign.sample(1), &|| false).ok_or("no outcome")?;
            assert_eq!((outcome.ending, outcome.cause.as_str()), (Ending::Done, ""), "{key}");
        }
        let text = text.replace("\"pulse=[]\"", "\"pulse=[]\", \"pulse.0.torque_nm=1\"");
        let refused = Campaign::new("test", Spec::parse("test", &text)?).err().ok_or("accepted")?.to_string();
        assert!(refused.starts_with("test: set \"pulse.0.torque_nm=1\": `pulse` has no entries"), "{refused}");
        Ok(())
    }

    /// The chain of the campaign's scene has no slider; those of its runs have.
    #[test]
    fn prop_values_that_give_a_chain_a_slider_give_its_columns() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let scene = folder.path().join("open.toml");
        let links = "[crank]\nlength_m = 0.1\nmass_kg = 1.0\n[rod]\nlength_m = 0.3\nmass_kg = 1.0\n";
        std::fs::write(&scene, format!("{links}[solver]\nmodel = \"rigid\"\n"))?;
        let axis = "method = \"grid\"\n[[vary]]\nkey = \"slider.mass_kg\"\nvalues = [0.1, 0.2]\n";
        let spec = Spec::parse("test", &format!("scene = \"{}\"\nuntil_s = 0.01\n{axis}", scene.display()))?;
        let campaign = Campaign::new("test", spec)?;
        assert!(campaign.columns().iter().any(|column| column.name == "slider_pin_peak_force_n"));
        let outcome = campaign.run(&campaign.sample(1), &|| false).ok_or("no outcome")?;
        assert_eq!((outcome.ending, outcome.cause.as_str()), (Ending::Done, ""));
        Ok(())
    }
}
