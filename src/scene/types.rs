//! The validated scene: immutable, typed, SI units. Everything downstream reads this and nothing else.

/// A validated scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The mechanism or oscillator.
    pub system: System,
    /// The drive of the pivot: torque (pulses, a constant) or prescribed motion.
    pub drive: Drive,
    /// Limits for commands that arrive while running.
    pub commands: Commands,
    /// Model, integrator and step.
    pub solver: Solver,
    /// Levels of detail, from the best to the cheapest; empty if the scene has one only. The first is the scene itself.
    pub levels: Vec<Level>,
}

/// A level of detail: the scene with a few keys changed, for less cost and more error.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Its name.
    pub name: String,
    /// `KEY=VALUE` changes of the scene.
    pub changes: Vec<String>,
    /// Its error in the first link's chord angle, as `trade` measured it, rad.
    pub error_rad: Option<f64>,
}

/// The moving system: a chain of links, or masses on springs.
#[derive(Debug, Clone, PartialEq)]
pub enum System {
    /// Links, their end and their surroundings.
    Chain(Chain),
    /// Masses on a line.
    Oscillator(Oscillator),
}

/// Masses on a line joined by springs, from rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Oscillator {
    /// The masses, kg.
    pub masses_kg: Vec<f64>,
    /// The springs.
    pub springs: Vec<Spring>,
    /// Constant force on each mass, N.
    pub forces_n: Vec<f64>,
    /// Displacement of each mass at t = 0, m.
    pub start_m: Vec<f64>,
}

/// A spring between two masses, or a mass and ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Its two ends: masses are counted from 1, 0 is ground.
    pub ends: [usize; 2],
    /// Stiffness, N/m.
    pub stiffness_n_per_m: f64,
}

impl Scene {
    /// The chain of links, if that is what moves.
    pub fn chain(&self) -> Option<&Chain> {
        match &self.system {
            System::Chain(chain) => Some(chain),
            System::Oscillator(_) => None,
        }
    }
}

/// One or two links in series: a pivot at the origin, links joined by a pin, an end that is free or slides on y = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// The links from the pivot outwards: one (`[beam]`) or two (`[crank]`, `[rod]`).
    pub links: Vec<Link>,
    /// The end of the last link.
    pub end: End,
    /// Torsion spring and damper between ground and the first link's tangent at the pivot.
    pub base: Base,
    /// Acceleration of gravity (x, y), m/s².
    pub gravity_m_per_s2: [f64; 2],
    /// The state at t = 0.
    pub start: Start,
}

/// A link of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LinkName {
    /// The driven link of a crank-slider.
    Crank,
    /// The link between crank pin and slider pin.
    Rod,
    /// The only link of a one-link chain.
    Beam,
}

impl LinkName {
    /// The name in scene files and messages.
    pub fn as_str(self) -> &'static str {
        match self {
            LinkName::Crank => "crank",
            LinkName::Rod => "rod",
            LinkName::Beam => "beam",
        }
    }
}

/// One link: a straight, slender, uniform beam, or a rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Its name.
    pub name: LinkName,
    /// Undeformed length between its pins, m.
    pub length_m: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Distance of the centre of mass from the link's first pin, along the link, m.
    pub centre_of_mass_m: f64,
    /// Moment of inertia about the centre of mass, kg·m². For a uniform bar `m L²/12` (no rotary inertia of the section).
    pub inertia_kg_m2: f64,
    /// Section and material where the scene gives them (a rigid link may do without).
    pub bar: Option<Bar>,
    /// Asked to be rigid, whatever the model.
    pub rigid: bool,
    /// Beam elements for models with a mesh; also the number of intervals between published nodes.
    pub elements: usize,
    /// Bending modes, for `modal`.
    pub modes: usize,
    /// Whether `modal` also carries axial flexibility.
    pub axial: bool,
    /// Stiffness-proportional damping: time constant c in σ = E (ε + c ε̇), s.
    pub damping_s: f64,
}

/// Section and material of a uniform bar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// Section area, m².
    pub area_m2: f64,
    /// Second moment of area about the bending axis, m⁴.
    pub second_moment_m4: f64,
    /// Density, kg/m³.
    pub density_kg_per_m3: f64,
    /// Young's modulus, Pa.
    pub youngs_modulus_pa: f64,
    /// Distance of the outermost fibre from the bending axis, m, where the scene gives the section's shape.
    pub extreme_fibre_m: Option<f64>,
}

impl Bar {
    /// Axial stiffness E A, N.
    pub fn axial_stiffness_n(&self) -> f64 {
        self.youngs_modulus_pa * self.area_m2
    }
    /// Bending stiffness E J, N·m².
    pub fn bending_stiffness_nm2(&self) -> f64 {
        self.youngs_modulus_pa * self.second_moment_m4
    }
    /// Mass per length ρ A, kg/m.
    pub fn mass_per_length_kg_per_m(&self) -> f64 {
        self.density_kg_per_m3 * self.area_m2
    }
}

/// The chain's far end.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// Free, with a point mass (0 for none).
    Free {
        /// Tip mass, kg.
        tip_mass_kg: f64,
    },
    /// A slider on the line y = 0.
    Slider(Slider),
}

/// The slider: its end of the rod is held on y = 0 by a frictionless guide, but for the viscous friction given.
#[derive(Debug, Clone, PartialEq)]
pub struct Slider {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Resistance force along −x, N.
    pub resistance: Resistance,
    /// Viscous friction against its velocity, N·s/m.
    pub friction_n_s_per_m: f64,
}

/// Resistance force on the slider, acting along −x when positive.
#[derive(Debug, Clone, PartialEq)]
pub enum Resistance {
    /// Constant, N.
    Constant(f64),
    /// Piecewise linear over the crank's chord angle modulo one revolution: `(angle_rad in [0, 2π), force_n)`, ascending, periodic.
    Table(Vec<[f64; 2]>),
}

/// The connection between ground and the first link at the pivot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Base {
    /// Torsion spring, N·m/rad, unstressed at crank angle 0.
    pub torsion_spring_nm_per_rad: f64,
    /// Viscous damper, N·m·s/rad.
    pub damper_nm_s_per_rad: f64,
}

/// State at t = 0: links straight, moving as rigid bodies; or bent as static equilibrium asks.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Start {
    /// Crank angle from the x axis, counter-clockwise, rad.
    pub angle_rad: f64,
    /// Crank rate, rad/s.
    pub rate_rad_per_s: f64,
    /// Whether the chain starts in static equilibrium with gravity and constant loads. With a base spring, the crank turns from
    /// `angle_rad` to where that balances them, too; without one, or with its motion prescribed, it is held there.
    pub static_equilibrium: bool,
}

/// The drive of the first link's tangent at the pivot.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// Torque: a constant, and pulses that the scene fires by itself.
    Torque {
        /// Constant torque, N·m.
        constant_nm: f64,
        /// Pulses of the scene.
        pulses: Vec<Pulse>,
    },
    /// Motion prescribed at the pivot's tangent (a rigid crank: the crank); the torque it needs is an output.
    Motion(Motion),
}

/// A torque pulse at the pivot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Start, s of simulated time.
    pub start_s: f64,
    /// Mean torque over its duration, N·m.
    pub torque_nm: f64,
    /// Its duration, s.
    pub duration_s: f64,
    /// Its shape.
    pub shape: PulseShape,
}

/// Shape of a torque pulse; both deliver the angular impulse `torque_nm · duration_s`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PulseShape {
    /// Constant at `torque_nm`.
    Rectangular,
    /// `torque_nm · (1 − cos(2π s / duration))`: peak twice the mean; does not ring every mode.
    RaisedCosine,
}

/// Prescribed motion of the pivot's tangent.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// Constant speed from the start angle, rad/s.
    Speed(f64),
    /// Speed from the start rate to `to_rad_per_s` over `over_s` by a half-cosine, then constant.
    Ramp {
        /// Final speed, rad/s.
        to_rad_per_s: f64,
        /// Duration of the change, s.
        over_s: f64,
    },
    /// `(time_s, angle_rad)` ascending, interpolated by a cubic spline, natural at its ends, but at rest at an end whose two rows
    /// have one angle; the last rate goes on.
    Table(Vec<[f64; 2]>),
}

/// Bounds for commands from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commands {
    /// Largest mean |torque| of a pulse and largest |torque| of a setpoint, N·m. A raised-cosine pulse peaks at twice its mean.
    pub torque_limit_nm: f64,
    /// Most pulses that may be pending or acting at once.
    pub pending_limit: usize,
}

/// Model, integrator and step of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solver {
    /// Model of the chain.
    pub model: ModelKind,
    /// Time integrator.
    pub integrator: IntegratorKind,
    /// Step, s.
    pub step_s: f64,
    /// The two-point method's weight ϑ, 0 to 1.
    pub weight: f64,
    /// Generalised-α's spectral radius at infinite frequency, 0 to 1.
    pub rho_infinity: f64,
    /// Newton's tolerance on the residual, relative to the forces at work.
    pub tolerance: f64,
    /// Largest energy balance, as a part of the energy in play, at which a run is still to be trusted.
    pub balance_tolerance: f64,
    /// Most Newton iterations in one step.
    pub max_iterations: usize,
    /// Newton corrections in every stage of a step of fixed cost, 0 with a method that does not iterate; `None` iterates to the
    /// tolerance.
    pub corrections: Option<usize>,
}

/// The ladder of models.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ModelKind {
    /// Rigid links, one degree of freedom.
    Rigid,
    /// The thesis's incremental linear elements.
    Incremental,
    /// Floating frames with bending modes.
    Modal,
    /// Nonlinear beam elements.
    FiniteElement,
    /// Masses and springs, for an oscillator.
    MassSpring,
}

/// The integrators.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum IntegratorKind {
    /// The two-point method with weight ϑ.
    TwoPoint,
    /// Generalised-α (Chung & Hulbert 1993).
    GeneralizedAlpha,
    /// Classical explicit Runge–Kutta, fourth order.
    RungeKutta,
    /// Diagonally implicit Runge–Kutta of fourth order, ESDIRK4(3)6L\[2\]SA (Kennedy & Carpenter 2003).
    Esdirk,
}

impl ModelKind {
    /// The word in scene files.
    pub fn as_str(self) -> &'static str {
        match self {
            ModelKind::Rigid => "rigid",
            ModelKind::Incremental => "incremental",
            ModelKind::Modal => "modal",
            ModelKind::FiniteElement => "finite-element",
            ModelKind::MassSpring => "mass-spring",
        }
    }

    /// The integrators that suit the model, the usual one first.
    pub fn integrators(self) -> &'static [IntegratorKind] {
        use IntegratorKind::{Esdirk, GeneralizedAlpha, RungeKutta, TwoPoint};
        match self {
            ModelKind::Rigid => &[RungeKutta, TwoPoint, GeneralizedAlpha, Esdirk],
            ModelKind::Incremental => &[TwoPoint],
            ModelKind::Modal => &[GeneralizedAlpha, TwoPoint, RungeKutta, Esdirk],
            ModelKind::FiniteElement => &[GeneralizedAlpha, TwoPoint, Esdirk],
            ModelKind::MassSpring => &[TwoPoint, GeneralizedAlpha, RungeKutta, Esdirk],
        }
    }

    /// The default integrator of a model.
    pub fn usual_integrator(self) -> IntegratorKind {
        self.integrators()[0]
    }

    /// Whether the model's steps are solved by iteration with its default integrator.
    pub fn usually_iterates(self) -> bool {
        iterates(self, self.usual_integrator())
    }
}

impl IntegratorKind {
    /// The word in scene files.
    pub fn as_str(self) -> &'static str {
        match self {
            IntegratorKind::TwoPoint => "two-point",
            IntegratorKind::GeneralizedAlpha => "generalized-alpha",
            IntegratorKind::RungeKutta => "runge-kutta",
            IntegratorKind::Esdirk => "esdirk",
        }
    }

    /// Its order on smooth problems; that of the two-point method holds for ϑ = ½.
    pub fn order(self) -> u32 {
        match self {
            IntegratorKind::TwoPoint | IntegratorKind::GeneralizedAlpha => 2,
            IntegratorKind::RungeKutta | IntegratorKind::Esdirk => 4,
        }
    }
}

impl Solver {
    /// Whether steps are solved by iteration.
    pub fn iterates(&self) -> bool {
        iterates(self.model, self.integrator)
    }
}

fn iterates(model: ModelKind, integrator: IntegratorKind) -> bool {
    model != ModelKind::Incremental && integrator != IntegratorKind::RungeKutta
}
