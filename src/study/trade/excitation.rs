//! The modes of a scene, and the part that each has in its run.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::configuration::{Configuration, Family, is_rigid, rigid_links};
use super::grid::Grid;
use super::output_group::{CHANNELS, OutputGroup};
use super::run::Failed;
use crate::scene::{Chain, IntegratorKind, ModelKind, Scene};
use crate::simulation::Simulation;
use crate::small_motion::{Amplitude, Kind, LinkShape, Mode, NoModes, NormalMode, NormalModes, Part, Subject, follow};

/// Modes of the slowest link in the model that tells the energies; the other links have those up to the same frequency.
const RESOLUTION: usize = 12;
/// Vibrations that are followed through the run.
const VIBRATIONS: usize = 10;
/// Modes beyond those, since they may cross; the turning chain among them.
pub(super) const BEYOND: usize = 5;
/// Instants of the run that are looked at, evenly spread.
const INSTANTS: usize = 50;
/// The first instants at which runs are compared, each of which is looked at, too: what rings from the start may die away soon.
const EARLY: usize = 12;
/// The run's step times the highest vibration's angular frequency, and most steps of the run.
const STEP: f64 = 0.8;
const MOST_STEPS: f64 = 4e5;
/// Nodes of a link on which shapes are compared; odd, so that there is a middle.
pub(super) const NODES: usize = 17;

/// A vibration and its part in the run of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitedMode {
    /// Its name at the start angle.
    pub name: String,
    /// The part that it strains.
    pub kind: Kind,
    /// Its number among the modes of this kind.
    pub number: usize,
    /// Its name where it changes an output most, if that is another: two vibrations can exchange their shapes as the crank turns.
    pub elsewhere: Option<String>,
    /// Its frequency at the start angle, undamped, Hz.
    pub frequency_hz: f64,
    /// Its part of the energy of all vibrations, the mean over the run, 0 to 1.
    pub energy_part: f64,
    /// Twice its kinetic energy as a part of the same: a vibration has as much as `energy_part`, a deflection that only follows its
    /// load next to none.
    pub moving_part: f64,
    /// The most by which its vibration changes an output that counts, relative as errors are; see [`NormalMode::vibrating`], and for
    /// forces [`NormalMode::joint_forces`]. The balance of energy is not among these outputs. 0 of a mode that does not swing.
    pub output_part: f64,
    /// That output.
    pub output: OutputGroup,
    /// The most by which its displacement changes one, what follows the load among it. Only deflections of the link that it is named
    /// after count: those of the other one follow in that link's own modes. Forces change by its acceleration alone, and so by no more
    /// than in its vibration.
    pub following_part: f64,
    /// Its eigenvalue with damping, 1/s.
    pub eigenvalue: Complex<f64>,
    /// Its shape.
    pub(super) links: Vec<LinkShape>,
}

/// Why the modes cannot be told.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoExcitation {
    /// There are none.
    #[error(transparent)]
    Modes(#[from] NoModes),
    /// The run that tells the energies failed.
    #[error("the run that tells their energies failed: {0}")]
    Run(#[from] Failed),
    /// All links are rigid.
    #[error("the links are rigid, so that none bends")]
    Rigid,
    /// No output that counts is one that a vibration is known to change.
    #[error("energy is not judged here")]
    NotJudged,
}

/// The vibrations of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// Crank angle at which modes are compared, rad: that of the start, or of the balance of a base spring.
    pub angle_rad: f64,
    /// The vibrations, lowest first.
    pub modes: Vec<ExcitedMode>,
}

/// Vibrations and their amplitudes at one instant.
struct Instant {
    /// Crank angle at which the modes are.
    angle_rad: f64,
    /// Whether it is one of those that are evenly spread, over which means are taken.
    is_spread: bool,
    vibrations: Vec<(NormalMode, Amplitude)>,
}

/// Sums of one vibration over the run.
#[derive(Debug, Clone, Default)]
struct Sums {
    energy_j: f64,
    kinetic_j: f64,
    /// Largest changes of the channels by what vibrates, and by all.
    vibrating: [f64; CHANNELS.len()],
    all: [f64; CHANNELS.len()],
    /// The instant and place of the largest change of an output that counts, and that.
    most: Option<(usize, usize, f64)>,
}

impl Excitation {
    /// Runs the scene as `modal` with many modes and with links that stretch, as the reference does, and finds the part of each
    /// vibration at some instants.
    ///
    /// At every instant the modes are those at rest at the crank's angle there, whose coordinates are orthogonal by mass and stiffness:
    /// the energies `E = ½ (ẋ² + ω² x²)` add up to the energy of small vibration. Over the angles, modes are followed by their shapes.
    /// Centrifugal stiffening of the turning chain is left out. A mode beyond critical damping does not vibrate: it has no `output_part`.
    ///
    /// # Errors
    /// [`NoExcitation`] where nothing vibrates, energy alone counts, or the run fails.
    pub(super) fn new(
        scene: &Scene,
        grid: &Grid,
        scales: &[f64; CHANNELS.len()],
        outputs: &[OutputGroup],
    ) -> Result<Self, NoExcitation> {
        let chain = scene.chain().ok_or(NoExcitation::Rigid)?;
        if chain.links.iter().all(is_rigid) {
            return Err(NoExcitation::Rigid);
        }
        if !CHANNELS.iter().any(|channel| outputs.contains(&channel.output)) {
            return Err(NoExcitation::NotJudged);
        }
        let instants = instants(scene, chain, grid)?;
        let Some(start) = instants.first() else { return Err(NoModes::Singular.into()) };
        let modes: Vec<Vec<Mode>> = instants.iter().map(Instant::modes).collect();
        let mut found = Vec::new();
        for branch in follow(&modes).into_iter().take(VIBRATIONS + BEYOND) {
            let Some(place) = branch.places.first().copied().flatten() else { continue };
            found.push((&start.vibrations[place].0, Sums::of(&branch.places, &instants, scales, outputs)));
        }
        found.sort_by(|(one, _), (other, _)| one.frequency_hz().total_cmp(&other.frequency_hz()));
        found.truncate(VIBRATIONS);
        let all_j: f64 = found.iter().map(|(_, sums)| sums.energy_j).sum();
        let part = |energy_j: f64| if all_j > 0.0 { energy_j / all_j } else { 0.0 };
        let excited = |(mode, sums): &(&NormalMode, Sums)| {
            let (vibrating, all) = (worst(&sums.vibrating, outputs), worst(&sums.all, outputs));
            let (output, output_part) = if mode.swings() { vibrating } else { (all.0, 0.0) };
            let at_most = sums.most.map(|(instant, place, _)| instants[instant].vibrations[place].0.mode.name());
            ExcitedMode {
                name: mode.mode.name(),
                elsewhere: at_most.filter(|name| *name != mode.mode.name()),
                kind: mode.mode.kind,
                number: mode.mode.number,
                frequency_hz: mode.frequency_hz(),
                energy_part: part(sums.energy_j),
                moving_part: part(2.0 * sums.kinetic_j),
                output_part,
                output,
                following_part: all.1,
                eigenvalue: mode.equation.eigenvalue(),
                links: on_nodes(mode),
            }
        };
        Ok(Excitation { angle_rad: start.angle_rad, modes: found.iter().map(excited).collect() })
    }
}

impl Instant {
    fn modes(&self) -> Vec<Mode> {
        self.vibrations.iter().map(|(vibration, _)| vibration.mode.clone()).collect()
    }
}

impl Sums {
    /// Adds up one mode, which stands at these places among the modes of each instant.
    fn of(places: &[Option<usize>], instants: &[Instant], scales: &[f64; CHANNELS.len()], outputs: &[OutputGroup]) -> Self {
        let mut sums = Sums::default();
        for (index, (place, instant)) in places.iter().zip(instants).enumerate() {
            let Some(place) = *place else { continue };
            let (mode, amplitude) = (&instant.vibrations[place].0, instant.vibrations[place].1);
            if instant.is_spread {
                sums.energy_j += mode.energy_j(amplitude);
                sums.kinetic_j += 0.5 * amplitude.velocity.powi(2);
            }
            let links = on_nodes(mode);
            let is_own = own_channels(mode.mode.kind, &links);
            for (k, (unit, scale)) in outputs_of(mode, &links).iter().zip(scales).enumerate() {
                let vibrating = mode.vibrating(amplitude) * unit / scale;
                let all = match CHANNELS[k].output {
                    OutputGroup::Forces => vibrating,
                    _ => amplitude.displacement.abs() * unit / scale,
                };
                sums.vibrating[k] = sums.vibrating[k].max(vibrating);
                if is_own[k] {
                    sums.all[k] = sums.all[k].max(all);
                }
                let change = vibrating.max(if is_own[k] { all } else { 0.0 });
                if outputs.contains(&CHANNELS[k].output) && sums.most.is_none_or(|(_, _, most)| change > most) {
                    sums.most = Some((index, place, change));
                }
            }
        }
        sums
    }
}

/// The output that counts and is changed most, and by how much.
fn worst(changes: &[f64; CHANNELS.len()], outputs: &[OutputGroup]) -> (OutputGroup, f64) {
    let counts = CHANNELS.iter().zip(changes).filter(|(channel, _)| outputs.contains(&channel.output));
    let most = counts.max_by(|(_, one), (_, other)| one.total_cmp(other));
    most.map_or((OutputGroup::Deflection, 0.0), |(channel, part)| (channel.output, *part))
}

/// Changes of the channels by a unit of a mode: chord angle, place of the end, deflections, and joint forces in its free vibration.
fn outputs_of(mode: &NormalMode, links: &[LinkShape]) -> [f64; CHANNELS.len()] {
    let bow = |i: usize| links.get(i).map_or(0.0, |link| link.bow().abs());
    let end = links.last().and_then(|link| link.displacement.last());
    let end_m = end.map_or(0.0, |[along, across]| along.re.hypot(across.re));
    let [pivot, crank_pin, slider_pin] = mode.joint_forces.map(|[x, y]| x.hypot(y));
    [links.first().map_or(0.0, |link| link.chord_turn().abs()), end_m, bow(0), bow(1), pivot, crank_pin, slider_pin]
}

/// Whether a channel is none of the other link's deflection.
fn own_channels(kind: Kind, links: &[LinkShape]) -> [bool; CHANNELS.len()] {
    let name = match kind {
        Kind::Vibration(Part::Bending(name) | Part::Stretching(name)) => Some(name),
        _ => None,
    };
    let is_own = |i: usize| name.is_none() || links.get(i).map(|link| link.link) == name;
    [true, true, is_own(0), is_own(1), true, true, true]
}

/// A mode's shape on the nodes on which shapes are compared.
pub(super) fn on_nodes(mode: &NormalMode) -> Vec<LinkShape> {
    mode.mode.links.iter().map(|link| link.on_nodes(NODES)).collect()
}

/// Runs the scene; the instant of the start first, the others in the order of the crank's angle.
fn instants(scene: &Scene, chain: &Chain, grid: &Grid) -> Result<Vec<Instant>, NoExcitation> {
    let family = Family {
        model: ModelKind::Modal,
        integrator: IntegratorKind::Esdirk,
        resolution: RESOLUTION,
        rigid: rigid_links(chain),
        axial: vec![true; chain.links.len()],
    };
    let resting = family.scene(scene, grid.interval_s);
    let subject = Subject::new(&resting, None)?;
    // About that a chain on a base spring vibrates. Where none is found, the spring is unstressed at 0.
    let balance_rad = subject.balance_rad().unwrap_or(Some(0.0));
    let still = NormalModes::new(&resting, subject.start_rad()?, VIBRATIONS + BEYOND)?;
    let highest = still.modes().iter().map(|mode| mode.equation.stiffness.sqrt()).fold(0.0, f64::max);
    let most = (MOST_STEPS / grid.count as f64).max(1.0);
    let step_s = grid.interval_s / (grid.interval_s * highest / STEP).ceil().clamp(1.0, most);
    let scene = Configuration { family, step_s }.scene(scene);
    let mut simulation = Simulation::new(&scene).map_err(Failed::from)?;
    let every = grid.count.div_ceil(INSTANTS);
    let mut instants = Vec::new();
    for instant in 0..=grid.count {
        if instant > 0 {
            (0..grid.steps(step_s)).try_for_each(|_| simulation.step()).map_err(Failed::from)?;
        }
        let is_spread = instant % every == 0;
        if is_spread || instant <= EARLY {
            // Singular positions have no modes.
            instants.extend(at(&scene, balance_rad, &mut simulation)?.map(|found| Instant { is_spread, ..found }));
        }
    }
    if let [first, rest @ ..] = instants.as_mut_slice() {
        let phase_rad = |instant: &Instant| (instant.angle_rad - first.angle_rad).rem_euclid(TAU);
        rest.sort_by(|one, other| phase_rad(one).total_cmp(&phase_rad(other)));
    }
    Ok(instants)
}

/// Vibrations and amplitudes at the present instant of a run. At some angles a chain that turns or swings moves as it does in a vibration
/// at others, so that only vibrations are followed.
fn at(scene: &Scene, balance_rad: Option<f64>, simulation: &mut Simulation) -> Result<Option<Instant>, Failed> {
    let chord_rad = simulation.observe()?.links.first().map_or(0.0, |link| link.chord_rad);
    let Some(motion) = simulation.motion() else { return Ok(None) };
    let angle_rad = match motion.input.motion {
        Some([angle_rad, ..]) => angle_rad,
        None => balance_rad.unwrap_or(chord_rad),
    };
    let Ok(modes) = NormalModes::new(scene, angle_rad, VIBRATIONS + BEYOND) else { return Ok(None) };
    let amplitudes = modes.amplitudes([&motion.q, &motion.v, &motion.a]);
    let all = modes.modes().iter().cloned().zip(amplitudes);
    Ok(Some(Instant { angle_rad, is_spread: true, vibrations: all.filter(|(mode, _)| mode.is_vibration()).collect() }))
}
