//! Crank-sliders drawn at random.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use flexcrank::scene::{IntegratorKind, ModelKind};

use crate::LOOKS;

/// Fastest crank, as a part of a link's first natural frequency.
const FASTEST: f64 = 0.3;
/// Largest torque, as a part of what bends a link by a radian.
const STRONGEST: f64 = 1.0;

/// Numbers in a fixed order (SplitMix64).
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        Numbers(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Evenly from 0 to 1.
    fn part(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.part()
    }

    /// Evenly in the logarithm.
    fn wide(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.part())
    }

    fn chance(&mut self, part: f64) -> bool {
        self.part() < part
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.part() * all.len() as f64) as usize]
    }
}

/// A scene and how to run it.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Everything but the integrator and its step.
    pub scene: String,
    pub model: ModelKind,
    pub integrator: IntegratorKind,
    /// Settings of the integrator.
    pub settings: String,
    pub step_s: f64,
    /// Steps from one look to the next.
    pub between: usize,
}

impl Drawn {
    /// Scene number `seed`.
    pub fn new(seed: u64) -> Self {
        let mut numbers = Numbers::new(seed);
        let model = numbers.one_of(&[
            ModelKind::Rigid,
            ModelKind::Modal,
            ModelKind::Modal,
            ModelKind::FiniteElement,
            ModelKind::FiniteElement,
        ]);
        let integrator = numbers.one_of(model.integrators());
        let settings = match integrator {
            IntegratorKind::TwoPoint => format!("solver.weight={}", numbers.one_of(&[0.5, 0.5, 0.55, 1.0])),
            IntegratorKind::GeneralizedAlpha => {
                format!("solver.rho_infinity={}", numbers.one_of(&[0.0, 0.5, 0.8, 0.8, 0.9, 1.0]))
            }
            _ => "solver.model=".to_owned() + model.as_str(),
        };
        let step_s = numbers.wide(1e-5, 5e-3);
        let between = numbers.wide(3.0, 60.0).round() as usize;
        let until_s = step_s * (between * LOOKS) as f64;
        Drawn { scene: scene(&mut numbers, until_s), model, integrator, settings, step_s, between }
    }

    /// The overrides of a run of the same scene.
    pub fn overrides(&self, integrator: IntegratorKind, settings: &str, step_s: f64) -> Vec<String> {
        let model = format!("solver.model={}", self.model.as_str());
        let scheme = format!("solver.integrator={}", integrator.as_str());
        vec![model, scheme, settings.to_owned(), format!("solver.step_s={step_s:?}")]
    }
}

/// A crank-slider that turns by up to a turn in `until_s`, by a start, by a pulse, or by both.
fn scene(numbers: &mut Numbers, until_s: f64) -> String {
    let crank_m = numbers.wide(0.03, 1.0);
    let rod_m = crank_m * numbers.between(1.3, 6.0);
    let density = numbers.wide(1000.0, 8000.0);
    // Fast where the run is short, but below what tears it apart.
    let mut speed = numbers.wide(0.3, TAU) / until_s;
    let mut most_nm = f64::INFINITY;
    let (mut text, mut mass_kg, mut inertia) = (String::new(), 0.0, 0.0);
    for (name, length) in [("crank", crank_m), ("rod", rod_m)] {
        let height = length / numbers.wide(15.0, 150.0);
        let width = height * numbers.wide(0.5, 2.0);
        let young = numbers.wide(1e9, 2.1e11);
        let (area, bending) = (height * width, young * width * height.powi(3) / 12.0);
        let link_kg = density * length * area;
        inertia += link_kg * crank_m * crank_m * if name == "crank" { 1.0 / 3.0 } else { 0.7 };
        mass_kg += link_kg;
        // A part of its first natural frequency, between pins; and of what bends it by a radian.
        speed = speed.min(FASTEST * (PI / length).powi(2) * (bending / (density * area)).sqrt());
        most_nm = f64::min(most_nm, STRONGEST * bending * crank_m / (length * length));
        text += &link(numbers, name, length, [width, height], [density, young]);
    }
    let slider_kg = if numbers.chance(0.2) { 0.0 } else { mass_kg * numbers.wide(0.03, 3.0) };
    inertia += 0.5 * slider_kg * crank_m * crank_m;
    let friction = if numbers.chance(0.5) { 0.0 } else { numbers.wide(1e-3, 3.0) * (mass_kg + slider_kg) / until_s };
    let _ = write!(text, "[slider]\nmass_kg = {slider_kg:?}\nfriction_n_s_per_m = {friction:?}\n");
    if numbers.chance(0.5) {
        let _ = write!(text, "[base]\ndamper_nm_s_per_rad = {:?}\n", numbers.wide(1e-3, 3.0) * inertia / until_s);
    }
    if numbers.chance(0.3) {
        text += "[gravity]\ny_m_per_s2 = -9.81\n";
    }
    let rate = if numbers.chance(0.5) { 0.0 } else { speed * numbers.between(-1.0, 1.0) };
    let _ = write!(text, "[start]\nangle_rad = {:?}\nrate_rad_per_s = {rate:?}\n", numbers.between(0.0, TAU));
    for _ in 0..if rate == 0.0 { 1 } else { numbers.one_of(&[0, 1, 2]) } {
        text += &pulse(numbers, until_s, inertia * speed, most_nm);
    }
    text
}

fn link(numbers: &mut Numbers, name: &str, length: f64, [width, height]: [f64; 2], [density, young]: [f64; 2]) -> String {
    let damping_s = if numbers.chance(0.2) { 0.0 } else { numbers.wide(1e-6, 1e-2) };
    let (modes, elements) = (numbers.wide(1.0, 8.99) as usize, numbers.wide(1.0, 16.99) as usize);
    format!(
        "[{name}]\nlength_m = {length:?}\nsection = {{ shape = \"rectangle\", width_m = {width:?}, height_m = {height:?} }}\n\
         density_kg_per_m3 = {density:?}\nyoungs_modulus_pa = {young:?}\nmodes = {modes}\nelements = {elements}\n\
         axial = {}\ndamping_s = {damping_s:?}\n",
        numbers.chance(0.5)
    )
}

/// A pulse whose edges fall anywhere within steps.
fn pulse(numbers: &mut Numbers, until_s: f64, impulse_nm_s: f64, most_nm: f64) -> String {
    let duration_s = until_s * numbers.wide(0.01, 0.6);
    let start_s = if numbers.chance(0.4) { 0.0 } else { numbers.between(0.0, 0.4) * until_s };
    let shape = numbers.one_of(&["rectangular", "raised-cosine"]);
    let torque_nm = (impulse_nm_s * numbers.between(-1.0, 1.0) / duration_s).clamp(-most_nm, most_nm);
    format!("[[pulse]]\nstart_s = {start_s:?}\ntorque_nm = {torque_nm:?}\nduration_s = {duration_s:?}\nshape = \"{shape}\"\n")
}
