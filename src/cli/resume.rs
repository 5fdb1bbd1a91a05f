//! What a run begins with: a scene at its start, or a session where its recording left it.

use std::path::{Path, PathBuf};

use super::args::{Run, positive};
use super::files::progress_bar;
use crate::bus::Name;
use crate::resimulation::{Resumed, Source, resume};
use crate::runtime::PublishRate;
use crate::scene::SceneSource;
use crate::service::Resumption;
use crate::simulation::Simulation;

const NAME: &str = "crank";
const PUBLISH_HZ: PublishRate = PublishRate::Hz(200.0);

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Go on with a recorded session where its recording ends: its scene, name and pending pulses, alike to the bit with one that
    /// never stopped.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scene", "overrides", "shadow"])]
    pub resume: Option<PathBuf>,
    /// Go on at this simulated time of the session instead, s.
    #[arg(long, value_name = "S", requires = "resume", value_parser = positive)]
    pub at: Option<f64>,
}

/// What a run begins with.
pub(super) struct Beginning {
    pub name: Name,
    pub scene: SceneSource,
    pub simulation: Simulation,
    pub publish: PublishRate,
    pub resumption: Option<Resumption>,
}

/// What `run` is told to begin with.
pub(super) fn begin(args: &Run) -> anyhow::Result<Beginning> {
    let Some(file) = &args.resume.resume else {
        let scene = SceneSource::open(&args.scene, &args.overrides)?;
        let name = args.name.clone().map_or_else(|| NAME.parse(), Ok)?;
        let simulation = Simulation::new(&scene.scene)?;
        return Ok(Beginning { name, scene, simulation, publish: args.publish_hz.unwrap_or(PUBLISH_HZ), resumption: None });
    };
    let source = Source::open(file)?;
    let name = args.name.clone().map_or_else(|| source.name.parse(), Ok)?;
    let publish = args.publish_hz.or(source.publish).unwrap_or(PUBLISH_HZ);
    let Resumed { simulation, epoch_start_s, answers } = recompute(file, &source, args.resume.at)?;
    let of = format!(
        "{} at step {} of epoch {}, t = {} s",
        file.display(),
        simulation.step_count(),
        simulation.epoch(),
        simulation.time_s()
    );
    eprintln!("resuming {of}");
    let resumption = Some(Resumption { started: source.started, epoch_start_s, answers, of });
    Ok(Beginning { name, scene: source.scene, simulation, publish, resumption })
}

fn recompute(file: &Path, source: &Source, at_s: Option<f64>) -> anyhow::Result<Resumed> {
    let bar = progress_bar(file, 1);
    let resumed = resume(source, at_s, &|position| bar.set_position(position));
    bar.finish_and_clear();
    Ok(resumed?)
}
