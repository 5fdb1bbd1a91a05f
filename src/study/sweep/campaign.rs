//! A campaign: the specification with its scene, and the scene and identity of each run.

use std::path::Path;

use sha2::{Digest as _, Sha256};

use super::SweepError;
use super::axis::Value;
use super::run::{Column, Limits, Outcome, columns, run};
use super::sampling;
use super::spec::Spec;
use crate::scene::{SceneError, SceneSource};

/// Samples that are tried before a campaign begins.
const TRIED: u64 = 16;

/// A campaign, ready to run.
pub struct Campaign {
    spec: Spec,
    base: SceneSource,
    columns: Vec<Column>,
    /// The part of every identity that all runs share.
    shared: Sha256,
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
        let mut base = SceneSource::open(&spec.scene, &spec.set)?;
        if !spec.pulses.is_empty() {
            let origin = format!("{} with the pulses of {origin}", spec.scene);
            base = SceneSource::parse(&origin, &format!("{}\n{}", base.text, spec.pulses), &[])?;
        }
        let shared = Sha256::new()
            .chain_update(concat!("flexcrank ", env!("CARGO_PKG_VERSION"), " sweep 1\n"))
            .chain_update(format!("until_s={:?}\nmax_steps={}\n", spec.until_s, spec.max_steps))
            .chain_update(&base.text);
        let campaign = Campaign { columns: columns(&base.scene), spec, base, shared };
        campaign.try_samples()?;
        Ok(campaign)
    }

    /// A misspelt key is refused in every run: better now than in a table of refusals.
    fn try_samples(&self) -> Result<(), SceneError> {
        let tried = TRIED.min(self.runs());
        let mut first = None;
        for place in 0..tried {
            let index = (u128::from(place) * u128::from(self.runs()) / u128::from(tried)) as u64;
            match self.scene(&sampling::values(&self.spec, index)) {
                Ok(_) => return Ok(()),
                Err(refused) => first = first.or(Some(refused)),
            }
        }
        first.map_or(Ok(()), Err)
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

    fn scene(&self, values: &[Value]) -> Result<SceneSource, SceneError> {
        SceneSource::parse(&self.base.origin, &self.base.text, &self.overrides(values))
    }

    /// Runs a sample; `None` if `stop` asked for an end before.
    pub(super) fn run(&self, sample: &Sample, stop: &dyn Fn() -> bool) -> Option<Outcome> {
        let limits = Limits { until_s: self.spec.until_s, max_steps: self.spec.max_steps };
        run(|| self.scene(&sample.values), limits, self.columns.len(), stop)
    }
}
