//! The root of the command line: its commands, each with its arguments.

use clap_complete::engine::ArgValueCompleter;

use std::any::TypeId;
use std::io::{ErrorKind, Write as _};
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use super::argument_tips::{detached_value, with_tips};
use super::failure::Failure;
use super::output::of_standard_output;

const EXAMPLES: &str = "\
Examples:
  flexcrank                                    run the default scene in real time
  flexcrank run thesis-crank-slider --pace max --until 22.8
  flexcrank pulse crank --torque 5 --duration 0.1
  flexcrank watch crank
  flexcrank replay recordings/crank-20260101T120000Z.mcap --rate 2
  flexcrank scenes crank-slider > mine.toml && flexcrank run mine.toml
  flexcrank guide                              list the chapters of the guide

Exit codes: 0 done, 1 failed, 2 usage or bad scene, 3 finished but lossy, 4 diverged, 5 too late, 6 finished, \
    not to be trusted, 130 interrupted. More: flexcrank guide exit-codes.";

/// Simulates planar mechanisms with flexible links in real time, on a zenoh bus, recorded to MCAP.
#[derive(Debug, Parser)]
#[command(version, after_help = EXAMPLES, max_term_width = 110)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Log format on standard error; RUST_LOG sets the level.
    #[arg(long, global = true, value_enum, default_value = "text", value_name = "FORMAT")]
    pub log_format: super::log::Format,
    #[command(flatten)]
    pub volume: super::log::Volume,
}

impl Cli {
    /// All commands with their options.
    pub(super) fn complete_command() -> clap::Command {
        numbers_may_be_negative(Cli::command())
    }

    /// Parses the arguments of the process. Help and errors are printed, and end in their exit code.
    pub(super) fn of_process() -> Result<Cli, ExitCode> {
        let (mut command, words) = (Cli::complete_command(), std::env::args_os().collect::<Vec<_>>());
        let parsed = command.try_get_matches_from_mut(&words);
        let parsed = parsed.and_then(|matches| detached_value(&command, &words).map_or(Ok(matches), Err));
        parsed.and_then(|matches| Cli::from_arg_matches(&matches)).map_err(|error| print(with_tips(error, &command, &words)))
    }
}

/// Prints help or an error of the arguments.
fn print(error: clap::Error) -> ExitCode {
    let asked_for = !error.use_stderr();
    match error.print().and_then(|()| std::io::stdout().flush()) {
        Err(cause) if asked_for && cause.kind() != ErrorKind::BrokenPipe => Failure::from(of_standard_output(cause)).report(),
        _ => ExitCode::from(if asked_for { 0 } else { 2 }),
    }
}

/// Accepts negative numbers as values, so that each option can refuse them with its own message; numeric options also accept them with
/// a unit: `-5Nm`.
fn numbers_may_be_negative(command: clap::Command) -> clap::Command {
    let accept = |arg: clap::Arg| {
        let is_numeric = arg.get_value_parser().type_id() == TypeId::of::<f64>();
        match arg.get_action().takes_values() {
            true if is_numeric => arg.allow_hyphen_values(true),
            true => arg.allow_negative_numbers(true),
            false => arg,
        }
    };
    command.mut_args(accept).mut_subcommands(numbers_may_be_negative)
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Run a scene: step it, publish it, accept commands, record it. This is the default command.
    #[command(after_help = super::run_args::EXAMPLES)]
    Run(Box<super::run_args::Args>),
    /// Publish a recording on the bus again, byte for byte, in order and on time.
    #[command(after_help = super::replay::EXAMPLES)]
    Replay(Box<super::replay::ReplayArgs>),
    /// Re-simulate a recorded session with a change; record the result, and report where both deviate.
    #[command(after_help = super::what_if::EXAMPLES)]
    WhatIf(super::what_if::Args),
    /// List the services on the bus.
    #[command(after_help = super::list::EXAMPLES)]
    List(super::list::Args),
    /// Send a torque pulse to a service and print its reply.
    #[command(after_help = super::pulse::EXAMPLES, override_usage = super::pulse::USAGE)]
    Pulse(super::pulse::Args),
    /// Send a setpoint to a service: a torque that holds until the next one, at most for a given time.
    #[command(after_help = super::setpoint::EXAMPLES)]
    Setpoint(super::setpoint::Args),
    /// Pause, resume, step, reset or stop a service; start or stop its recording; seek in a replay, change its rate.
    #[command(after_help = super::control::EXAMPLES)]
    Control(super::control::Args),
    /// Show a service in the terminal: the mechanism in motion, charts, state; or its values as lines.
    #[command(after_help = super::watch::EXAMPLES)]
    Watch(super::watch::Args),
    /// Check a scene, and show what it would cost: unknowns, frequencies, time per step, a suggested step.
    #[command(after_help = super::check::EXAMPLES)]
    Check(super::check::Args),
    /// Find the natural frequencies, damping and shapes of a mechanism's modes, each named by where its energy is.
    #[command(after_help = super::modes::EXAMPLES)]
    Modes(super::modes::Args),
    /// Describe recordings: duration, topics with rates and sizes, scene, build, how the session ended.
    #[command(after_help = super::info::EXAMPLES)]
    Info(super::info::Args),
    /// Verify recordings: structure, physics, and a re-simulation compared to the bit.
    #[command(after_help = super::verify::EXAMPLES)]
    Verify(super::verify::Args),
    /// Export a recording as tables.
    #[command(after_help = super::export::EXAMPLES)]
    Export(super::export::Args),
    /// Recover a recording that was cut off, damaged or lost its index. Exit code 3 if messages are lost.
    #[command(after_help = super::recover::EXAMPLES)]
    Recover(super::recover::Args),
    /// Draw a recording, a table, or every figure of the thesis.
    #[command(after_help = super::plot::EXAMPLES)]
    Plot(super::plot::Args),
    /// Map where the numerics break down: the schemes in theory and as run, a crank-slider at the extremes.
    #[command(after_help = super::stability::EXAMPLES)]
    Stability(super::stability::Args),
    /// Linearise a mechanism: matrices A, B, C and D with named states, inputs and outputs, for programs for control.
    #[command(after_help = super::linearise::EXAMPLES)]
    Linearise(super::linearise::Args),
    /// Respond to a torque or a force in small motion: over frequency, and after a step.
    #[command(after_help = super::response::EXAMPLES)]
    Response(super::response::Args),
    /// Turn a rigid crank-slider once: motion, joint forces, torque; counterweights; a sweep over the crank-to-rod ratio.
    #[command(after_help = super::cycle::EXAMPLES)]
    Cycle(super::cycle::Args),
    /// Run a campaign: a scene many times with keys that vary; a table of scalars, sensitivity indices.
    #[command(after_help = super::sweep::EXAMPLES)]
    Sweep(super::sweep::Args),
    /// Measure speed against accuracy of every model, integrator, mesh and step for a scene; choose the cheapest that suffices.
    #[command(after_help = super::trade::EXAMPLES)]
    Trade(super::trade::Args),
    /// List the built-in scenes, or print one for editing.
    #[command(
        after_help = "Examples:\n  flexcrank scenes\n  flexcrank scenes crank-slider > mine.toml && flexcrank run mine.toml\n  flexcrank scenes take.mcap > taken.toml\n  flexcrank scenes --keys"
    )]
    Scenes {
        /// The scene to print: a built-in one, or a recording, whose scene is printed as it began.
        #[arg(add = ArgValueCompleter::new(super::completions::scenes))]
        name: Option<String>,
        /// Print every key that a scene may have: type, unit, default, range and meaning.
        #[arg(long, conflicts_with = "name")]
        keys: bool,
        /// Print the keys as Markdown tables.
        #[arg(long, requires = "keys")]
        markdown: bool,
    },
    /// Print a chapter of the guide, or list the chapters.
    #[command(after_help = "Examples:\n  flexcrank guide\n  flexcrank guide scenes")]
    Guide {
        /// The chapter to print.
        chapter: Option<String>,
    },
    /// Print a file for another program, or list them: systemd unit, secure zenoh configuration, layout for Foxglove, Rerun.
    #[command(after_help = "Examples:\n  flexcrank files\n  flexcrank files gate.json5 > gate.json5")]
    Files {
        /// The file to print.
        name: Option<String>,
    },
    /// Print shell completions for flexcrank.
    #[command(
        after_help = "Examples:\n  flexcrank completions bash > ~/.local/share/bash-completion/completions/flexcrank\n  flexcrank completions zsh > ~/.zfunc/_flexcrank"
    )]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

impl Command {
    /// Whether it ends in its own way at a signal. Any other leaves no unfinished file and ends.
    pub(super) fn handles_signals(&self) -> bool {
        use Command::{Modes, Replay, Run, Stability, Sweep, Trade, Watch};
        matches!(self, Run(_) | Replay(_) | Watch(_) | Modes(_) | Stability(_) | Sweep(_) | Trade(_))
    }
}

impl Default for Command {
    fn default() -> Self {
        Command::Run(Box::new(super::run_args::Args::parse_from(["run"])))
    }
}

#[cfg(test)]
mod tests {
    use clap::error::ErrorKind;

    use super::{Cli, CommandFactory as _, numbers_may_be_negative};

    #[test]
    fn prop_the_command_line_is_sound() {
        numbers_may_be_negative(Cli::command()).debug_assert();
    }

    #[test]
    fn prop_a_negative_number_is_refused_as_a_value() {
        for line in
            ["run --until -1", "run --count -1", "replay take.mcap --wait-for -1", "trade --steps -1", "cycle --ratio -0.2"]
        {
            let words = std::iter::once("flexcrank").chain(line.split(' '));
            let kind = numbers_may_be_negative(Cli::command()).try_get_matches_from(words).err().map(|error| error.kind());
            assert_eq!(kind, Some(ErrorKind::ValueValidation), "{line}");
        }
    }

    #[test]
    fn regress_a_negative_number_with_its_unit_is_refused_as_a_value() {
        let parse = |line: &str| {
            let words = std::iter::once("flexcrank").chain(line.split(' '));
            numbers_may_be_negative(Cli::command()).try_get_matches_from(words)
        };
        for (line, why) in [
            ("pulse --torque -5Nm --duration 1", "'-5Nm' for '--torque <NM>': a number in N·m without its unit, such as -2.5"),
            ("pulse --torque --duration 1", "'--duration' for '--torque <NM>': a number in N·m without its unit, such as -2.5"),
            ("setpoint --torque -5Nm --hold 1", "'-5Nm' for '--torque <NM>': a number in N·m without its unit"),
            ("setpoint --torque 5 --hold -1s", "'-1s' for '--hold <TIME>': a time from 1us to 60s"),
            ("linearise --angle -30deg", "'-30deg' for '--angle <DEG>': a number of degrees without its unit"),
            ("modes --angle -30deg", "degrees without their unit: a number, or FROM:TO:STEP"),
        ] {
            let said = parse(line).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(said.contains(why), "{line}: {said}");
        }
        for line in
            ["pulse --torque -5 --duration 1", "modes --angle -5:5:1", "modes --speed -20:20:5", "run --scene-updates --no-bus"]
        {
            assert_eq!(parse(line).err().map(|error| error.to_string()), None, "{line}");
        }
    }

    /// The refusal of a line, without a tip; nothing if it is accepted.
    fn refusal(line: &str) -> String {
        let words = std::iter::once("flexcrank").chain(line.split(' '));
        let refused = Cli::complete_command().try_get_matches_from(words).err();
        refused.map(|error| error.to_string()).unwrap_or_default()
    }

    /// clap does not ask for an option that something else excludes.
    #[test]
    fn regress_an_option_that_needs_another_is_refused_also_beside_one_that_excludes_that() {
        for line in [
            "cycle --r4 1 --r5 1 --sweep-ratio",
            "cycle --r4 1 --r5 1 --dimensionless",
            "modes --over slider.mass_kg=1:2:1 --live crank",
            "run --no-record --split 10min",
            "run --no-record --max-recording-size 1GB",
            "run --no-record --flush 50ms",
            "run --no-record --fsync",
            "replay take.mcap --wait-timeout 5",
        ] {
            let said = refusal(line);
            assert!(said.contains("cannot be used with") || said.contains("were not provided"), "{line}: {said}");
        }
        for line in [
            "cycle --balance --r4 1 --r5 1",
            "sweep campaign.toml --plot plots --scalars pivot_peak_force_n",
            "sweep campaign.toml --indices",
            "replay take.mcap --wait-for 1 --wait-timeout 5",
        ] {
            assert_eq!(refusal(line), "", "{line}");
        }
    }

    #[test]
    fn prop_every_command_has_examples() {
        for command in Cli::command().get_subcommands() {
            let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(examples.starts_with("Examples:\n  flexcrank "), "{}: {examples:?}", command.get_name());
        }
    }
}
