//! `linearise`: the state space of small motion, as a file.

use std::io::Write as _;

use super::aligned_table::figure;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::folders::must_be_writable;
use super::linear_args::{Linear, LinearArgs};
use super::output::output;
use super::progress::elapsed;
use super::state_space_file::StateSpaceFile;
use super::values::step;
use crate::small_motion::scheme::Scheme;
use crate::small_motion::{StateSpace, modes};

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

The state is at rest at a crank angle, bent by weight and constant loads, in balance with a torque on the crank. An instant of a \
    recording counts as though it stood still.

Exit codes: 0 done, 1 failed, 2 usage, bad scene, or a state that cannot be linearised.";

/// Up to this many states the fastest eigenvalue is computed.
const EIGENVALUES: usize = 600;

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
    /// Discrete time as the scene's integrator computes it: the map of one step, of the scene or --step.
    #[arg(long)]
    pub scheme: bool,
}

pub(super) fn linearise(args: &Args) -> CommandResult {
    must_be_writable(args.output.path())?;
    let linear = args.linear.linearise()?;
    let (space, time) = args.in_time(&linear)?;
    args.output.write(&space, &linear.title)?;
    let mut out = output();
    writeln!(out, "{}", linear.title)?;
    for (what, names) in [("states", &space.states), ("inputs", &space.inputs), ("outputs", &space.outputs)] {
        writeln!(out, "  {what:<8} {:>4}  {}", names.len(), some(names))?;
    }
    writeln!(out, "  time     {time}")?;
    for (what, eigenvalue) in linear.ends()? {
        writeln!(out, "  {what:<8} {eigenvalue}")?;
    }
    writeln!(out, "{}", args.output.path().display())?;
    Ok(ExitStatus::Success)
}

impl Args {
    /// The state space in the time asked for, and that in words.
    fn in_time(&self, linear: &Linear) -> CommandResult<(StateSpace, String)> {
        let solver = &linear.chosen.source.scene.solver;
        let step_s = self.step.unwrap_or(solver.step_s);
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
    /// The slowest and the fastest motion.
    fn ends(&self) -> CommandResult<Vec<(&'static str, String)>> {
        let mut ends = Vec::new();
        // Of a chain that turns freely, the slowest is 0, and the next one tells more.
        for (what, mode) in ["slowest", "next"].into_iter().zip(modes(&self.chosen.subject, &self.point, 2)?) {
            ends.push((what, format!("{}, {}", eigenvalue(mode.eigenvalue.re, mode.eigenvalue.im), mode.name())));
            if mode.eigenvalue.norm() > 0.0 {
                break;
            }
        }
        if self.space.states.len() <= EIGENVALUES {
            ends.extend(self.space.eigenvalues().last().map(|fastest| ("fastest", eigenvalue(fastest.re, fastest.im))));
        }
        Ok(ends)
    }
}

fn eigenvalue(re: f64, im: f64) -> String {
    if im == 0.0 { format!("{} 1/s", figure(re)) } else { format!("{} ± {}i 1/s", figure(re), figure(im.abs())) }
}

/// The first names and the last.
fn some(names: &[String]) -> String {
    match names {
        [first, second, third, .., last] if names.len() > 5 => format!("{first}, {second}, {third}, … {last}"),
        _ => names.join(", "),
    }
}
