//! The start of a run: a scene at its start, or a recorded session to resume.

use std::path::{Path, PathBuf};

use super::failure::{CommandResult, Failure};
use super::progress::over_file;
use super::values::positive_time;
use crate::bus::Name;
use crate::resimulation::{RecordedSession, Resumed, resume};
use crate::scene::SceneSource;
use crate::service::Resumption;
use crate::shown::shown_s;
use crate::simulation::{PublishRate, PublishRates, Simulation};

#[derive(Debug, clap::Args)]
pub(super) struct ResumeArgs {
    /// Resume a recorded session where its recording ends: with its scene, name and pending pulses, equal to the bit to one that
    /// never stopped.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scene", "count", "overrides", "shadow"])]
    pub resume: Option<PathBuf>,
    /// With --resume, resume at this simulated time of the session instead.
    #[arg(long, value_name = "TIME", value_parser = positive_time)]
    pub at: Option<f64>,
}

impl ResumeArgs {
    /// Refuses a time to resume at without a session. clap's `requires` does not, where a scene excludes `--resume`.
    pub(super) fn check(&self) -> CommandResult<()> {
        match (&self.resume, self.at) {
            (None, Some(at_s)) => Err(Failure::Usage(format!(
                "--at {at_s}: only a recorded session resumes at a time, with --resume FILE; a scene begins at 0 and ends at \
                 --until {at_s}"
            ))),
            _ => Ok(()),
        }
    }
}

/// The start of one service.
pub(super) struct RunStart {
    pub scene: SceneSource,
    pub simulation: Simulation,
    pub publish: PublishRates,
    pub resumption: Option<Resumption>,
}

impl RunStart {
    /// Refuses an end before that of the first step.
    pub(super) fn reaches(self, until_s: Option<f64>) -> CommandResult<Self> {
        let (time_s, step_s) = (self.simulation.time_s(), self.simulation.step_s());
        match until_s.map(|until_s| (until_s, until_s - time_s)) {
            Some((until_s, lasts_s)) if lasts_s < step_s * (1.0 - 1e-6) => {
                let (scene, lasts_s) = (&self.scene.origin, shown_s(lasts_s));
                let why = format!("--until {until_s}: the run would last {lasts_s} s, less than one step of {step_s} s");
                Err(Failure::Usage(format!("{scene}: {why}")))
            }
            _ => Ok(self),
        }
    }
}

/// Resumes the session of a recording, under `name` or its own.
pub(super) fn start_from(
    file: &Path,
    at_s: Option<f64>,
    name: Option<Name>,
    publish: Option<PublishRates>,
    until_s: Option<f64>,
) -> CommandResult<(Name, RunStart)> {
    let source = RecordedSession::open(file)?;
    let name = name.map_or_else(|| source.name.parse(), Ok)?;
    let publish = publish.or(source.publish).unwrap_or(PublishRate::DEFAULT.into());
    let Resumed { simulation, epoch_start_s, scene, answers, missing } = recompute(file, &source, at_s)?;
    let time_s = simulation.time_s();
    if let Some(until_s) = until_s.filter(|until_s| *until_s <= time_s) {
        let time_s = shown_s(time_s);
        return Err(Failure::Usage(format!("--until {until_s} is over already: the session goes on from t = {time_s} s")));
    }
    let of = format!(
        "{} at step {} of epoch {}, t = {} s",
        file.display(),
        simulation.step_count(),
        simulation.epoch(),
        shown_s(simulation.time_s())
    );
    say!("resuming {of}");
    let resumption = Some(Resumption { started: source.started, epoch_start_s, level: scene.level, answers, missing, of });
    Ok((name, RunStart { scene: scene.base, simulation, publish, resumption }))
}

fn recompute(file: &Path, source: &RecordedSession, at_s: Option<f64>) -> CommandResult<Resumed> {
    let bar = over_file(file, 1);
    let resumed = resume(source, at_s, &|position| bar.set_position(position));
    bar.finish_and_clear();
    Ok(resumed?)
}
