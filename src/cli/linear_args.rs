//! The linearised mechanism that `linearise` and `response` work on.

use super::aligned_table::figure;
use super::failure::{CommandResult, Failure};
use super::formatting;
use super::progress::elapsed;
use super::small_motion_args::{Chosen, SubjectArgs};
use super::values::finite;
use crate::shown::shown_s;
use crate::small_motion::{Mode, NoModes, Point, StateSpace};

/// Most states: matrices of this size have 32 MB each.
const MOST_STATES: usize = 2000;
/// Rounding of the slowest motion's stiffness, as the state space tells it, from which responses err by a percent.
const ROUNDED: f64 = 1e-3;

#[derive(Debug, clap::Args)]
pub(super) struct LinearArgs {
    #[command(flatten)]
    pub subject: SubjectArgs,
    /// Crank angle, degrees. Default: that of the scene's start.
    #[arg(long, value_name = "DEG", value_parser = degrees)]
    pub angle: Option<f64>,
    /// Crank speed of a steady rotation, rad/s: of one link without weight.
    #[arg(long, value_name = "RAD/S", value_parser = rate)]
    pub speed: Option<f64>,
}

/// A state space, and the point it is about.
pub(super) struct Linear {
    pub chosen: Chosen,
    pub point: Point,
    pub space: StateSpace,
    /// The scene, its model, and the state.
    pub title: String,
}

impl Linear {
    /// Warns where the slowest motion that something holds is known to some percent only in A, which gives `result`.
    pub(super) fn warn_of_rounding(&self, lowest: &[Mode], result: &str) {
        let Some(slowest) = lowest.iter().find(|mode| mode.eigenvalue.norm() > 0.0) else { return };
        if self.space.rounding_of(slowest) > ROUNDED {
            let name = slowest.name();
            say!(
                "warning: with elements so short, {result} has the {name} to a percent at best, by rounding: fewer elements, or \
                 solver.model = \"modal\", give it in full"
            );
        }
    }
}

impl LinearArgs {
    /// Linearises.
    pub(super) fn linearise(&self) -> CommandResult<Linear> {
        let chosen = self.subject.choose()?;
        chosen.check(self.angle.is_some(), self.speed.is_some())?;
        let point = chosen.point(self.angle, self.speed.unwrap_or(0.0)).map_err(|refusal| self.refused(refusal))?;
        let states = 2 * point.q.len();
        if states > MOST_STATES {
            return Err(Failure::Usage(format!("{states} states are more than {MOST_STATES}: fewer elements have fewer")));
        }
        let bar = elapsed("linearising");
        let space = StateSpace::new(&chosen.subject, &point);
        bar.finish_and_clear();
        let title = self.title(&chosen)?;
        Ok(Linear { space: space?, chosen, point, title })
    }

    /// The refusal of a state. Periodic motion is another command's.
    fn refused(&self, refusal: NoModes) -> Failure {
        let (NoModes::NotSteady, Some(speed)) = (&refusal, self.speed) else { return refusal.into() };
        let scene = &self.subject.target;
        let overrides = self.subject.overrides.iter().map(|given| format!(" --set '{given}'")).collect::<String>();
        Failure::Usage(format!(
            "only one link without weight turns steadily; others turn periodically: \
             `flexcrank modes {scene}{overrides} --periodic --speed {speed}`"
        ))
    }

    fn title(&self, chosen: &Chosen) -> Result<String, NoModes> {
        let model = chosen.source.scene.solver.model.as_str();
        let crank = match (chosen.subject.is_oscillator(), chosen.subject.is_held()) {
            (true, _) => "",
            (false, true) => ", crank held",
            (false, false) => ", crank free",
        };
        let at = match (&chosen.instant, self.speed) {
            (Some((_, time_s)), _) => format!(" at t = {} s", shown_s(*time_s)),
            _ if chosen.subject.is_oscillator() => String::new(),
            (None, speed) => {
                let turning = speed.map(|speed| format!(", turning at {} rad/s", figure(speed))).unwrap_or_default();
                format!(" at {}°{turning}", figure(formatting::degrees(chosen.angle_rad(self.angle)?)))
            }
        };
        Ok(format!("{}: {model}{crank}{at}", self.subject.target))
    }
}

fn degrees(text: &str) -> Result<f64, String> {
    finite(text).ok_or_else(|| "a number of degrees without its unit, such as 57".to_owned())
}

fn rate(text: &str) -> Result<f64, String> {
    finite(text).ok_or_else(|| "a number in rad/s without its unit, such as 30".to_owned())
}
