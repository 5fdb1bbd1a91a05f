//! Arguments of the command line.

use std::path::PathBuf;
use std::str::FromStr as _;
use std::time::Duration;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

use crate::bus::{Address, BusOptions, Name};
use crate::plot::Format;
use crate::recording::Split;
use crate::runtime::{Overrun, Pace, PublishRates, Spin};
use crate::scene::{PulseShape, builtin};

const EXAMPLES: &str = "\
Examples:
  flexcrank                                    run the default scene in real time
  flexcrank run thesis-crank-slider --pace max --until 22.8
  flexcrank pulse crank --torque 5 --duration 0.1
  flexcrank watch crank
  flexcrank replay recordings/crank-20260101T120000Z.mcap --rate 2
  flexcrank scenes crank-slider > mine.toml && flexcrank run mine.toml
  flexcrank guide                              list the chapters of the guide

Exit codes: 0 done, 1 failed, 2 usage or bad scene, 3 finished but lossy, 4 diverged, 5 too late (with --overrun stop),
6 finished, not to be trusted (the energy balance left solver.balance_tolerance).";

/// Simulates planar mechanisms with flexible links in real time, on a zenoh bus, recorded to MCAP.
#[derive(Debug, Parser)]
#[command(version, after_help = EXAMPLES, max_term_width = 110)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Log format on standard error; RUST_LOG sets the level.
    #[arg(long, global = true, value_enum, default_value = "text", value_name = "FORMAT")]
    pub log_format: super::log::Format,
}

impl Cli {
    /// Parses the arguments of the process; exits with an error if they are invalid.
    pub(super) fn of_process() -> Cli {
        let matches = numbers_may_be_negative(Cli::command()).get_matches();
        Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
    }
}

/// Accepts negative numbers as values, so that each option can refuse them with its own message.
fn numbers_may_be_negative(command: clap::Command) -> clap::Command {
    command
        .mut_args(|arg| if arg.get_action().takes_values() { arg.allow_negative_numbers(true) } else { arg })
        .mut_subcommands(numbers_may_be_negative)
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Run a scene: step it, publish it, accept commands, record it. This is the default command.
    #[command(
        after_help = "Examples:\n  flexcrank run --pace max --until 10\n  flexcrank run --set rod.length_m=1.2 --set pulse.0.torque_nm=5\n  flexcrank run mine.toml --name left --publish-hz all --no-record\n  flexcrank run mine.toml other.toml --count 10 --publish-hz 50,loads=all\n  flexcrank run --record soak.mcap --split 10min --flush 50ms --fsync\n  flexcrank run --resume recordings/crank.mcap"
    )]
    Run(Box<RunArgs>),
    /// Publish a recording on the bus again, byte for byte, in order and on time.
    #[command(after_help = super::replay::EXAMPLES)]
    Replay(Box<super::replay::ReplayArgs>),
    /// List the services on the bus.
    #[command(after_help = "Examples:\n  flexcrank list\n  flexcrank list --connect tcp/192.0.2.1:7447")]
    List(Bus),
    /// Send a torque pulse to a service and print its reply.
    #[command(
        after_help = "Examples:\n  flexcrank pulse crank --torque 5 --duration 0.1\n  flexcrank pulse crank --torque -2 --duration 0.5 --delay 1 --shape raised-cosine\n  flexcrank pulse crank --from pulses.csv"
    )]
    Pulse(PulseArgs),
    /// Pause, resume, step, reset or stop a service; start or stop its recording; seek in a replay, change its rate.
    #[command(
        after_help = "Examples:\n  flexcrank control crank pause\n  flexcrank control crank step 100\n  flexcrank control crank start-recording take-2\n  flexcrank control ghost seek 3.5\n  flexcrank control ghost rate 2"
    )]
    Control(ControlArgs),
    /// Show a service in the terminal: the mechanism in motion, charts, state; or its values as lines.
    #[command(after_help = super::watch::EXAMPLES)]
    Watch(super::watch::Args),
    /// Verify recordings: structure, physics, and a re-simulation compared to the bit.
    #[command(after_help = super::verify::EXAMPLES)]
    Verify(super::verify::Args),
    /// Export a recording as tables.
    #[command(
        after_help = "Examples:\n  flexcrank export recordings/crank.mcap --csv tables\n  flexcrank export recordings/crank.mcap --parquet tables\n  flexcrank export recordings/crank.mcap --csv tables --from 1 --to 5 --every 0.01 --columns stamp.sim_time_s,links"
    )]
    Export(Export),
    /// Recover a recording that was cut off, damaged or lost its index. Exit code 3 if messages are lost.
    #[command(after_help = super::recover::EXAMPLES)]
    Recover(super::recover::Args),
    /// Draw a recording, a table, or every figure of the thesis.
    #[command(
        after_help = "Examples:\n  flexcrank plot recordings/crank.mcap -o plots\n  flexcrank plot recordings/crank.mcap --y links.crank.chord_rad,links.rod.chord_rad -o angles.svg\n  flexcrank plot recordings/crank.mcap --animation=0.25 -o crank.svg\n  flexcrank plot turn.csv --x crank_angle_rad --y driving_torque_nm --title Torque -o torque.png\n  flexcrank plot --thesis thesis-figures"
    )]
    Plot(Plot),
    /// Map where the numerics break down: the schemes in theory and as run, a crank-slider at the extremes.
    #[command(after_help = super::stability::EXAMPLES)]
    Stability(super::stability::Args),
    /// Turn a rigid crank-slider once: motion, joint forces, torque; counterweights; a sweep over the crank-to-rod ratio.
    #[command(after_help = super::cycle::EXAMPLES)]
    Cycle(super::cycle::Args),
    /// Measure speed against accuracy of every model, integrator, mesh and step for a scene; choose the cheapest that suffices.
    #[command(after_help = super::trade::EXAMPLES)]
    Trade(super::trade::Args),
    /// List the built-in scenes, or print one for editing.
    #[command(
        after_help = "Examples:\n  flexcrank scenes\n  flexcrank scenes crank-slider > mine.toml && flexcrank run mine.toml\n  flexcrank scenes --keys"
    )]
    Scenes {
        /// The scene to print.
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
    /// Print shell completions for flexcrank.
    #[command(
        after_help = "Examples:\n  flexcrank completions bash > ~/.local/share/bash-completion/completions/flexcrank\n  flexcrank completions zsh > ~/.zfunc/_flexcrank"
    )]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

impl Default for Command {
    fn default() -> Self {
        Command::Run(Box::new(RunArgs::parse_from(["run"])))
    }
}

#[derive(Debug, Clone, Default, Args)]
pub(super) struct Bus {
    /// Listen on this endpoint instead of a loopback port, e.g. tcp/0.0.0.0:7447. Anyone who reaches it can send commands.
    #[arg(long, global = true, value_name = "ENDPOINT")]
    listen: Vec<Address>,
    /// Connect to this endpoint, e.g. tcp/192.0.2.1:7447.
    #[arg(long, global = true, value_name = "ENDPOINT")]
    connect: Vec<Address>,
    /// Start from this zenoh configuration file.
    #[arg(long, global = true, value_name = "FILE")]
    zenoh_config: Option<PathBuf>,
}

impl Bus {
    pub(super) fn options(&self) -> BusOptions {
        BusOptions {
            listen: self.listen.iter().map(Address::to_string).collect(),
            connect: self.connect.iter().map(Address::to_string).collect(),
            config: self.zenoh_config.clone(),
            ..BusOptions::default()
        }
    }
}

#[derive(Debug, Parser)]
pub(super) struct RunArgs {
    /// Built-in scenes or TOML files. Several run side by side in one process.
    #[arg(default_value = builtin::DEFAULT)]
    pub scene: Vec<String>,
    /// Number of services to run per scene.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=999))]
    pub count: u32,
    #[command(flatten)]
    pub resume: super::resume::Args,
    /// Name on the bus: keys are flexcrank/NAME/…. Default: crank, or the name of the resumed session. Several services are named
    /// NAME-001, NAME-002, …
    #[arg(long)]
    pub name: Option<Name>,
    /// Pace: real, max, or simulated seconds per second.
    #[arg(long, default_value = "real", value_parser = pace)]
    pub pace: Pace,
    /// Finish at this simulated time, s.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub until: Option<f64>,
    /// Publishing rate: samples per simulated second, or all; or by topic (displacements, angles, loads, energies):
    /// 50,angles=all,energies=10. Energies have the rate of loads unless named. Default: 200, or the rate of the resumed session.
    #[arg(long, value_name = "HZ")]
    pub publish_hz: Option<PublishRates>,
    /// Policy for missed deadlines: catch-up; skip (move the deadlines and report it); or stop, with exit code 5.
    #[arg(long, value_name = "POLICY", default_value = "catch-up")]
    pub overrun: Overruns,
    /// Busy-wait for this long before each deadline instead of sleeping (0 disables it). auto adapts, so that one wake-up in a
    /// thousand is later; at most 200us and a fifth of the period. Default: auto for one service, 0 for several.
    #[arg(long, value_name = "TIME", value_parser = Spin::from_str)]
    pub spin: Option<Spin>,
    /// Do not request real-time scheduling, locked memory and processors that stay awake.
    #[arg(long)]
    pub no_realtime: bool,
    /// Record to this file instead of recordings/NAME-TIME.mcap; several services record to numbered files.
    #[arg(long, value_name = "PATH", conflicts_with = "no_record")]
    pub record: Option<PathBuf>,
    /// Do not record.
    #[arg(long)]
    pub no_record: bool,
    /// Flush period: a crash loses at most what was recorded in this time.
    #[arg(long, value_name = "TIME", default_value = "200ms", value_parser = flush_period)]
    pub flush: Duration,
    /// At every flush, wait until the data is on the disk: a power failure loses no more either.
    #[arg(long)]
    pub fsync: bool,
    /// Record into numbered parts of this size or recorded time: 500MB, 10min. Each part is complete by itself.
    #[arg(long, value_name = "SIZE|TIME", value_parser = split)]
    pub split: Option<Split>,
    /// Stop recording before it exceeds this size, all parts together; the simulation goes on: 2GB.
    #[arg(long, value_name = "SIZE", value_parser = recording_size)]
    pub max_recording_size: Option<bytesize::ByteSize>,
    /// Also publish the mechanism as shapes for Foxglove and Lichtblick: foxglove.SceneUpdate, at 25 Hz or HZ.
    #[arg(long, value_name = "HZ", num_args = 0..=1, require_equals = true, default_missing_value = "25", value_parser = frames)]
    pub scene_updates: Option<f64>,
    /// Override a key of the scene; VALUE is TOML, or a bare word for a string.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Run another model beside the first on the same commands, and publish the difference.
    #[arg(long, value_name = "MODEL")]
    pub shadow: Option<String>,
    /// Run even if another service on the bus has this name.
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub bus: Bus,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Overruns {
    CatchUp,
    Skip,
    Stop,
}

impl From<Overruns> for Overrun {
    fn from(policy: Overruns) -> Self {
        match policy {
            Overruns::CatchUp => Overrun::CatchUp,
            Overruns::Skip => Overrun::Skip,
            Overruns::Stop => Overrun::Stop,
        }
    }
}

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("pulses").args(["torque", "from"]).required(true))]
pub(super) struct PulseArgs {
    /// Name of the service.
    #[arg(default_value = "crank")]
    pub name: Name,
    /// Mean torque, N·m, positive counter-clockwise.
    #[arg(long, value_name = "NM", requires = "duration")]
    pub torque: Option<f64>,
    /// Duration, s.
    #[arg(long, value_name = "S", requires = "torque")]
    pub duration: Option<f64>,
    /// Send the pulses of a CSV file one after another; columns torque_nm, duration_s, and optionally delay_s, shape, id.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["duration", "delay", "shape", "id"])]
    pub from: Option<PathBuf>,
    /// Simulated time until the pulse begins, s.
    #[arg(long, value_name = "S", default_value = "0")]
    pub delay: f64,
    /// Shape of the pulse; both shapes have the impulse torque × duration.
    #[arg(long, default_value = "rectangular")]
    pub shape: Shape,
    /// Id of the command; a retry under the same id is not applied again.
    #[arg(long)]
    pub id: Option<String>,
    #[command(flatten)]
    pub bus: Bus,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Shape {
    Rectangular,
    RaisedCosine,
}

impl From<Shape> for PulseShape {
    fn from(shape: Shape) -> Self {
        match shape {
            Shape::Rectangular => PulseShape::Rectangular,
            Shape::RaisedCosine => PulseShape::RaisedCosine,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct ControlArgs {
    /// Name of the service or replay.
    pub name: Name,
    #[command(subcommand)]
    pub action: Action,
    #[command(flatten)]
    pub bus: Bus,
}

#[derive(Debug, Clone, Subcommand)]
pub(super) enum Action {
    /// Pause the simulation or replay.
    Pause,
    /// Resume it.
    Resume,
    /// While paused, advance by COUNT steps; a replay advances by COUNT messages.
    Step {
        /// Number of steps or messages.
        #[arg(default_value_t = 1)]
        count: u64,
    },
    /// Return to the start of the scene, or of the recording.
    Reset,
    /// End the run or the replay.
    Stop,
    /// Start a recording in the service's recordings folder.
    StartRecording {
        /// File name without a folder.
        file: Option<String>,
    },
    /// Stop the recording.
    StopRecording,
    /// Replay only: jump to a recorded time.
    Seek {
        /// Recorded time since the first message, s.
        time: f64,
    },
    /// Replay only: set the rate.
    Rate {
        /// Recorded seconds per second.
        factor: f64,
    },
    /// Replay only: while paused, play COUNT messages.
    Next {
        /// Number of messages.
        #[arg(default_value_t = 1)]
        count: u64,
    },
}

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("format").args(["csv", "parquet"]).required(true).multiple(true))]
pub(super) struct Export {
    /// The recording.
    pub file: PathBuf,
    /// Folder for CSV tables, one per topic.
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Folder for Parquet tables, one per topic.
    #[arg(long, value_name = "DIR")]
    pub parquet: Option<PathBuf>,
    /// Start at this recorded time, s.
    #[arg(long, value_name = "S", default_value = "0", value_parser = not_negative)]
    pub from: f64,
    /// End at this recorded time, s.
    #[arg(long, value_name = "S", value_parser = not_negative)]
    pub to: Option<f64>,
    /// Keep one row per topic in each period of this recorded time, s: the first.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub every: Option<f64>,
    /// Only these columns, by name or prefix: stamp.sim_time_s, links.crank. Times are always included.
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    pub columns: Vec<String>,
}

#[derive(Debug, Args)]
pub(super) struct Plot {
    /// Recordings (.mcap) or tables (CSV).
    #[arg(required_unless_present = "thesis", value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Folder for the figures, or the file (.svg, .png) for a single one.
    #[arg(long, short, value_name = "DIR|FILE", default_value = "plots")]
    pub output: PathBuf,
    /// Formats of the figures in a folder.
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', default_value = "svg,png")]
    pub format: Vec<PictureFormat>,
    /// Column of the horizontal axis. Default: a recording's simulated time, a table's first column.
    #[arg(long, value_name = "COLUMN", requires = "y")]
    pub x: Option<String>,
    /// Draw these columns in one figure, instead of the default figures.
    #[arg(long, value_name = "COLUMN", value_delimiter = ',')]
    pub y: Vec<String>,
    /// Title of the figures.
    #[arg(long)]
    pub title: Option<String>,
    /// Animate the mechanism instead: one SVG that moves by itself, at most 10 s long; SPEED in recorded seconds per second.
    #[arg(long, value_name = "SPEED", num_args = 0..=1, require_equals = true, default_missing_value = "1", value_parser = playing_speed)]
    #[arg(conflicts_with_all = ["x", "y", "title"])]
    pub animation: Option<f64>,
    /// Compute and draw every figure of the thesis into this folder, with an index.html.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["files", "output", "x", "y", "title", "animation"])]
    pub thesis: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum PictureFormat {
    Svg,
    Png,
}

impl Plot {
    /// The requested formats, without repetition.
    pub(super) fn formats(&self) -> Vec<Format> {
        let mut formats = Vec::new();
        for format in &self.format {
            let format = match format {
                PictureFormat::Svg => Format::Svg,
                PictureFormat::Png => Format::Png,
            };
            if !formats.contains(&format) {
                formats.push(format);
            }
        }
        formats
    }
}

fn pace(text: &str) -> Result<Pace, String> {
    match text {
        "real" => Ok(Pace::Factor(1.0)),
        "max" => Ok(Pace::Max),
        factor => number(factor, 1e-3, 1e6).map(Pace::Factor).map_err(|problem| format!("real, max, or {problem}")),
    }
}

fn recording_size(text: &str) -> Result<bytesize::ByteSize, String> {
    let size = text.parse().map_err(|_| "a size such as 500MB".to_owned())?;
    if size >= bytesize::ByteSize::mb(1) { Ok(size) } else { Err("a size of 1MB or more".to_owned()) }
}

fn frames(text: &str) -> Result<f64, String> {
    number(text, 1e-3, 1e3)
}

fn playing_speed(text: &str) -> Result<f64, String> {
    number(text, 1e-3, 1e3)
}

fn flush_period(text: &str) -> Result<Duration, String> {
    let period = humantime::parse_duration(text).map_err(|error| format!("{error}; a time such as 200ms"))?;
    let allowed = Duration::from_millis(1)..=Duration::from_secs(3600);
    if allowed.contains(&period) { Ok(period) } else { Err("a time from 1ms to 1h".to_owned()) }
}

fn split(text: &str) -> Result<Split, String> {
    if let Ok(time) = humantime::parse_duration(text) {
        let allowed = Duration::from_secs(1)..=Duration::from_secs(366 * 24 * 3600);
        return if allowed.contains(&time) { Ok(Split::Time(time)) } else { Err("a time from 1s to 1year".to_owned()) };
    }
    match text.parse::<bytesize::ByteSize>() {
        Ok(size) if size >= bytesize::ByteSize::mb(1) => Ok(Split::Bytes(size.as_u64())),
        Ok(_) => Err("a size of 1MB or more".to_owned()),
        Err(_) => Err("a size such as 500MB, or a time such as 10min".to_owned()),
    }
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    number(text, 1e-9, 1e9)
}

pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    number(text, 0.0, 1e9)
}

pub(super) fn number(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (low..=high).contains(number));
    number.ok_or_else(|| format!("a number from {low:?} to {high:?}"))
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
    fn prop_every_command_has_examples() {
        for command in Cli::command().get_subcommands() {
            let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(examples.starts_with("Examples:\n  flexcrank "), "{}: {examples:?}", command.get_name());
        }
    }
}
