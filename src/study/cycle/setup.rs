//! The machine and its rotation, from scene and options.

use std::f64::consts::TAU;

use super::machine::{CycleInstant, Machine};
use super::units::Units;
use super::{CycleError, Options};
use crate::scene::{Chain, Drive, End, Motion, Resistance, Scene, SceneSource};
use crate::simulation::drive_at_start;

/// A rate below this part of a table's fastest one is 0 but for rounding.
const ROUNDING: f64 = 1e-9;

/// One ratio of one scene, ready to turn.
pub(super) struct Setup {
    pub ratio: f64,
    pub rod_m: f64,
    pub chain: Chain,
    pub slider_kg: f64,
    pub spin: CrankRotation,
}

/// Rotation of the crank: `θ̈` constant, so `θ̇² = ω² + 2 θ̈ θ`.
#[derive(Debug, Clone, Copy)]
pub(super) struct CrankRotation {
    pub speed: f64,
    pub acceleration: f64,
}

impl Setup {
    /// One setup a ratio, the options checked.
    pub fn all(source: &SceneSource, options: &Options) -> Result<Vec<Self>, CycleError> {
        if !(3..=1_000_000).contains(&options.points) {
            return Err(CycleError::Points(options.points));
        }
        let spin = CrankRotation::new(&source.scene, options)?;
        let [_, rod_m] = lengths_m(source)?;
        if options.ratios.is_empty() {
            return Ok(vec![Self::new(source, options, spin, None)?]);
        }
        let with = |&ratio: &f64| {
            if !(ratio > 0.0 && ratio < 1.0) {
                return Err(CycleError::Ratio(ratio));
            }
            let key = format!("crank.length_m={:?}", ratio * rod_m);
            let source = source.with(&[key])?;
            Self::new(&source, options, spin, Some(ratio))
        };
        options.ratios.iter().map(with).collect()
    }

    fn new(source: &SceneSource, options: &Options, spin: CrankRotation, ratio: Option<f64>) -> Result<Self, CycleError> {
        let [crank_m, rod_m] = lengths_m(source)?;
        let mut chain = crank_slider(source)?.clone();
        let mut slider_kg = 0.0;
        if let End::Slider(slider) = &mut chain.end {
            slider_kg = slider.mass_kg;
            if let Some(force_n) = options.resistance_n {
                slider.resistance = Resistance::Constant(finite("the resistance", force_n)?);
            }
        }
        if slider_kg + chain.links.iter().map(|link| link.mass_kg).sum::<f64>() == 0.0 {
            return Err(CycleError::Massless(source.origin.clone()));
        }
        Ok(Setup { ratio: ratio.unwrap_or(crank_m / rod_m), rod_m, chain, slider_kg, spin })
    }

    /// Length of the crank.
    pub fn crank_m(&self) -> f64 {
        self.chain.links[0].length_m
    }

    /// Units of the values.
    pub fn units(&self, dimensionless: bool) -> Result<Units, CycleError> {
        if !dimensionless {
            return Ok(Units::SI);
        }
        for (name, value) in [("the slider's mass", self.slider_kg), ("the crank's speed", self.spin.speed)] {
            if value == 0.0 {
                return Err(CycleError::DividesByZero(name));
            }
        }
        Ok(Units { length: self.rod_m, rate: self.spin.speed, mass: self.slider_kg })
    }

    /// The machine at `points` angles over its turn, both ends included.
    pub fn turn(&self, points: usize) -> impl Iterator<Item = CycleInstant> {
        let mut machine = Machine::new(&self.chain);
        let last = points.saturating_sub(1).max(1) as f64;
        (0..points).map(move |index| machine.at(self.spin.at(TAU * index as f64 / last)))
    }
}

impl CrankRotation {
    fn new(scene: &Scene, options: &Options) -> Result<Self, CycleError> {
        let speed = finite("the speed", speed_rad_per_s(scene, options))?;
        let acceleration = finite("the acceleration", options.acceleration_rad_per_s2)?;
        let least = (2.0 * TAU * acceleration.abs()).sqrt();
        if speed * acceleration < 0.0 && speed.abs() <= least {
            return Err(CycleError::Stops { speed, acceleration, least });
        }
        Ok(CrankRotation { speed, acceleration })
    }

    /// Angle, rate and acceleration after turning by `turned` radians in the direction of motion.
    fn at(&self, turned: f64) -> [f64; 3] {
        let CrankRotation { speed, acceleration } = *self;
        let direction = if speed < 0.0 || (speed == 0.0 && acceleration < 0.0) { -1.0 } else { 1.0 };
        let angle = direction * turned;
        let rate =
            if acceleration == 0.0 { speed } else { direction * (speed * speed + 2.0 * acceleration * angle).max(0.0).sqrt() };
        [angle, rate, acceleration]
    }
}

/// The crank's rate at the beginning of the turn: the one asked for, or what the scene's motion reaches (a table: its rate after
/// the last row, or its mean rate where it ends at rest), or its start rate; 1 rad/s where the scene's is 0.
pub fn speed_rad_per_s(scene: &Scene, options: &Options) -> f64 {
    let usual = match &scene.drive {
        Drive::Motion(Motion::Speed(speed)) => *speed,
        Drive::Motion(Motion::Ramp { to_rad_per_s, .. }) => *to_rad_per_s,
        Drive::Motion(Motion::Table(rows)) => rate_of_table(scene, rows),
        Drive::Torque { .. } => scene.chain().map_or(0.0, |chain| chain.start.rate_rad_per_s),
    };
    options.speed_rad_per_s.unwrap_or(if usual == 0.0 { 1.0 } else { usual })
}

/// The rate at which a table of the scene's drive goes on after its last row; if it ends at rest, its mean rate, rad/s.
fn rate_of_table(scene: &Scene, rows: &[[f64; 2]]) -> f64 {
    let [[begin_s, begin_rad], .., [end_s, end_rad]] = rows else { return 0.0 };
    // The same drive, with its last row at t = 0.
    let mut ended = scene.clone();
    ended.drive = Drive::Motion(Motion::Table(rows.iter().map(|[time_s, angle_rad]| [time_s - end_s, *angle_rad]).collect()));
    let last = drive_at_start(&ended).motion.map_or(0.0, |[_, rate, _]| rate);
    let between = |two: &[[f64; 2]]| ((two[1][1] - two[0][1]) / (two[1][0] - two[0][0])).abs();
    let fastest = rows.windows(2).map(between).fold(0.0, f64::max);
    if last.abs() > ROUNDING * fastest { last } else { (end_rad - begin_rad) / (end_s - begin_s) }
}

fn crank_slider(source: &SceneSource) -> Result<&Chain, CycleError> {
    let chain = source.scene.chain().filter(|chain| matches!(chain.end, End::Slider(_)) && chain.links.len() == 2);
    chain.ok_or_else(|| CycleError::NotCrankSlider(source.origin.clone()))
}

fn lengths_m(source: &SceneSource) -> Result<[f64; 2], CycleError> {
    let links = &crank_slider(source)?.links;
    Ok([links[0].length_m, links[1].length_m])
}

fn finite(name: &'static str, value: f64) -> Result<f64, CycleError> {
    if value.is_finite() { Ok(value) } else { Err(CycleError::NotFinite { name, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    /// A natural spline over two equal intervals of mean rates a and b ends at the rate b + (b − a)/4, one that begins at rest otherwise. Where that is 0, the turn
    /// takes the mean rate of the table; where that is 0, too, 1 rad/s.
    #[test]
    fn regress_the_turn_has_the_rate_at_which_a_table_goes_on() -> Tested {
        for (rows, rate) in [
            ("[[0, 0], [2, -6]]", -3.0),
            ("[[0, 0], [0.5, 2], [1, 3]]", 1.5),
            ("[[0.25, 1], [0.75, 1], [1.25, 9]]", 144.0 / 7.0),
            ("[[0, 0], [0.1, 3], [0.2, 6], [0.3, 6]]", 20.0),
            ("[[0, 0], [1, 5], [2, 6]]", 3.0),
            ("[[0, 0], [0.1, 0.5], [0.2, 0.6]]", 3.0),
            ("[[0, 0], [2, 0]]", 1.0),
        ] {
            let source = SceneSource::open("crank-slider", &["pulse=[]".to_owned(), format!("drive.table={rows}")])?;
            let found = speed_rad_per_s(&source.scene, &Options::default());
            assert!((found - rate).abs() < 1e-12, "{rows}: {found} for {rate}");
            let asked = Options { speed_rad_per_s: Some(7.0), ..Options::default() };
            assert_eq!(speed_rad_per_s(&source.scene, &asked), 7.0);
        }
        Ok(())
    }
}
