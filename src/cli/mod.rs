//! The command line: parse, validate, run, exit code.

/// Prints a line to standard error; `error: …` and `warning: …` show its level.
macro_rules! say {
    ($($said:tt)*) => { $crate::cli::log::say(&format!($($said)*)) };
}

/// Prints the reason for an exit code other than 0, like `say!`, but also with `--quiet`.
macro_rules! say_reason {
    ($($said:tt)*) => { $crate::cli::log::say_reason(&format!($($said)*)) };
}

mod acceleration_sampling;
mod after_step;
mod aligned_table;
mod args;
mod argument_tips;
mod async_runtime;
mod building;
mod bus_args;
mod campaign_table;
mod check;
mod client_args;
mod command_line;
mod completions;
mod control;
mod cycle;
mod exit_status;
mod export;
mod failure;
mod files;
mod fixed_cost;
mod folders;
mod formatting;
mod foxglove;
mod info;
mod keyboard;
mod linear_args;
mod linearise;
mod list;
mod log;
mod mode_figures;
mod mode_sweep;
mod modes;
mod npz;
mod open_files;
mod other_names;
mod output;
mod over_frequency;
mod overlay;
mod overlay_places;
mod peaks;
mod periodic;
mod periodic_refusals;
mod phases;
mod plot;
mod plot_source;
mod progress;
mod pulse;
mod recover;
mod replay;
mod replies;
mod response;
mod resting_start;
mod resume;
mod ros2_args;
mod run;
mod run_args;
mod run_conclusion;
mod run_levels;
mod sample_intervals;
mod sampled_deflection;
mod sequence;
mod service_names;
mod setpoint;
mod short_load;
mod signals;
mod small_motion_args;
mod stability;
mod state_space_file;
mod status_line;
mod step_error;
mod sudden_start;
mod suggested_rate;
mod suggested_step;
mod supervise;
mod suspect_numbers;
mod sweep;
mod thesis_figures;
mod trade;
mod trade_choice;
mod trade_modes;
mod trade_table;
mod trial_run;
mod turning;
mod unmoved;
mod unstable_ranges;
mod values;
mod verify;
mod vibration_sampling;
mod watch;
mod what_if;
mod written;

use std::process::ExitCode;

use args::{Cli, Command};
use failure::CommandResult;
use signals::Interruption;

/// Runs the program on the process's arguments.
///
/// Exit codes: 0 done, 1 failed, 2 usage or bad scene, 3 finished but lossy, 4 diverged, 5 too late, 6 finished, not to be
/// trusted (energy), 130 interrupted before the end.
pub fn main() -> ExitCode {
    completions::answer_shell(Cli::complete_command);
    let cli = match Cli::of_process() {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    log::begin(cli.log_format, cli.volume);
    match dispatch(cli) {
        Ok(status) => status.into(),
        Err(failure) => failure.report(),
    }
}

fn dispatch(cli: Cli) -> CommandResult {
    open_files::raise_limit()?;
    let command = cli.command.unwrap_or_default();
    let _interruption = (!command.handles_signals()).then(Interruption::watch).transpose()?;
    match command {
        Command::Run(run) => run::run(*run),
        Command::Replay(args) => replay::replay(*args),
        Command::WhatIf(args) => what_if::what_if(args),
        Command::List(args) => list::list(&args),
        Command::Pulse(pulse) => pulse::pulse(pulse),
        Command::Setpoint(setpoint) => setpoint::setpoint(&setpoint),
        Command::Control(control) => control::control(control),
        Command::Watch(target) => watch::watch(&target),
        Command::Check(args) => check::check(&args),
        Command::Modes(args) if args.periodic => periodic::periodic(&args),
        Command::Modes(args) => modes::modes(&args),
        Command::Info(args) => info::info(&args),
        Command::Verify(args) => verify::verify(&args),
        Command::Recover(args) => recover::recover(&args),
        Command::Export(export) => export::export(export),
        Command::Plot(args) => plot::plot(&args),
        Command::Stability(args) => stability::stability(&args),
        Command::Linearise(args) => linearise::linearise(&args),
        Command::Response(args) => response::response(&args),
        Command::Cycle(args) => cycle::cycle(&args),
        Command::Sweep(args) => sweep::sweep(&args),
        Command::Trade(args) => trade::trade(&args),
        Command::Scenes { keys: true, markdown, .. } => files::keys(markdown),
        Command::Scenes { name, .. } => files::scenes(name.as_deref()),
        Command::Guide { chapter } => files::guide(chapter.as_deref()),
        Command::Files { name } => files::files(name.as_deref()),
        Command::Completions { shell } => completions::completions(shell),
    }
}
