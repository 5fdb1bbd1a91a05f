//! Modes, each named by where its energy is.

use std::fmt;

use nalgebra::{Complex, DVector};

use super::NoModes;
use super::band::Band;
use super::linearised::Linearised;
use super::parts::{Part, Parts};
use super::point::Point;
use super::rounding::{part_by, rounding};
use super::shape::{Figure, LinkShape, deformed_part};
use super::spectrum::lowest;
use super::subject::Subject;
use super::tension::take_out_tension;
use crate::mechanics::Mechanism;
use crate::scene::LinkName;

/// Strain energy below this part of the kinetic energy does not name a mode.
const STRAINED: f64 = 0.05;
/// The same while the chain turns.
const STRAINED_WHILE_TURNING: f64 = 0.25;
/// A mode with more of its kinetic energy than this in turning of the chain as it is, is named after that,
const RIGID: f64 = 0.5;
/// unless strain holds this part of the energy that brings it back. So it is with the first bending of a clamped beam, nearly all of
/// whose points move to one side.
const BROUGHT_BACK: f64 = 0.5;
/// A shape that only decays, and in which this part of the squared displacements is none of rigid links, is named after its strain. So is
/// one that strains a base spring most. Of a vibration damped more than critically, the faster decay has little strain energy beside its
/// kinetic energy, as a rotation has.
const DEFORMED: f64 = 0.05;

/// Strain energy below this part of the terms that it is the sum of is rounding, or has shares that are: of the swing of a carbon arm they
/// erred by a tenth from 8 elements a link on.
const ROUNDING: f64 = 10.0 * f64::EPSILON;

/// A part of the mechanism and its share of a mode's strain energy, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The part.
    pub part: Part,
    /// Its share.
    pub share: f64,
}

/// Kind of a mode: the part that its energy is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// The chain turns as a whole, and nothing brings it back.
    Rotation,
    /// The chain swings as a whole: weight or the loads present bring it back.
    Swing,
    /// A link or the base vibrates.
    Vibration(Part),
    /// Masses on springs vibrate.
    Masses,
}

/// One mode of small motion, `δq = Re(φ e^(λt))`.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// The kind, and the number of the mode among those of this kind, from 1 in the order of |λ|.
    pub kind: Kind,
    /// See `kind`.
    pub number: usize,
    /// λ, 1/s.
    pub eigenvalue: Complex<f64>,
    /// φ in the model's coordinates, with `φᴴ M φ = 1`.
    pub shape: DVector<Complex<f64>>,
    /// Shares of the strain energy, the largest first; empty where nothing is strained.
    pub shares: Vec<Share>,
    /// Part of the kinetic energy in turning of the chain with its links as they are, 0 to 1; 0 where the crank is held.
    pub rigid_part: f64,
    /// φ on the links' nodes; none of an oscillator.
    pub links: Vec<LinkShape>,
    /// The part of λ, 0 to 1, that rounding of the stiffness of finite elements may change; 0 of free motion and of other models.
    pub rounding: f64,
}

impl Mode {
    /// Frequency of the vibration as it decays, `|Im λ|/2π`, Hz.
    pub fn frequency_hz(&self) -> f64 {
        self.eigenvalue.im / std::f64::consts::TAU
    }

    /// Damping ratio `−Re λ/|λ|`; 0 of free motion.
    pub fn damping_ratio(&self) -> f64 {
        let size = self.eigenvalue.norm();
        if size == 0.0 { 0.0 } else { -self.eigenvalue.re / size }
    }

    /// Whether it grows. Eigenvalues are found to some 1e-9.
    pub fn grows(&self) -> bool {
        self.eigenvalue.re > 1e-8 * self.eigenvalue.norm()
    }

    /// The name: kind and number, such as `rod bending 2`.
    pub fn name(&self) -> String {
        match self.kind {
            Kind::Rotation if self.number == 1 => "chain rotation".to_owned(),
            Kind::Rotation => format!("chain rotation {}", self.number),
            Kind::Swing if self.number == 1 => "chain swing".to_owned(),
            Kind::Swing => format!("chain swing {}", self.number),
            Kind::Vibration(Part::Base) if self.number == 1 => format!("{} torsion of the base", self.first_link()),
            Kind::Vibration(Part::Base) => format!("{} torsion of the base {}", self.first_link(), self.number),
            Kind::Vibration(part) => format!("{part} {}", self.number),
            Kind::Masses => format!("masses {}", self.number),
        }
    }

    /// The scene's name of the link on the base.
    fn first_link(&self) -> &'static str {
        self.links.first().map_or(LinkName::Crank, |link| link.link).as_str()
    }

    /// The name with the share of its strain energy that it is named after.
    pub fn title(&self) -> String {
        match self.shares.first() {
            Some(first) if matches!(self.kind, Kind::Vibration(_)) => format!("{} ({:.0} %)", self.name(), 100.0 * first.share),
            _ => self.name(),
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Part::Bending(link) => write!(f, "{} bending", link.as_str()),
            Part::Stretching(link) => write!(f, "{} stretching", link.as_str()),
            Part::Base => f.write_str("base"),
        }
    }
}

/// The `count` lowest modes about a point.
///
/// # Errors
/// [`NoModes`] where nothing can move, the position is singular, or eigenvalues are not found.
pub fn modes(subject: &Subject, point: &Point, count: usize) -> Result<Vec<Mode>, NoModes> {
    let mut identifier = Identifier::new(subject, point)?;
    let pairs = lowest(&identifier.system, count)?;
    Ok(numbered(pairs.into_iter().map(|pair| identifier.identify(pair.value, pair.vector)).collect()))
}

/// Numbers the modes of each kind, in the order given.
pub(super) fn numbered(mut modes: Vec<Mode>) -> Vec<Mode> {
    for place in 0..modes.len() {
        modes[place].number = 1 + modes[..place].iter().filter(|mode| mode.kind == modes[place].kind).count();
    }
    modes
}

/// Tells of a shape about a point where its energy is.
pub(super) struct Identifier {
    mechanism: Box<dyn Mechanism>,
    point: Point,
    pub(super) system: Linearised,
    parts: Vec<(Part, Band)>,
    rigid: RigidPart,
    figure: Figure,
    /// Axial forces of the links' elements, N, where the energy of stretching has their work among it.
    axial_n: Vec<Vec<f64>>,
    oscillates: bool,
    /// Whether its coordinates are those of finite elements, in which turning has none of its own.
    is_meshed: bool,
}

/// The strain of a shape.
struct Strain {
    /// Twice the strain energy of each part, and of all.
    energies: Vec<(Part, f64)>,
    whole: f64,
    /// The shape on the links' nodes.
    links: Vec<LinkShape>,
}

impl Identifier {
    pub(super) fn new(subject: &Subject, point: &Point) -> Result<Self, NoModes> {
        let mut mechanism = subject.mechanism();
        let system = Linearised::new(mechanism.as_mut(), point);
        if !system.is_finite() {
            return Err(NoModes::Singular);
        }
        let mut figure = Figure::new(subject);
        let axial_n = match subject.stretching_has_tension() {
            true => figure.axial_n(mechanism.as_mut(), point),
            false => Vec::new(),
        };
        Ok(Identifier {
            rigid: RigidPart::new(subject, mechanism.as_mut(), point, &system),
            parts: Parts::new(subject).stiffness(point),
            figure,
            axial_n,
            oscillates: subject.is_oscillator(),
            is_meshed: subject.stretching_has_tension(),
            point: point.clone(),
            mechanism,
            system,
        })
    }

    /// The mode of a multiplier over a turn, whose shape with `φᴴ M φ = 1` moves at some `near_per_s`. In a turning chain every mode turns
    /// the chain a little; it is named after that only if nothing else moves. A link whose rotation holds it may bend faster, with less
    /// strain energy. `runs_ahead`: a free crank does, or turns faster, and the links follow bent. `exponent`
    /// gives its eigenvalue.
    pub(super) fn identify_periodic(
        &mut self,
        (near_per_s, runs_ahead): (f64, bool),
        exponent: impl FnOnce(bool) -> Complex<f64>,
        shape: DVector<Complex<f64>>,
    ) -> Mode {
        let strain = self.strain(&shape);
        let is_strained = strain.whole >= STRAINED_WHILE_TURNING * near_per_s * near_per_s;
        let is_deformed = is_strained || deformed_part(&strain.links) >= DEFORMED;
        let vibrates = self.rigid.whole == 0.0 || is_deformed && !runs_ahead;
        let mut mode = self.named(exponent(vibrates), shape, strain);
        mode.kind = match (mode.shares.first(), vibrates) {
            _ if runs_ahead => Kind::Rotation,
            (Some(share), true) => Kind::Vibration(share.part),
            _ if mode.eigenvalue.im == 0.0 && self.rigid.whole > 0.0 => Kind::Rotation,
            _ => Kind::Swing,
        };
        mode
    }

    /// The mode of an eigenvalue and a shape with `φᴴ M φ = 1`, the first of its kind.
    pub(super) fn identify(&mut self, eigenvalue: Complex<f64>, shape: DVector<Complex<f64>>) -> Mode {
        let strain = self.strain(&shape);
        self.named(eigenvalue, shape, strain)
    }

    /// Without the work of tension as links turn. None where it is not well above the rounding of its terms, as of a swing of stiff links.
    fn strain(&mut self, shape: &DVector<Complex<f64>>) -> Strain {
        let mut energies = energies(&self.parts, shape);
        let terms: f64 = self.parts.iter().map(|(_, stiffness)| sum_of_terms(stiffness, shape)).sum();
        let links = self.figure.shape(self.mechanism.as_mut(), &self.point, shape);
        let befores = std::iter::once(None).chain(links.iter().map(Some));
        for ((link, before), axial_n) in links.iter().zip(befores).zip(&self.axial_n) {
            take_out_tension(&mut energies, link, before, axial_n);
        }
        if energies.iter().map(|(_, energy)| energy).sum::<f64>() <= ROUNDING * terms {
            energies.clear();
        }
        energies.sort_by(|one, other| other.1.total_cmp(&one.1));
        Strain { whole: energies.iter().map(|(_, energy)| energy).sum(), energies, links }
    }

    /// The mode named after the part with the largest strain energy, or after its motion where little is strained.
    fn named(&self, eigenvalue: Complex<f64>, shape: DVector<Complex<f64>>, strain: Strain) -> Mode {
        let Strain { energies, whole, links } = strain;
        let held = twice_energy(&self.system.stiffness, &shape).abs();
        let in_base = energies.first().is_some_and(|(part, _)| *part == Part::Base) && whole >= BROUGHT_BACK * held;
        let decays = eigenvalue.im == 0.0 && eigenvalue.re < 0.0;
        let is_deformed = deformed_part(&links) >= DEFORMED;
        let is_overdamped = decays && (in_base || is_deformed);
        let rigid_part = self.rigid.of(&shape);
        // Tension may bring back what bends far more than strain does, as in a fast rotation.
        let bends = is_deformed && rigid_part < RIGID;
        let strained = whole > 0.0 && (whole >= STRAINED * eigenvalue.norm_sqr() || is_overdamped || bends);
        let is_brought_back = eigenvalue.im != 0.0 && whole >= BROUGHT_BACK * eigenvalue.norm_sqr();
        let kind = match energies.first() {
            _ if self.oscillates => Kind::Masses,
            _ if eigenvalue.norm() == 0.0 => Kind::Rotation,
            Some((part, _)) if strained && (*part == Part::Base || rigid_part < RIGID || is_brought_back) => {
                Kind::Vibration(*part)
            }
            _ if eigenvalue.im == 0.0 => Kind::Rotation,
            _ => Kind::Swing,
        };
        // Free motion strains nothing; what its shape strains is the rounding of the eigenvector.
        let shares = energies.into_iter().filter(|_| whole > 0.0 && eigenvalue.norm() > 0.0);
        let shares = shares.map(|(part, energy)| Share { part, share: energy / whole }).collect();
        let may_round = self.is_meshed && eigenvalue.norm() > 0.0;
        let rounded = || part_by(&self.system, eigenvalue, &shape, rounding(&self.system, &shape)).min(1.0);
        let rounding = if may_round { rounded() } else { 0.0 };
        Mode { kind, number: 1, eigenvalue, shape, shares, rigid_part, links, rounding }
    }
}

/// Turning of the chain with its links as they are.
struct RigidPart {
    inertia: Vec<f64>,
    whole: f64,
}

impl RigidPart {
    fn new(subject: &Subject, mechanism: &mut dyn Mechanism, point: &Point, system: &Linearised) -> Self {
        let (mut rigid, mut scratch) = (vec![0.0; point.q.len()], vec![0.0; point.q.len()]);
        if !subject.is_held() {
            mechanism.rigid_motion(&point.input, 1.0, &point.q, &mut rigid, &mut scratch);
        }
        let inertia = system.mass.times(&rigid);
        let whole = rigid.iter().zip(&inertia).map(|(v, p)| v * p).sum();
        RigidPart { inertia, whole }
    }

    /// `|φᴴ M v|²/(vᵀ M v)` for `φᴴ M φ = 1`.
    fn of(&self, shape: &DVector<Complex<f64>>) -> f64 {
        let along: Complex<f64> = shape.iter().zip(&self.inertia).map(|(x, p)| x * *p).sum();
        if self.whole > 0.0 { (along.norm_sqr() / self.whole).min(1.0) } else { 0.0 }
    }
}

/// Twice the strain energy of each part.
fn energies(parts: &[(Part, Band)], shape: &DVector<Complex<f64>>) -> Vec<(Part, f64)> {
    parts.iter().map(|(part, stiffness)| (*part, twice_energy(stiffness, shape).max(0.0))).collect()
}

/// The sum of the magnitudes of the terms of `φᴴ K φ`.
fn sum_of_terms(stiffness: &Band, shape: &DVector<Complex<f64>>) -> f64 {
    stiffness.iter().map(|(i, j, value)| shape[i].norm() * shape[j].norm() * value.abs()).sum()
}

/// `φᴴ K φ`.
fn twice_energy(stiffness: &Band, shape: &DVector<Complex<f64>>) -> f64 {
    let half = |part: fn(&Complex<f64>) -> f64| -> f64 {
        let x: Vec<f64> = shape.iter().map(part).collect();
        stiffness.times(&x).iter().zip(&x).map(|(force, x)| force * x).sum()
    };
    half(|x| x.re) + half(|x| x.im)
}

#[cfg(test)]
mod tests {
    use std::error::Error;

    use super::{Mode, modes};
    use crate::scene::SceneSource;
    use crate::small_motion::Subject;

    /// An arm with a mass at its tip: vibrations that are damped more than twice critically were called `chain rotation`.
    #[test]
    fn regress_a_vibration_that_only_decays_is_no_rotation() -> Result<(), Box<dyn Error>> {
        let arm = "[beam]\nlength_m = 1.1\nsection = { shape = \"tube\", outer_m = 0.03, inner_m = 0.026 }\n\
                   density_kg_per_m3 = 7850\nyoungs_modulus_pa = 2.1e11\nelements = 8\nmodes = 3\n[tip]\nmass_kg = 2.5\n[base]\n";
        for model in ["modal", "finite-element", "rigid"] {
            // Spring, damper and material damping, and the rotations among the modes: with a spring none, without it the damped one.
            for (base, rotations) in [
                (["8000.0", "20.0", "1e-4"], &[][..]),
                (["8000.0", "2000.0", "1e-4"], &[]),
                (["8000.0", "0.0", "5e-3"], &[]),
                (["0.0", "20.0", "1e-4"], &["chain rotation", "chain rotation 2"]),
                (["0.0", "20.0", "5e-3"], &["chain rotation", "chain rotation 2"]),
            ] {
                let [spring, damper, damping] = base;
                let given = [
                    format!("solver.model={model}"),
                    format!("base.torsion_spring_nm_per_rad={spring}"),
                    format!("base.damper_nm_s_per_rad={damper}"),
                    format!("beam.damping_s={damping}"),
                ];
                let subject = Subject::new(&SceneSource::parse("arm.toml", arm, &given)?.scene, None)?;
                let found = modes(&subject, &subject.at_rest(0.0)?, 8)?;
                let names: Vec<String> = found.iter().map(Mode::name).collect();
                let turning: Vec<&String> = names.iter().filter(|name| name.contains("chain")).collect();
                assert_eq!(turning, rotations, "{model}, {base:?}: {names:?}");
            }
        }
        Ok(())
    }

    /// Weight brings it back, not a spring that is next to nothing.
    #[test]
    fn regress_an_overdamped_swing_is_no_torsion_of_a_weak_spring() -> Result<(), Box<dyn Error>> {
        let arm = "[beam]\nlength_m = 1.1\nrigid = true\nmass_kg = 2\n[base]\ntorsion_spring_nm_per_rad = 1e-9\n\
                   damper_nm_s_per_rad = 200\n[gravity]\ny_m_per_s2 = -9.81\n";
        let subject = Subject::new(&SceneSource::parse("arm.toml", arm, &[])?.scene, None)?;
        let found = modes(&subject, &subject.at_rest(-std::f64::consts::FRAC_PI_2)?, 2)?;
        assert_eq!(found.iter().map(Mode::name).collect::<Vec<_>>(), ["chain rotation", "chain rotation 2"]);
        Ok(())
    }
}
