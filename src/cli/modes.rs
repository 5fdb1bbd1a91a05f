//! `modes`: natural frequencies, damping and shapes.

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use clap_complete::engine::ArgValueCandidates;
use indicatif::ProgressBar;

use super::aligned_table::{figure, print};
use super::client_args::ClientArgs;
use super::completions;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::{make_folder, must_be_targets};
use super::formatting::{counted, degrees};
use super::mode_figures::{damping, hertz, percent, rounded};
use super::mode_sweep::{Along, Swept};
use super::output::{output, print_json};
use super::progress::bar;
use super::signals::Interruption;
use super::small_motion_args::{Chosen, SubjectArgs, range};
use super::values::count;
use super::written::{draw, write_table};
use crate::bus::{self, BusError, Name, Session, client};
use crate::plot;
use crate::shown::shown_s;
use crate::small_motion::{
    BeyondShapes, LiveModes, Mode, ModeReport, NoModes, Point, beyond_shapes, is_uncertain, modes as find,
};
use crate::wire::status::State;

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank modes                                      the default scene, at its start
  flexcrank modes crank-slider --angle 57 --plot shapes
  flexcrank modes crank-slider --angle 0:360:10 --csv angles.csv --plot angles
  flexcrank modes thesis-beam --set solver.model=modal --set solver.integrator=esdirk --speed 0:300:10 --plot campbell
  flexcrank modes recordings/crank.mcap@1.5
  flexcrank modes --live crank
  flexcrank modes ref-r3 --periodic --speed 150
  flexcrank modes crank-slider --periodic --speed 10:20:2 --over slider.mass_kg=0.1:0.5:0.2 --plot chart

The state is at rest at a crank angle, bent by weight and constant loads, in balance with a torque on the crank; a free second link \
    hangs, or without weight is in line with the crank. One link without weight may also turn steadily (--speed): the frequencies are those in the frame that turns along, as though a base spring turned \
    along, too. An instant of a recording \
    counts as though it stood still: in motion, only what vibrates much faster than the mechanism moves means something.

A mode is named by the part that holds most of its strain energy, and numbered in the order of |λ|, the size of its eigenvalue: \
    2π × frequency for a vibration without damping. A mode that only decays has 0 Hz, and stands where its |λ| puts it. \
    Under damping_s, links have as many decays at rates next to 1/damping_s as elements: of meshes with more than 60 unknowns, three or \
    more decays that differ by less than a thousandth from one to the next are left out. `trade` and \
    `check` list vibrations without damping: where damping is strong, their numbers may differ. Along a sweep a mode is followed by \
    its shape and keeps its name. `rigid` is the part of its kinetic energy in turning of the chain as it is.

Exit codes: 0 done, 1 failed at some points, 2 usage, bad scene, or a state that has no modes, 130 interrupted: the rows done are \
    written.";

/// Time in which a service must answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// Modes at a point, if it was reached.
type Found = Option<Result<Vec<Mode>, NoModes>>;

/// Times that the step of a sweep is halved where modes change too much to be followed.
const HALVINGS: usize = 5;
/// Most points of a sweep, per point that was asked for.
const MOST_POINTS: usize = 16;
/// Modes beyond those asked for that are followed along a sweep, since they may cross.
const BEYOND: usize = 4;
/// Options of a scene: they go neither with --live nor with --wait.
const NOT_OF_SERVICES: [&str; 8] = ["angle", "speed", "periodic", "over", "csv", "plot", "overrides", "crank"];

#[derive(Debug, clap::Args)]
// Beside an option that conflicts with --live, clap does not ask for --live.
#[command(mut_arg("wait", |wait| wait.requires("live").conflicts_with_all(NOT_OF_SERVICES)))]
pub(super) struct Args {
    #[command(flatten)]
    pub subject: SubjectArgs,
    /// Crank angles, degrees. Default: that of the scene's start.
    #[arg(long, value_name = "DEG|FROM:TO:STEP", allow_hyphen_values = true, value_parser = Values::degrees)]
    pub angle: Option<Values>,
    /// Crank speeds, rad/s.
    #[arg(long, value_name = "RAD/S|FROM:TO:STEP", allow_hyphen_values = true, value_parser = Values::parse)]
    pub speed: Option<Values>,
    /// Modes about the periodic motion of a scene at these speeds: how much each grows or fades in a turn, by itself and as the
    /// scene's integrator computes it at its step. The crank is moved at that speed if it is held, else a constant torque
    /// sustains it.
    #[arg(long, requires = "speed")]
    pub periodic: bool,
    /// Chart stability over the speeds and this key: the largest multiplier of a turn.
    #[arg(long, value_name = "KEY=FROM:TO:STEP", requires = "periodic", value_parser = Over::parse)]
    pub over: Option<Over>,
    /// Number of modes, in tables, too.
    #[arg(long, value_name = "N", default_value = "8", value_parser = count)]
    pub count: u64,
    /// Write every mode at every point to this file. One of the same name is replaced.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Draw into this folder, as SVG and PNG: the shapes of the modes, or their frequencies along a sweep.
    #[arg(long, value_name = "DIR")]
    pub plot: Option<PathBuf>,
    /// Print one JSON object for every mode and point.
    #[arg(long)]
    pub json: bool,
    /// Number of points to treat at a time. Default: one per core.
    #[arg(long, value_name = "N", value_parser = count)]
    pub jobs: Option<u64>,
    /// Ask a running service for the modes of its present state instead.
    #[arg(long, value_name = "NAME", conflicts_with_all = NOT_OF_SERVICES, conflicts_with = "target", add = ArgValueCandidates::new(completions::services))]
    pub live: Option<Name>,
    #[command(flatten)]
    pub client: ClientArgs,
}

/// One value or a range of them.
#[derive(Debug, Clone)]
pub(super) struct Values(pub Vec<f64>);

impl Values {
    fn parse(text: &str) -> Result<Self, String> {
        range(text).map(Values)
    }

    fn degrees(text: &str) -> Result<Self, String> {
        Self::parse(text).map_err(|problem| format!("degrees without their unit: {problem}"))
    }
}

/// A key of the scene and the values that it takes.
#[derive(Debug, Clone)]
pub(super) struct Over {
    pub key: String,
    pub values: Vec<f64>,
}

impl Over {
    fn parse(text: &str) -> Result<Self, String> {
        let (key, values) = text.split_once('=').ok_or("KEY=FROM:TO:STEP, such as slider.mass_kg=0.1:2:0.1")?;
        Ok(Over { key: key.to_owned(), values: range(values)? })
    }
}

pub(super) fn modes(args: &Args) -> CommandResult {
    if let Some(name) = &args.live {
        return live(args, name);
    }
    args.client.must_not_wait("--live <NAME>")?;
    let interruption = Interruption::watch()?;
    must_be_targets(&args.subject.target, &[("--csv", args.csv.as_deref())])?;
    let chosen = args.subject.choose()?;
    chosen.check(args.angle.is_some(), args.speed.is_some())?;
    let (along, values) = args.sweep(&chosen)?;
    args.plot.as_deref().map_or(Ok(()), make_folder)?;
    let mut swept = args.find(&chosen, along, values, &interruption)?;
    let points = swept.follow(args.modes());
    let sweeps = swept.values.len() > 1;
    if let ([only], [(_, refusal)]) = (swept.values.as_slice(), swept.refusals.as_slice()) {
        let _ = only;
        return Err(refusal.clone().into());
    }
    let table = swept.table(&points);
    let shown = match (args.json, sweeps) {
        (true, _) => table.rows_as_json().iter().try_for_each(print_json).map_err(Failure::from),
        (false, true) => swept.show(&args.subject.target, &points),
        (false, false) => show(args, &chosen, &swept),
    };
    // All that can be written is, though an earlier part of it, or printing, fails.
    let mut written = shown.and(args.csv.as_deref().map_or(Ok(()), |path| write_table(path, &table, !args.json)));
    if let Some(folder) = &args.plot {
        for (name, picture) in if sweeps { swept.pictures(&points) } else { shapes(&swept) } {
            written = written.and(draw(folder, &name, &picture, !args.json));
        }
    }
    written.and(swept.conclude(&interruption))
}

impl Args {
    pub(super) fn modes(&self) -> usize {
        usize::try_from(self.count).unwrap_or(usize::MAX)
    }

    /// The quantity that is swept, and its values: one of them, the angle, where nothing is.
    fn sweep(&self, chosen: &Chosen) -> CommandResult<(Along, Vec<f64>)> {
        let many = |values: &Option<Values>| values.as_ref().is_some_and(|values| values.0.len() > 1);
        if many(&self.angle) && many(&self.speed) {
            return Err(Failure::Usage("one of --angle and --speed may be a range, not both".to_owned()));
        }
        let values = |values: &Option<Values>| values.as_ref().map(|values| values.0.clone());
        Ok(match (values(&self.angle), values(&self.speed)) {
            (angle, Some(speeds)) if !many(&self.angle) && (many(&self.speed) || angle.is_none()) => (Along::Speed, speeds),
            (Some(angles), _) => (Along::Angle, angles),
            (None, _) => (Along::Angle, vec![degrees(chosen.angle_rad(None)?)]),
        })
    }

    /// Finds the modes at every point, and between points as far as modes change too much to be followed.
    fn find(&self, chosen: &Chosen, along: Along, values: Vec<f64>, interruption: &Interruption) -> CommandResult<Swept> {
        let single = |values: &Option<Values>| values.as_ref().and_then(|values| values.0.first().copied());
        let other = match along {
            Along::Angle => single(&self.speed),
            Along::Speed => single(&self.angle),
        };
        let wanted = if values.len() > 1 { self.modes().saturating_add(BEYOND) } else { self.modes() };
        let at = |value: f64| point(chosen, along, other, value).and_then(|point| find(&chosen.subject, &point, wanted));
        let bar = bar(values.len() as u64, "{wide_bar} {pos}/{len} points{left}");
        interruption.keeps(values.len() > 1);
        let most = MOST_POINTS * values.len();
        let found = self.solve(&values, &at, interruption, &bar);
        let mut points: Vec<(f64, bool, Found)> =
            values.into_iter().zip(found).map(|(value, found)| (value, true, found)).collect();
        for _ in 0..HALVINGS {
            let change = |pair: &[(f64, bool, Found)]| match (&pair[0].2, &pair[1].2) {
                (Some(Ok(before)), Some(Ok(after))) => is_uncertain(before, after, self.modes()),
                _ => false,
            };
            let after: Vec<usize> = (1..points.len()).filter(|end| change(&points[end - 1..=*end])).collect();
            let between: Vec<f64> = after.iter().map(|end| 0.5 * (points[end - 1].0 + points[*end].0)).collect();
            if between.is_empty() || points.len() + between.len() > most {
                break;
            }
            bar.inc_length(between.len() as u64);
            let found = self.solve(&between, &at, interruption, &bar);
            for ((end, value), found) in after.into_iter().zip(between).zip(found).rev() {
                points.insert(end, (value, false, found));
            }
        }
        bar.finish_and_clear();
        let mut swept = Swept { along, other, values: Vec::new(), modes: Vec::new(), asked: Vec::new(), refusals: Vec::new() };
        for (value, asked, found) in points {
            if let (Some(Err(refusal)), true) = (&found, asked) {
                swept.refusals.push((value, refusal.clone()));
            }
            swept.values.push(value);
            swept.asked.push(asked);
            swept.modes.push(found.and_then(Result::ok).unwrap_or_default());
        }
        Ok(swept)
    }

    /// Finds the modes at these values on several threads; nothing at those that an interruption left out.
    fn solve(
        &self,
        values: &[f64],
        at: &(dyn Fn(f64) -> Result<Vec<Mode>, NoModes> + Sync),
        interruption: &Interruption,
        bar: &ProgressBar,
    ) -> Vec<Found> {
        let (next, found) = (AtomicUsize::new(0), Mutex::new(vec![None; values.len()]));
        let work = || {
            while !interruption.is_asked() {
                let number = next.fetch_add(1, Ordering::Relaxed);
                let Some(value) = values.get(number) else { break };
                let modes = at(*value);
                // A thread that panicked has written nothing.
                found.lock().unwrap_or_else(|poisoned| poisoned.into_inner())[number] = Some(modes);
                bar.inc(1);
            }
        };
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = self.jobs.map_or(cores, |jobs| usize::try_from(jobs).unwrap_or(cores)).min(values.len());
        std::thread::scope(|scope| (0..threads).for_each(|_| _ = scope.spawn(work)));
        found.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Asks a service for its modes.
fn live(args: &Args, name: &Name) -> CommandResult {
    // While it waits for the service, a signal ends it.
    let _waiting = Interruption::watch()?;
    let session = args.client.open_to_read(name)?;
    let answer = client::modes(&session, name, args.count, PATIENCE).map_err(|error| unanswered(&session, name, error));
    bus::close(&session)?;
    let answer = answer?;
    let found: LiveModes = serde_json::from_slice(&answer)
        .map_err(|cause| Failure::Failed(format!("`{}` answered something that is not modes: {cause}", name.modes())))?;
    if args.json {
        found.modes.iter().try_for_each(print_json)?;
        return Ok(ExitStatus::Success);
    }
    let rate = figure(found.crank_rate_rad_per_s);
    let crank = match (found.has_crank, found.crank_is_moved, found.crank_rate_rad_per_s == 0.0) {
        (false, ..) => String::new(),
        (_, true, true) => ", crank held".to_owned(),
        (_, true, false) => format!(", crank moved at {rate} rad/s"),
        (_, false, _) => format!(", crank turning at {rate} rad/s"),
    };
    writeln!(output(), "{name}: step {}, t = {} s{crank}", found.step, shown_s(found.sim_time_s))?;
    print_modes(&found.modes)?;
    print_beyond_shapes(&found.beyond_shapes)?;
    Ok(ExitStatus::Success)
}

/// The failure of a question for modes. That of a replay, which does not answer, names the way to an instant of its recording.
fn unanswered(session: &Session, name: &Name, error: BusError) -> Failure {
    let state = || client::snapshot(session, name)?.status.map(|status| status.state());
    match error {
        BusError::NoReply(_) if state() == Some(State::Replaying) => Failure::Failed(format!(
            "`{name}` is a replay, and computes no modes: `flexcrank modes FILE@TIME` finds those of an instant of its recording"
        )),
        error => error.into(),
    }
}

/// The state at a value of what is swept.
fn point(chosen: &Chosen, along: Along, other: Option<f64>, value: f64) -> Result<Point, NoModes> {
    match along {
        Along::Angle => chosen.point(Some(value), other.unwrap_or(0.0)),
        Along::Speed => chosen.point(other, value),
    }
}

/// Prints the modes of one point.
fn show(args: &Args, chosen: &Chosen, swept: &Swept) -> CommandResult<()> {
    let crank = match (chosen.subject.is_oscillator(), chosen.subject.is_held()) {
        (true, _) => String::new(),
        (false, held) => format!(", crank {}", if held { "held" } else { "free" }),
    };
    let state = match (&chosen.instant, swept.values.first(), swept.along) {
        (Some((_, time_s)), ..) => format!(" at t = {} s", shown_s(*time_s)),
        _ if chosen.subject.is_oscillator() => String::new(),
        (None, Some(speed), Along::Speed) => format!(" turning at {} rad/s", figure(*speed)),
        (None, Some(angle), Along::Angle) => format!(" at {}°{}", figure(*angle), swept.beside()),
        _ => String::new(),
    };
    writeln!(output(), "{}: {}{crank}{state}", args.subject.target, chosen.source.scene.solver.model.as_str())?;
    let modes = swept.modes.first().map(Vec::as_slice).unwrap_or_default();
    print_modes(&modes.iter().map(ModeReport::from).collect::<Vec<_>>())?;
    let Some(value) = swept.values.first() else { return Ok(()) };
    print_beyond_shapes(&beyond_shapes(&chosen.subject, &point(chosen, swept.along, swept.other, *value)?, modes))
}

fn print_beyond_shapes(beyond: &[BeyondShapes]) -> CommandResult<()> {
    for BeyondShapes { mode, link, shapes } in beyond {
        let shapes = counted(*shapes as u64, "bending shape");
        writeln!(
            output(),
            "  {mode}: beyond the {shapes} of {link}.modes, it stands for all higher ones, and its frequency is too high: more modes, \
             or finite-element, give it"
        )?;
    }
    Ok(())
}

fn print_modes(modes: &[ModeReport]) -> CommandResult<()> {
    let mut rows = vec![["mode", "strain energy", "Hz", "damping", "rigid"].map(str::to_owned).to_vec()];
    for mode in modes {
        let parts = mode.strain.iter().filter(|(_, share)| *share >= 0.095).take(2);
        let parts: Vec<String> = parts.map(|(part, share)| format!("{part} {}", percent(*share))).collect();
        rows.push(vec![mode.name.clone(), parts.join(", "), hertz(mode), damping(mode), percent(mode.rigid_part)]);
    }
    print(&rows, 2)?;
    modes.iter().filter_map(rounded).try_for_each(|remark| Ok(writeln!(output(), "{remark}")?))
}

/// The mechanism at rest and bent as each mode bends it.
fn shapes(swept: &Swept) -> Vec<(String, plot::Figure)> {
    let modes = swept.modes.first().map(Vec::as_slice).unwrap_or_default();
    let shape = |(number, mode): (usize, &Mode)| {
        let title = format!("{}, {} Hz", mode.title(), hertz(&mode.into()));
        (format!("mode-{}-{}", number + 1, mode.name().replace(' ', "-")), plot::mode_shape(&title, &mode.links))
    };
    modes.iter().enumerate().filter(|(_, mode)| !mode.links.is_empty()).map(shape).collect()
}
