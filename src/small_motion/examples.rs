//! Systems for tests.

use super::periodic::PeriodicSystem;
use crate::integrate::{Singular, System, Weights};
use crate::mechanics::{FiniteElement, Modal};
use crate::scene::{Chain, Scene, SceneSource};

/// Hill's equation `ẍ + d ẋ + (a − 2 q cos 2t) x = 0`, of period π; Mathieu's for `d = 0` (DLMF 28.2.1).
pub(super) struct Hill {
    pub(super) a: f64,
    pub(super) q: f64,
    pub(super) damper: f64,
    at_work: f64,
    tangent: f64,
}

impl Hill {
    pub(super) fn constant(stiffness: f64, damper: f64) -> Self {
        Hill { a: stiffness, q: 0.0, damper, at_work: 0.0, tangent: 0.0 }
    }

    pub(super) fn mathieu(a: f64, q: f64) -> Self {
        Hill { q, ..Hill::constant(a, 0.0) }
    }

    fn stiffness(&self, t_s: f64) -> f64 {
        self.a - 2.0 * self.q * (2.0 * t_s).cos()
    }
}

impl System for Hill {
    fn degrees_of_freedom(&self) -> usize {
        1
    }
    fn residual(&mut self, t_s: f64, q: &[f64], v: &[f64], a: &[f64], r: &mut [f64]) {
        let (viscous, elastic) = (self.damper * v[0], self.stiffness(t_s) * q[0]);
        self.at_work = a[0].abs() + viscous.abs() + elastic.abs();
        r[0] = a[0] + viscous + elastic;
    }
    fn residual_size(&self, r: &[f64]) -> f64 {
        if r[0] == 0.0 { 0.0 } else { r[0].abs() / self.at_work }
    }
    fn factor(&mut self, t_s: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights) -> Result<(), Singular> {
        self.tangent = w.acceleration + w.velocity * self.damper + w.position * self.stiffness(t_s);
        if self.tangent == 0.0 { Err(Singular) } else { Ok(()) }
    }
    fn solve(&mut self, x: &mut [f64]) {
        x[0] /= self.tangent;
    }
}

impl PeriodicSystem for Hill {
    fn tangent(&mut self, t_s: f64, _: &[f64], _: &[f64], _: &[f64], w: Weights, entry: &mut dyn FnMut(usize, usize, f64)) {
        entry(0, 0, w.acceleration);
        entry(0, 0, w.velocity * self.damper + w.position * self.stiffness(t_s));
    }
}

/// The chain of a built-in scene, without pulses.
pub(super) fn chain(scene: &str, overrides: &[&str]) -> Result<Chain, Box<dyn std::error::Error>> {
    let overrides: Vec<String> = overrides.iter().chain(&["pulse=[]"]).map(|&given| given.to_owned()).collect();
    let source = SceneSource::open(scene, &overrides)?;
    Ok(source.scene.chain().ok_or("no chain")?.clone())
}

pub(super) fn modal(chain: &Chain, prescribed: bool) -> Modal {
    Modal::new(chain, prescribed)
}

pub(super) fn finite_elements(chain: &Chain, prescribed: bool) -> FiniteElement {
    FiniteElement::new(chain, prescribed)
}

/// An arm of two carbon tubes that hang free, with a mass at the end.
const ARM: &str = r#"
[crank]
length_m = 0.3
section = { shape = "tube", outer_m = 0.004, inner_m = 0.003 }
density_kg_per_m3 = 1550.0
youngs_modulus_pa = 1.2e11
damping_s = 1e-5
elements = 4
[rod]
length_m = 0.25
section = { shape = "tube", outer_m = 0.004, inner_m = 0.003 }
density_kg_per_m3 = 1550.0
youngs_modulus_pa = 1.2e11
damping_s = 1e-5
elements = 4
[tip]
mass_kg = 0.08
"#;

/// That arm with overrides.
pub(super) fn arm(overrides: &[&str]) -> Result<Scene, Box<dyn std::error::Error>> {
    let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
    Ok(SceneSource::parse("arm.toml", ARM, &overrides)?.scene)
}
