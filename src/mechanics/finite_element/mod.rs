//! The `finite-element` model: Euler–Bernoulli beams of any rotation and bending, n elements a link.
//!
//! **Theory.** Strain energy `½∫ EA (|r′| − 1)² + EJ θ′² ds`, kinetic energy `½∫ ρA |ṙ|² ds` (no rotary inertia of the section),
//! cubic Hermite `r(s)` in nodal positions and slopes (absolute nodal coordinates, `beam`). Links share the position of their
//! pin, each with a slope of its own there; a rigid link is a vector of constant length in polar coordinates with its exact
//! masses (`rigid`). No constraint equation, so nothing drifts. `r = M q̈ + g(q, q̇) − p` is assembled slot by slot
//! (`layout`); reactions are that residual in the directions held.
//!
//! **Why this element.** Against the co-rotational element with its own bow in strain and inertia (Le, Battini & Hjiaj 2011) on
//! R2s (thesis bars with `J = 8.333e-10`, smooth pulse), largest error of the crank's chord angle over 2 s, two-point ϑ = ½,
//! `h` = 1e-4, both measured from this element with 64 elements a link:
//!
//! | elements a link | 2 | 4 | 8 | 16 | one residual, one element |
//! |---|---|---|---|---|---|
//! | co-rotational, linear strain, cubic inertia | | | 9.5e-4 | | |
//! | co-rotational, bowed strain, cubic inertia (4 Gauss points) | 4.0e-2 | 3.3e-3 | 2.3e-4 | 1.5e-5 | 126 ns |
//! | this one, consistent mass | 4.1e-2 | 3.4e-3 | 2.4e-4 | 1.5e-5 | 45–70 ns |
//! | this one (as it is, with the mass of `beam`) | 2.3e-2 | 1.1e-3 | 6.0e-5 | 3.6e-6 | the same |
//!
//! With a consistent mass, accuracy and order (4.0) are the same; so cost decides. A residual takes less than half the time (of a plain
//! prototype, with `atan2` in every element: some of that could be had back), and the mass matrix is constant, where the co-rotational
//! tangent needs derivatives of inertia. Against that stand four unknowns a node instead of three. A tuned co-rotational tangent and
//! factorization were not built, so the whole step was not compared. This one: residual 45, factorization with assembly 150,
//! solution 32 ns an element, on one shared core.
//!
//! Quadrature decides much: the same element with a consistent mass, 4 and 8 elements a link, errs by 3.4e-3, 2.4e-4 with Simpson's
//! points for the membrane and two Gauss points for bending (as here; three for bending gain 2 %), by 6.8e-3, 3.7e-4 with 3 Gauss points and 2,
//! and by 1.0e-2, 4.3e-4 with 5 and 3, which are the reference's own figures. Two Gauss points for the membrane leave a mode of
//! strain without energy, and Newton's iteration fails.
//!
//! **Limits.** Where steps are long for membrane vibration and bars slender, schemes without damping lose stability: two-point
//! ϑ = ½ and generalised-α with ρ∞ = 1 alike, and nearly at the same time (R2 at `h` = 1e-3; a slender cantilever turning with 400
//! steps a turn or fewer). ρ∞ = 0.5 and 0.8 held R2 with 4 to 64 elements, 0.95 not with 4; ϑ = 0.51 held with 4, 16 and 64.

mod band;
mod beam;
mod energy;
mod hub;
mod layout;
mod line;
mod loads;
mod measure;
mod member;
mod motion;
mod names;
mod observe;
mod place;
mod polar;
mod residual;
mod rigid;
mod start;
mod strain;
mod tangent;
mod turn;

use nalgebra::Vector2;

use self::band::Band;
use self::layout::Layout;
use self::loads::EndLoad;
use self::member::Member;
use self::motion::Motion;
use self::residual::Work;
use self::tangent::Coupling;
use super::last_state::LastState;
use super::mechanism::{ChainModel, Coordinate, Input, Measure, Mechanism, NoEquilibrium, ROTATIONS, Singular, Weights};
use super::observation::{Energy, Observation};
use crate::scene::Chain;

/// The chain as a system of second order in its nodes' positions and slopes.
#[derive(Debug, Clone)]
pub struct FiniteElement {
    chain: Chain,
    layout: Layout,
    members: Vec<Member>,
    end: EndLoad,
    gravity: Vector2<f64>,
    last: LastState,
    motion: Motion,
    /// Forces on each slot's coordinates that the motion needs, from outside the links and their end.
    forces: Vec<Vector2<f64>>,
    /// Room for momenta beside them.
    momenta: Vec<Vector2<f64>>,
    /// Forces that the members need.
    work: Work,
    /// With what acts at the base.
    at_work: Work,
    rounding: Work,
    band: Band,
    unknown: Vec<Vector2<f64>>,
    coupling: Option<Coupling>,
}

impl FiniteElement {
    /// The model of a chain; `prescribed` when the scene prescribes the motion of the first link's tangent at the pivot.
    pub fn new(chain: &Chain, prescribed: bool) -> Self {
        let layout = Layout::new(chain, prescribed);
        let members = Member::all(chain, &layout);
        let band = Band::new(layout.slots());
        let end = EndLoad::new(&chain.end);
        let reach_m: f64 = chain.links.iter().map(|link| link.length_m).sum();
        Self {
            last: LastState::new(layout.active.len()),
            motion: Motion::new(chain, &layout),
            forces: vec![Vector2::zeros(); layout.slots()],
            momenta: vec![Vector2::zeros(); layout.slots()],
            work: Work::default(),
            at_work: Work::default(),
            rounding: Work::rounding(&members, reach_m),
            unknown: vec![Vector2::zeros(); band.padded()],
            coupling: Coupling::new(&end, &layout),
            gravity: Vector2::from(chain.gravity_m_per_s2),
            chain: chain.clone(),
            layout,
            members,
            end,
            band,
        }
    }

    /// Brings motion and forces to a state, unless they are there.
    fn evaluate(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) {
        if self.last.lacks_forces(input, q, v, a) {
            self.motion.load(&self.layout, input, q, v, a);
            self.add_forces();
        }
    }

    /// Brings motion to a state, without its forces, unless both are there.
    fn locate(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) {
        if self.last.lacks_motion(input, q, v, a) {
            self.motion.load(&self.layout, input, q, v, a);
        }
    }
}

impl Mechanism for FiniteElement {
    fn degrees_of_freedom(&self) -> usize {
        self.layout.active.len()
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        self.named_coordinates()
    }

    fn start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) -> Result<(), NoEquilibrium> {
        self.last.forget();
        self.set_start(input, q, v)
    }

    fn residual(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.evaluate(input, q, v, a);
        self.project(input, r);
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        self.at_work.relative(&self.rounding, &self.layout, r)
    }

    fn factor(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        self.evaluate(input, q, v, a);
        self.assemble(w);
        self.band.factor()?;
        self.couple(w)
    }

    fn tangent(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        self.evaluate(input, q, v, a);
        self.assemble(w);
        self.entries(w, entry);
    }

    fn rigid_motion(&mut self, input: &Input, rate_rad_per_s: f64, q: &[f64], v: &mut [f64], a: &mut [f64]) {
        self.last.forget();
        v.fill(0.0);
        self.motion.load(&self.layout, input, q, v, v);
        self.set_rates(input.motion.map_or(rate_rad_per_s, |[_, rate, _]| rate));
        self.store(|motion| &motion.v, |polar| polar.du, v);
        self.store(|motion| &motion.a, |polar| polar.ddu, a);
    }

    fn solve(&mut self, x: &mut [f64]) {
        self.solve_unknown(x);
    }

    fn observe(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], out: &mut Observation) {
        self.evaluate(input, q, v, a);
        self.fill(input, out);
    }

    fn energy(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> Energy {
        self.locate(input, q, v, a);
        self.energies()
    }

    fn measure(&self, q: &[f64], dq: &[f64]) -> Option<Measure> {
        Some(self.measured(q, dq))
    }

    fn chords(&self, q: &[f64], v: &[f64]) -> [[f64; 2]; ROTATIONS] {
        self.free_chords(q, v)
    }

    fn turn_part(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], link: usize, part: &mut [f64]) -> bool {
        let free = self.is_free(input, link);
        if free {
            self.locate(input, q, v, a);
            self.set_turn_part(link, part);
        }
        free
    }

    fn power(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 2] {
        if let (true, Some(root)) = (self.only_torque_works(), self.layout.root) {
            return [input.torque_nm * v[root], 0.0];
        }
        if input.motion.is_some() {
            self.evaluate(input, q, v, a);
        } else {
            self.locate(input, q, v, a);
        }
        self.powers(input)
    }

    fn as_chain(&mut self) -> Option<&mut dyn ChainModel> {
        Some(self)
    }
}
