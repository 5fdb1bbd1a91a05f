//! Logging: to standard error, for people or machines, without passwords.

use std::io::{IsTerminal as _, Write, sink, stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

use tracing::{Level, Metadata};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::{FilterExt as _, filter_fn};
use tracing_subscriber::layer::{Layer as _, SubscriberExt as _};
use tracing_subscriber::util::SubscriberInitExt as _;

use super::output::messages;

/// Default log filter: warnings and errors, and flexcrank's own information. A viewer that leaves is no error, and neither is a line of one
/// point in a picture.
const DEFAULT_FILTER: &str =
    "warn,zenoh=error,usvg=error,resvg=error,tiny_skia=error,foxglove::websocket::connected_client=off,flexcrank=info";
/// zenoh modules that log their whole configuration, with passwords, from this level on.
const LOGS_PASSWORDS: [(&str, Level); 2] = [("zenoh::api::session", Level::DEBUG), ("zenoh::api::scouting", Level::TRACE)];

/// Whether the terminal is used by `watch`.
static MUTED: AtomicBool = AtomicBool::new(false);

/// The log format.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Format {
    /// Lines for people.
    #[default]
    Text,
    /// One JSON object per line.
    Json,
}

/// Amount of logging.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct Volume {
    /// Print only results, errors, and the reason for an exit code other than 0: no progress, no other warnings, no lines about
    /// the start and the end.
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Log more, also of the bus; twice: for debugging. RUST_LOG goes before.
    #[arg(long, short, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
}

impl Volume {
    fn filter(self) -> &'static str {
        match (self.quiet, self.verbose) {
            (true, _) => "error",
            (false, 0) => DEFAULT_FILTER,
            (false, 1) => "info",
            (false, _) => "debug",
        }
    }
}

/// Whether lines are JSON.
static JSON: AtomicBool = AtomicBool::new(false);

/// Whether only errors and reasons are shown.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Whether only errors and reasons are shown, and no progress.
pub(super) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints a line as [`say_reason`] does; with `--quiet`, only an error.
pub(super) fn say(line: &str) {
    if !is_quiet() || line.starts_with("error: ") {
        say_reason(line);
    }
}

/// Prints a line to standard error in the log format, at the level that its first word shows, also with `--quiet`. Failure is
/// ignored: if the terminal is gone, the command still runs to its end.
pub(super) fn say_reason(line: &str) {
    let line = if JSON.load(Ordering::Relaxed) { as_json(line) } else { line.to_owned() };
    // In one piece, so that the lines of programs beside each other do not mix.
    messages().write_all(format!("{line}\n").as_bytes()).unwrap_or(());
}

/// A line in the form of the JSON log.
fn as_json(line: &str) -> String {
    let levels = [("error: ", "ERROR"), ("warning: ", "WARN")];
    let split = levels.iter().find_map(|(prefix, level)| Some((*level, line.strip_prefix(prefix)?)));
    let (level, message) = split.unwrap_or(("INFO", line));
    let timestamp = humantime::format_rfc3339_micros(SystemTime::now()).to_string();
    serde_json::json!({ "timestamp": timestamp, "level": level, "fields": { "message": message } }).to_string()
}

/// Starts logging at the level of `RUST_LOG`, or the given one.
pub(super) fn begin(format: Format, volume: Volume) {
    QUIET.store(volume.quiet, Ordering::Relaxed);
    JSON.store(format == Format::Json, Ordering::Relaxed);
    let asked = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(volume.filter()));
    let lines = tracing_subscriber::fmt::layer().with_writer(writer).with_target(false).log_internal_errors(false);
    let lines = match format {
        Format::Json => lines.json().boxed(),
        Format::Text => lines.compact().with_ansi(stderr().is_terminal()).boxed(),
    };
    // Fails only if a program that uses this library has set up logging itself.
    let _ = tracing_subscriber::registry().with(lines.with_filter(asked.and(filter_fn(holds_no_configuration)))).try_init();
}

/// Whether an event contains no configuration.
fn holds_no_configuration(event: &Metadata) -> bool {
    !LOGS_PASSWORDS.iter().any(|(target, level)| event.target() == *target && event.level() >= level)
}

/// Stops logging to the terminal, because `watch` draws there; a file still receives all lines.
pub(super) fn mute() {
    MUTED.store(stderr().is_terminal(), Ordering::Relaxed);
}

fn writer() -> Box<dyn Write> {
    if MUTED.load(Ordering::Relaxed) { Box::new(sink()) } else { Box::new(stderr()) }
}
