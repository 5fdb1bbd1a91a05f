//! Natural frequencies of small motion about the start.

use std::f64::consts::TAU;

use super::{Motion, Simulation};

/// Most unknowns for which all eigenvalues are computed; the effort grows with the third power.
const MOST_UNKNOWNS: usize = 250;
/// Eigenvalues below this part of the largest are free motion: the crank turns, and nothing vibrates. Differences leave them at
/// some 1e-6 of the largest instead of 0.
const FREE: f64 = 3e-5;

/// Undamped vibrations about the start position, at rest there: of the eigenvalues μ of `M ẍ + K x = 0`, a pair `±i ω` is a
/// vibration of the natural frequency ω.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmallMotion {
    /// Lowest and highest natural frequency, Hz; `None` if nothing vibrates.
    pub frequencies_hz: Option<[f64; 2]>,
    /// Number of vibrations.
    pub vibrations: usize,
}

impl Simulation {
    /// Number of unknowns, the degrees of freedom; `None` if the model has no such number.
    pub fn unknowns(&self) -> Option<usize> {
        self.engine.unknowns()
    }

    /// The present state and loads; `None` if the model is no system of second order, or has no finite accelerations.
    pub fn motion(&mut self) -> Option<Motion> {
        let time_s = self.time_s();
        self.engine.motion(&self.law, time_s)
    }

    /// Vibrations about the start; `None` if the model has too many unknowns or no tangent.
    pub fn small_motion(&mut self) -> Option<SmallMotion> {
        let few = self.unknowns()? <= MOST_UNKNOWNS;
        few.then(|| self.engine.eigenvalues(&self.law)).flatten().map(SmallMotion::new)
    }
}

impl SmallMotion {
    fn new(eigenvalues: Vec<[f64; 2]>) -> Self {
        let magnitude = |[re, im]: &[f64; 2]| re.hypot(*im);
        let largest = eigenvalues.iter().map(magnitude).fold(0.0, f64::max);
        // One of each conjugate pair.
        let vibrations = eigenvalues.iter().filter(|[_, im]| *im > FREE * largest);
        let mut frequencies: Vec<f64> = vibrations.map(|pair| magnitude(pair) / TAU).collect();
        frequencies.sort_by(f64::total_cmp);
        let ends = frequencies.first().zip(frequencies.last());
        SmallMotion { frequencies_hz: ends.map(|(&lowest, &highest)| [lowest, highest]), vibrations: frequencies.len() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    fn small_motion(scene: &str, overrides: &[&str]) -> Result<SmallMotion, Box<dyn std::error::Error>> {
        let overrides: Vec<String> = overrides.iter().map(|&given| given.to_owned()).collect();
        let source = SceneSource::open(scene, &overrides)?;
        Ok(Simulation::new(&source.scene)?.small_motion().ok_or("no eigenvalues")?)
    }

    /// A cantilever: β₁ L = 1.87510407 in f = (β₁ L)² √(E I / ρ A) / (2π L²).
    #[test]
    fn val_the_lowest_frequency_of_a_cantilever() -> Result<(), Box<dyn std::error::Error>> {
        let clamped = ["solver.model=finite-element", "solver.integrator=generalized-alpha", "beam.elements=8", "pulse=[]"];
        let clamped = [&clamped[..], &["drive.speed_rad_per_s=0"]].concat();
        let found = small_motion("thesis-beam", &clamped)?;
        let lowest_hz = found.frequencies_hz.ok_or("nothing vibrates")?[0];
        let exact_hz = 1.875_104_07_f64.powi(2) * f64::sqrt(2.1e11 * 1e-5 / (7700.0 * 0.01)) / (TAU * 0.25);
        assert!((lowest_hz / exact_hz - 1.0).abs() < 1e-5, "{lowest_hz} for {exact_hz}");
        Ok(())
    }

    /// Two masses on springs: x of the exact solution k − m ω² singular.
    #[test]
    fn val_the_frequencies_of_an_oscillator() -> Result<(), Box<dyn std::error::Error>> {
        let two = ["oscillator.masses_kg=[1.0,2.0]", "oscillator.springs=[[0,1,300.0],[1,2,200.0]]"];
        let found = small_motion("thesis-two-masses", &two)?;
        let Some([lowest_hz, highest_hz]) = found.frequencies_hz else { return Err("nothing vibrates".into()) };
        // det([500 − ω², −200; −200, 200 − 2 ω²]) = 2 ω⁴ − 1200 ω² + 60000
        let root = (1200.0_f64.powi(2) - 8.0 * 60000.0).sqrt();
        for (found_hz, square) in [(lowest_hz, (1200.0 - root) / 4.0), (highest_hz, (1200.0 + root) / 4.0)] {
            assert!((found_hz * TAU / square.sqrt() - 1.0).abs() < 1e-6, "{found_hz} for {square}");
        }
        assert_eq!(found.vibrations, 2);
        Ok(())
    }

    /// The crank turns freely: all other unknowns vibrate.
    #[test]
    fn prop_free_motion_is_no_vibration() -> Result<(), Box<dyn std::error::Error>> {
        for overrides in [&[][..], &["solver.model=finite-element", "solver.integrator=generalized-alpha"]] {
            let source =
                SceneSource::open("crank-slider", &overrides.iter().map(|&given: &&str| given.to_owned()).collect::<Vec<_>>())?;
            let mut simulation = Simulation::new(&source.scene)?;
            let found = simulation.small_motion().ok_or("no eigenvalues")?;
            assert_eq!(Some(found.vibrations + 1), simulation.unknowns(), "{found:?}");
        }
        assert_eq!(small_motion("crank-slider", &["solver.model=rigid"])?.frequencies_hz, None);
        Ok(())
    }
}
