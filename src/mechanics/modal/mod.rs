//! Links in floating frames on their chords, with pinned–pinned sine modes and foreshortening: the everyday real-time model.
//!
//! **Field.** In the frame of the chord (first pin, angle β) a link's points stand at `x = cξ + Σ a_f sin fπξ`,
//! `y = Σ η_i sin iπξ + η_χ χ(ξ)`. χ is what the sines leave of the static shape of a moment at the first end; the first link
//! has it, since torque, spring, damper and prescribed motion act on its tangent there, `β + y'(0)` (`shapes`).
//!
//! **Foreshortening.** An inextensible line has `x' = √(1 − w'²)`: chord and axial field follow from the bending, von Kármán's
//! `−½ w'²` in all of the field and `−⅛ w'⁴` in the chord, so that compression softens and buckles, rotation and tension
//! stiffen (`link`). Bending energy has the exact curvature to fourth order, `½ EJ ∫ w''² (1 + w'²)` (`strong`). With
//! `axial` the chord and one half-wave may stretch as well.
//!
//! **Equations.** With the global vectors `z = (A, R u_f)` of pins and functions the kinetic energy is `½ żᵀMż` with a constant
//! `M`: no gyroscopic terms but those of `z̈ = J q̈ + J̇ q̇`. The pins are shared, the last link's angle follows from its slider
//! on `y = 0`, and `r = Jᵀ(M z̈ − loads) + elasticity` is swept from the end to the pivot, which leaves every joint force
//! behind (`chain`). The tangent is exact (`tangent`).
//!
//! **What bounds its accuracy**, measured on R2s (chord angle over 2 s; slopes to 0.09), in rad:
//!
//! | modes a link | linear curvature | exact curvature | and `axial` |
//! |---|---|---|---|
//! | 2 | 6.5e-3 | 2.7e-3 | 2.3e-3 |
//! | 3 | 7.7e-3 | 8.3e-4 | 3.9e-4 |
//! | 4 | 8.0e-3 | 5.6e-4 | 1.0e-4 |
//!
//! So the floor of 8e-3 of the usual model is its linear curvature, which makes strong vibration too slow; below that lies
//! extensibility (4e-4). Letting the axial field be linear in ξ costs 2e-3; χ changes the chord by 5 % of the error, but is what
//! makes the root's tangent right.
//!
//! **Where it stops.** Terms beyond the fourth order in the slope are gone: deflections above a tenth of the length are flagged
//! (`observe`). Sections keep no rotary inertia and no shear.

mod chain;
mod elastic;
mod energy;
mod fitted;
mod frame;
mod line;
mod link;
mod loads;
mod observe;
mod plane;
mod shapes;
mod start;
mod station;
mod strong;
mod tangent;
mod values;
mod variation;

use super::mechanism::{ChainModel, Coordinate, Input, Measure, Mechanism, NoEquilibrium, ROTATIONS, Singular, Weights};
use super::observation::{Energy, Observation};
use crate::scene;
use fitted::Fitted;

/// The `modal` model of a chain, with as much room for shape functions as its links need, so that the compiler knows the length of
/// loops over them.
pub struct Modal {
    fitted: Box<dyn Mechanism>,
}

impl Modal {
    /// The model of a chain; `prescribed` when the scene prescribes the motion of the first link's tangent at the pivot.
    pub fn new(chain: &scene::Chain, prescribed: bool) -> Self {
        let fitted: Box<dyn Mechanism> = match chain.links.iter().map(link::functions).max() {
            None | Some(..=4) => Box::new(Fitted::<4>::new(chain, prescribed)),
            Some(5..=6) => Box::new(Fitted::<6>::new(chain, prescribed)),
            Some(7..=8) => Box::new(Fitted::<8>::new(chain, prescribed)),
            Some(9..=10) => Box::new(Fitted::<10>::new(chain, prescribed)),
            Some(11..=12) => Box::new(Fitted::<12>::new(chain, prescribed)),
            Some(13..=14) => Box::new(Fitted::<14>::new(chain, prescribed)),
            Some(_) => Box::new(Fitted::<MOST_FUNCTIONS>::new(chain, prescribed)),
        };
        Self { fitted }
    }
}

/// Shape functions of a link with the most modes that a scene may ask for.
const MOST_FUNCTIONS: usize = 22;

impl Mechanism for Modal {
    fn degrees_of_freedom(&self) -> usize {
        self.fitted.degrees_of_freedom()
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        self.fitted.coordinates()
    }

    fn start(&mut self, input: &Input, q: &mut [f64], v: &mut [f64]) -> Result<(), NoEquilibrium> {
        self.fitted.start(input, q, v)
    }

    fn residual(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        self.fitted.residual(input, q, v, a, r);
    }

    fn residual_size(&self, r: &[f64]) -> f64 {
        self.fitted.residual_size(r)
    }

    fn factor(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights) -> Result<(), Singular> {
        self.fitted.factor(input, q, v, a, w)
    }

    fn tangent(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        self.fitted.tangent(input, q, v, a, w, entry);
    }

    fn rigid_motion(&mut self, input: &Input, rate_rad_per_s: f64, q: &[f64], v: &mut [f64], a: &mut [f64]) {
        self.fitted.rigid_motion(input, rate_rad_per_s, q, v, a);
    }

    fn solve(&mut self, x: &mut [f64]) {
        self.fitted.solve(x);
    }

    fn factor_over_correction(&self) -> f64 {
        self.fitted.factor_over_correction()
    }

    fn observe(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], out: &mut Observation) {
        self.fitted.observe(input, q, v, a, out);
    }

    fn energy(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> Energy {
        self.fitted.energy(input, q, v, a)
    }

    fn measure(&self, q: &[f64], dq: &[f64]) -> Option<Measure> {
        self.fitted.measure(q, dq)
    }

    fn chords(&self, q: &[f64], v: &[f64]) -> [[f64; 2]; ROTATIONS] {
        self.fitted.chords(q, v)
    }

    fn turn_part(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64], link: usize, part: &mut [f64]) -> bool {
        self.fitted.turn_part(input, q, v, a, link, part)
    }

    fn power(&mut self, input: &Input, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 2] {
        self.fitted.power(input, q, v, a)
    }

    fn as_chain(&mut self) -> Option<&mut dyn ChainModel> {
        self.fitted.as_chain()
    }
}
