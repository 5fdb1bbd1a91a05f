//! `linearise`: the state space of small motion, as a file.

use std::f64::consts::PI;
use std::io::Write as _;

use nalgebra::Complex;

use super::aligned_table::figure;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::folders::must_be_targets;
use super::linear_args::{Linear, LinearArgs};
use super::output::output;
use super::progress::elapsed;
use super::state_space_file::StateSpaceFile;
use super::values::step;
use crate::small_motion::scheme::Scheme;
use crate::small_motion::{StateSpace, modes, multiplier_of_vibration};

pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank linearise -o crank.json                        the default scene, at its start
  flexcrank linearise crank-slider --angle 57 -o crank.py
  flexcrank linearise crank-slider --angle 57 --step 1ms -o crank.m
  flexcrank linearise mine.toml --scheme -o step.json
  flexcrank linearise recordings/crank.mcap@1.5 -o instant.json

The file holds A, B, C and D of  dx/dt = A x + B u,  y = C x + D u  with the names of the states x, the inputs u and the outputs y, the \
    outputs' values `at` the state, and the sampling interval `dt`. All of x, u and y are differences from that state. The extension \
    chooses the format: .json, .m (MATLAB, Octave), .py or .npz (NumPy arrays).

The slowest and the fastest eigenvalue are printed. With --scheme, ln(g)/dt stands beside each: g is the eigenvalue of A that \
    belongs to the same motion. A motion with |λ| dt > π is too fast for these steps.

The state is at rest at a crank angle, bent by weight and constant loads, in balance with a torque on the crank; the masses of an \
    oscillator are where springs balance forces. An instant of a \
    recording counts as though it stood still.

Exit codes: 0 done, 1 failed, 2 usage, bad scene, or a state that cannot be linearised.";

/// Up to this many states the fastest eigenvalue is computed.
const EIGENVALUES: usize = 600;
/// A part of an eigenvalue that is smaller, over its size, is rounding.
const PART: f64 = 1e-12;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    pub linear: LinearArgs,
    /// The file: .json, .m, .py or .npz. One of the same name is replaced.
    #[arg(long, short, value_name = "FILE", value_parser = StateSpaceFile::parse)]
    pub output: StateSpaceFile,
    /// Sampling interval: discrete time, x[k+1] = A x[k] + B u[k], exact for inputs that are constant during each interval.
    #[arg(long, value_name = "TIME", value_parser = step)]
    pub step: Option<f64>,
    /// Discrete time as the scene's integrator computes it: the map of one step, of the scene or --step, under inputs that do not jump.
    #[arg(long)]
    pub scheme: bool,
}

pub(super) fn linearise(args: &Args) -> CommandResult {
    must_be_targets(&args.linear.subject.target, &[("--output", Some(args.output.path()))])?;
    let linear = args.linear.linearise()?;
    let (space, time) = args.in_time(&linear)?;
    args.output.write(&space, &linear.title)?;
    let mut out = output();
    writeln!(out, "{}", linear.title)?;
    for (what, names) in [("states", &space.states), ("inputs", &space.inputs), ("outputs", &space.outputs)] {
        writeln!(out, "  {what:<8} {:>4}  {}", names.len(), some(names))?;
    }
    writeln!(out, "  time     {time}")?;
    let multipliers = if args.scheme && space.states.len() <= EIGENVALUES { space.multipliers() } else { Vec::new() };
    for (what, exact, name) in linear.ends()? {
        let scheme = Scheme::of(&linear.chosen.source.scene.solver);
        let by_scheme = by_scheme(&multipliers, exact, (scheme, args.step_s(&linear)));
        writeln!(out, "  {what:<8} {}{name}{by_scheme}", shown(exact))?;
    }
    writeln!(out, "{}", args.output.path().display())?;
    Ok(ExitStatus::Success)
}

impl Args {
    fn step_s(&self, linear: &Linear) -> f64 {
        self.step.unwrap_or(linear.chosen.source.scene.solver.step_s)
    }

    /// The state space in the time asked for, and that in words.
    fn in_time(&self, linear: &Linear) -> CommandResult<(StateSpace, String)> {
        let solver = &linear.chosen.source.scene.solver;
        let step_s = self.step_s(linear);
        let bar = elapsed("discretising");
        let found = match (self.scheme, self.step) {
            (true, _) => {
                let map = linear.space.stepped_by(Scheme::of(solver), step_s);
                map.map(|map| (map, format!("steps of {step_s} s by {}", solver.integrator.as_str())))
            }
            (false, Some(_)) => {
                let held = linear.space.zero_order_hold(step_s);
                held.map(|held| (held, format!("samples every {step_s} s, inputs constant in between")))
            }
            (false, None) => Ok((linear.space.clone(), "continuous".to_owned())),
        };
        bar.finish_and_clear();
        Ok(found?)
    }
}

impl Linear {
    /// The slowest and the fastest motion of the mechanism: its eigenvalue, and the name where it is known.
    fn ends(&self) -> CommandResult<Vec<(&'static str, Complex<f64>, String)>> {
        let mut ends = Vec::new();
        // Of a chain that turns freely, the slowest is 0, and the next one tells more.
        let slow = modes(&self.chosen.subject, &self.point, 2)?;
        self.warn_of_rounding(&slow, "A");
        for (what, mode) in ["slowest", "next"].into_iter().zip(slow) {
            ends.push((what, mode.eigenvalue, format!(", {}", mode.name())));
            if mode.eigenvalue.norm() > 0.0 {
                break;
            }
        }
        if self.space.states.len() <= EIGENVALUES {
            ends.extend(self.space.eigenvalues().last().map(|fastest| ("fastest", *fastest, String::new())));
        }
        Ok(ends)
    }
}

/// The eigenvalue `ln(g)/h` that steps of h give a motion. The multiplier g of a step is the one nearest to that of a single vibration with
/// this eigenvalue, or to `exp(λh)` if the motion does not vibrate. Empty without multipliers, and for an eigenvalue of 0.
fn by_scheme(multipliers: &[Complex<f64>], exact: Complex<f64>, (scheme, step_s): (Scheme, f64)) -> String {
    let vibration = if exact.im == 0.0 { None } else { multiplier_of_vibration(scheme, exact, step_s).ok() };
    let ideal = vibration.unwrap_or((exact * step_s).exp());
    let nearest = multipliers.iter().min_by(|one, other| (*one - ideal).norm().total_cmp(&(*other - ideal).norm()));
    match nearest.filter(|_| exact.norm() > 0.0) {
        Some(_) if exact.norm() * step_s > PI => "; too fast for these steps".to_owned(),
        Some(nearest) => format!("; by these steps {}", shown(nearest.ln() / step_s)),
        None => String::new(),
    }
}

/// An eigenvalue. A part that is rounding beside the other is 0.
fn shown(eigenvalue: Complex<f64>) -> String {
    let part = |part: f64| if part.abs() < PART * eigenvalue.norm() { 0.0 } else { part };
    let (re, im) = (part(eigenvalue.re), part(eigenvalue.im));
    if im == 0.0 { format!("{} 1/s", figure(re)) } else { format!("{} ± {}i 1/s", figure(re), figure(im.abs())) }
}

/// The first names and the last.
fn some(names: &[String]) -> String {
    match names {
        [first, second, third, .., last] if names.len() > 5 => format!("{first}, {second}, {third}, … {last}"),
        _ => names.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::{Complex, shown};

    /// Masses on springs without damping had 5.32907e-15 ± 1.71141i.
    #[test]
    fn regress_a_part_of_an_eigenvalue_that_is_rounding_is_zero() {
        for (re, im, said) in [
            (5.32907e-15, 1.71141, "0 ± 1.71141i 1/s"),
            (-1e-9, 2.0, "-1.00000e-9 ± 2i 1/s"),
            (-3.0, 1e-15, "-3 1/s"),
            (0.0, 0.0, "0 1/s"),
        ] {
            assert_eq!(shown(Complex::new(re, im)), said);
        }
    }
}
