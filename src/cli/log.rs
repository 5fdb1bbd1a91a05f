//! Logging: to standard error, for people or machines, without passwords.

use std::io::{IsTerminal as _, Write, sink, stderr};
use std::sync::atomic::{AtomicBool, Ordering};

use tracing::{Level, Metadata};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::{FilterExt as _, filter_fn};
use tracing_subscriber::layer::{Layer as _, SubscriberExt as _};
use tracing_subscriber::util::SubscriberInitExt as _;

/// Default log filter: warnings and errors, and flexcrank's own information.
const DEFAULT_FILTER: &str = "warn,zenoh=error,flexcrank=info";
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

/// Starts logging at the default level, or the level of `RUST_LOG`.
pub(super) fn begin(format: Format) {
    let asked = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(DEFAULT_FILTER));
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
