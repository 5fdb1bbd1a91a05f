//! The mechanism and the state whose small motion is asked for: a scene, or an instant of a recording.

use std::path::{Path, PathBuf};

use clap_complete::engine::ArgValueCompleter;

use super::completions;
use super::failure::{CommandResult, Failure};
use super::progress::over_file;
use super::values::{finite, time};
use crate::decimal_comma::decimal_comma_hint;
use crate::recording::begins_as_mcap;
use crate::resimulation::{RecordedSession, Resumed, resume};
use crate::scene::{SceneError, SceneSource, builtin};
use crate::small_motion::{Crank, NoModes, Point, Subject};

/// Most points of a sweep.
const MOST_POINTS: usize = 100_000;

#[derive(Debug, clap::Args)]
pub(super) struct SubjectArgs {
    /// A built-in scene, a TOML file, or an instant of a recording.
    #[arg(value_name = "SCENE|FILE@TIME", default_value = builtin::DEFAULT, add = ArgValueCompleter::new(completions::scenes))]
    pub target: String,
    /// Whether the crank turns freely or is held. Default: held where the scene prescribes its motion.
    #[arg(long, value_name = "free|held", value_parser = crank)]
    pub crank: Option<Crank>,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
}

/// A scene's mechanism, and its state where that is an instant of a recording.
pub(super) struct Chosen {
    pub source: SceneSource,
    pub subject: Subject,
    /// The instant's state, and its time, s.
    pub instant: Option<(Point, f64)>,
}

impl SubjectArgs {
    /// Reads the scene, or re-simulates the recording up to the instant.
    pub(super) fn choose(&self) -> CommandResult<Chosen> {
        let Some((file, time_s)) = self.instant()? else {
            let source = SceneSource::open(&self.target, &self.overrides).map_err(|refusal| self.refused(refusal))?;
            let subject = Subject::new(&source.scene, self.crank).map_err(with_suited_model)?;
            must_move(&subject)?;
            return Ok(Chosen { source, subject, instant: None });
        };
        if !self.overrides.is_empty() || self.crank.is_some() {
            return Err(Failure::Usage(
                "an instant of a recording has its own scene: neither --set nor --crank goes with it".to_owned(),
            ));
        }
        let session = RecordedSession::open(&file)?;
        let bar = over_file(&file, 1);
        let resumed = resume(&session, Some(time_s), &|position| bar.set_position(position));
        bar.finish_and_clear();
        let Resumed { mut simulation, scene, .. } = resumed?;
        let source = scene.source;
        let subject = Subject::new(&source.scene, None)?;
        let point = simulation.motion().ok_or(NoModes::Singular)?;
        Ok(Chosen { source, subject, instant: Some((point.into(), simulation.time_s())) })
    }

    /// The refusal of a scene. Of a recording, an instant is wanted.
    fn refused(&self, refusal: SceneError) -> Failure {
        let target = &self.target;
        if begins_as_mcap(Path::new(target)) {
            Failure::Usage(format!("{target}: is a recording: name an instant of it, {target}@TIME, such as {target}@1.5"))
        } else {
            refusal.into()
        }
    }

    /// File and time of `FILE@TIME`.
    fn instant(&self) -> CommandResult<Option<(PathBuf, f64)>> {
        let Some((file, at)) = self.target.rsplit_once('@') else { return Ok(None) };
        let is_file = |name: &str| Path::new(name).is_file();
        match time(at) {
            _ if is_file(&self.target) => Ok(None),
            Ok(time_s) => Ok(Some((PathBuf::from(file), time_s))),
            Err(wanted) if is_file(file) => {
                let hint = decimal_comma_hint(at).map(|hint| format!("; {hint}")).unwrap_or_default();
                Err(Failure::Usage(format!("{}: `{at}` after the @ is not {wanted}{hint}", self.target)))
            }
            Err(_) => Ok(None),
        }
    }
}

impl Chosen {
    /// The state at a crank angle and speed; without an angle, at the scene's start. An instant of a recording has its own.
    pub(super) fn point(&self, angle_deg: Option<f64>, speed_rad_per_s: f64) -> Result<Point, NoModes> {
        match &self.instant {
            Some((point, _)) => Ok(point.clone()),
            None => self.subject.turning(self.angle_rad(angle_deg)?, speed_rad_per_s),
        }
    }

    /// An angle given, or that of the scene's start, rad.
    pub(super) fn angle_rad(&self, angle_deg: Option<f64>) -> Result<f64, NoModes> {
        angle_deg.map_or_else(|| self.subject.start_rad(), |angle_deg| Ok(angle_deg.to_radians()))
    }

    /// Refuses an angle or a speed where neither means anything.
    pub(super) fn check(&self, angle_given: bool, speed_given: bool) -> CommandResult<()> {
        let given = angle_given || speed_given;
        if given && self.instant.is_some() {
            let of_scenes = "--angle, --speed and `modes --periodic` are of a scene";
            return Err(Failure::Usage(format!("{of_scenes}: an instant of a recording has its own angle and speed")));
        }
        if given && self.subject.is_oscillator() {
            return Err(NoModes::NoCrank.into());
        }
        Ok(())
    }
}

/// The refusal of a scene's model. A scene with the incremental model can have the modal one, with the same integrator.
fn with_suited_model(refused: NoModes) -> Failure {
    match refused {
        NoModes::NotSuited(_) => Failure::Usage(format!("{refused}: add --set solver.model=modal")),
        _ => refused.into(),
    }
}

/// Refuses a scene in which nothing can move, with the option that lets it.
fn must_move(subject: &Subject) -> CommandResult<()> {
    if subject.is_held() && subject.mechanism().degrees_of_freedom() == 0 {
        return Err(Failure::Usage(format!("{}; `--crank free` lets it turn", NoModes::NothingMoves)));
    }
    Ok(())
}

fn crank(text: &str) -> Result<Crank, String> {
    match text {
        "free" => Ok(Crank::Free),
        "held" => Ok(Crank::Held),
        _ => Err("free or held".to_owned()),
    }
}

/// One value, or FROM:TO:STEP with both ends.
pub(super) fn range(text: &str) -> Result<Vec<f64>, String> {
    let numbers: Option<Vec<f64>> = text.split(':').map(finite).collect();
    let wrong = || "a number, or FROM:TO:STEP, such as 0:360:10, with TO not below FROM and STEP above 0".to_owned();
    match numbers.as_deref() {
        Some([one]) => Ok(vec![*one]),
        Some(&[from, to, step]) if step > 0.0 && to >= from => {
            let steps = ((to - from) / step * (1.0 + 1e-12)).floor();
            if steps < MOST_POINTS as f64 {
                Ok((0..=steps as usize).map(|n| from + step * n as f64).collect())
            } else {
                Err(format!("at most {MOST_POINTS} points"))
            }
        }
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::range;

    #[test]
    fn val_ranges_have_both_ends() {
        assert_eq!(range("0:1:0.25"), Ok(vec![0.0, 0.25, 0.5, 0.75, 1.0]));
        assert_eq!(range("-3"), Ok(vec![-3.0]));
        assert_eq!(range("0:360:10").map(|all| all.len()), Ok(37));
        for bad in ["", "1:2", "0:1:0", "1:0:1", "0:1:-1", "0:1:1e-9", "0:nan:1", "a"] {
            assert!(range(bad).is_err(), "{bad}");
        }
        assert!(range("10:0:1").is_err_and(|said| said.contains("TO not below FROM and STEP above 0")));
    }
}
