//! Steps in which the crank passes the shortest load of a resistance table: longer ones see too little of it, or nothing.

use std::f64::consts::TAU;

use super::aligned_table::figure;
use super::suggested_step::speed_rad_per_s;
use crate::mechanics::{FEW_STEPS, loads_rad, passes};
use crate::scene::{Drive, End, Level, Motion, Resistance, Scene, SceneSource};
use crate::simulation::{Loads, PassedLoad};

/// With so many, a twentieth.
const ENOUGH_STEPS: f64 = 10.0;
/// Looks at a prescribed motion between two rows of its table.
const LOOKS: u32 = 4;

/// A part of the crank's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Way {
    pub(super) from_rad: f64,
    pub(super) to_rad: f64,
    /// How fast, rad/s.
    pub(super) rad_per_s: f64,
}

/// The load of a scene's resistance table that the crank passes in the shortest time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ShortLoad {
    width_rad: f64,
    rad_per_s: f64,
}

impl ShortLoad {
    /// The load that a crank passes on these ways; `None` without a table, or if the crank passes no load.
    pub(super) fn on(scene: &Scene, ways: &[Way]) -> Option<Self> {
        let load = |range: [f64; 2]| {
            let rates = ways.iter().filter(|way| passes([way.from_rad, way.to_rad], range)).map(|way| way.rad_per_s.abs());
            ShortLoad { width_rad: range[1] - range[0], rad_per_s: rates.fold(0.0, f64::max) }
        };
        let passed = loads_rad(resistance(scene)?).into_iter().map(load).filter(|load| load.rad_per_s > 0.0);
        passed.min_by(|one, other| one.passed_s().total_cmp(&other.passed_s()))
    }

    /// The load that the crank passes at the speeds of its drive, or at its start rate.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        resistance(scene)?;
        let Drive::Motion(Motion::Table(rows)) = &scene.drive else {
            return Self::on(scene, &[Way { from_rad: 0.0, to_rad: TAU, rad_per_s: speed_rad_per_s(scene) }]);
        };
        let loads = Loads::new(scene);
        let looks = rows.windows(2).flat_map(|rows| {
            let [from_s, to_s] = [rows[0][0], rows[1][0]];
            (0..=LOOKS).map(move |look| from_s + (to_s - from_s) * f64::from(look) / f64::from(LOOKS))
        });
        let motions: Vec<[f64; 3]> = looks.filter_map(|time_s| loads.input(time_s).motion).collect();
        let way = |pair: &[[f64; 3]]| {
            let rad_per_s = pair[0][1].abs().max(pair[1][1].abs());
            Way { from_rad: pair[0][0], to_rad: pair[1][0], rad_per_s }
        };
        Self::on(scene, &motions.windows(2).map(way).collect::<Vec<Way>>())
    }

    /// The warning of a scene's step, whatever its levels.
    pub(super) fn warning_of_step(scene: &Scene) -> Option<String> {
        Self::of(scene)?.warning(scene.solver.step_s)
    }

    /// The warning of a scene's step, or of that of the level with the longest one if this is longer; the level is named.
    pub(super) fn warning_of(source: &SceneSource) -> Option<String> {
        Self::warning_by(source, Self::of)
    }

    /// The same for a crank that moves on these ways.
    pub(super) fn warning_on(source: &SceneSource, ways: &[Way]) -> Option<String> {
        Self::warning_by(source, |scene| Self::on(scene, ways))
    }

    fn warning_by(source: &SceneSource, load_of: impl FnOnce(&Scene) -> Option<Self>) -> Option<String> {
        let level =
            |(index, level): (usize, &Level)| Some((format!("level `{}`: ", level.name), source.at_level(index).ok()?.scene));
        let levels = source.scene.levels.iter().enumerate().filter_map(level);
        let longer = |longest: (String, Scene), other: (String, Scene)| {
            if other.1.solver.step_s > longest.1.solver.step_s { other } else { longest }
        };
        let (named, longest) = levels.fold((String::new(), source.scene.clone()), longer);
        Some(format!("{named}{}", load_of(&longest)?.warning(longest.solver.step_s)?))
    }

    /// The warning of so many angles over a turn, both ends included, that are too few for the shortest load.
    pub(super) fn warning_of_grid(scene: &Scene, points: usize) -> Option<String> {
        let widths_rad = loads_rad(resistance(scene)?).into_iter().map(|[from_rad, to_rad]| to_rad - from_rad);
        let width_rad = widths_rad.reduce(f64::min)?;
        let steps = width_rad * (points as f64 - 1.0) / TAU;
        (steps < FEW_STEPS).then(|| {
            format!(
                "{points} angles pass the shortest load of slider.resistance_table, {} rad wide at half its height, in {steps:.1} \
                 intervals: peaks and means come out wrong, or the load is missed; --points {} shows it",
                figure(width_rad),
                (ENOUGH_STEPS * TAU / width_rad).ceil() + 1.0
            )
        })
    }

    /// Time in which it is passed, s.
    fn passed_s(self) -> f64 {
        self.width_rad / self.rad_per_s
    }

    /// The longest step that shows it, s, and the reason.
    pub(super) fn longest_step_s(self) -> (f64, String) {
        let passed_s = self.passed_s();
        let reason =
            format!("at least {ENOUGH_STEPS} steps in the shortest load of slider.resistance_table ({} s)", figure(passed_s));
        (passed_s / ENOUGH_STEPS, reason)
    }

    /// The warning of a step, s, that is too long for it.
    pub(super) fn warning(self, step_s: f64) -> Option<String> {
        let steps = self.passed_s() / step_s;
        (steps < FEW_STEPS).then(|| {
            format!(
                "a step of {} s passes the shortest load of slider.resistance_table, {} rad wide at half its height, in {steps:.1} steps \
                 at {} rad/s: peaks of forces and torques come out too small, or are missed; {} s shows them",
                figure(step_s),
                figure(self.width_rad),
                figure(self.rad_per_s),
                figure(self.longest_step_s().0)
            )
        })
    }
}

/// The warning of a run whose crank passed a load in few steps.
pub(super) fn warning_of_run(PassedLoad { width_rad, steps, rad_per_s }: PassedLoad) -> String {
    format!(
        "the crank passed a load of slider.resistance_table, {} rad wide at half its height, in {} steps at {} rad/s: peaks of forces \
         and torques came out too small, or were missed; steps of {} s show them",
        figure(width_rad),
        figure(steps),
        figure(rad_per_s),
        figure(ShortLoad { width_rad, rad_per_s }.longest_step_s().0)
    )
}

/// The resistance of a scene with a slider.
pub(super) fn resistance(scene: &Scene) -> Option<&Resistance> {
    match &scene.chain()?.end {
        End::Slider(slider) => Some(&slider.resistance).filter(|resistance| matches!(resistance, Resistance::Table(_))),
        End::Free { .. } => None,
    }
}
