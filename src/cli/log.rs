//! What the program logs: to standard error, for people or machines, and never a password.

use std::io::{IsTerminal as _, Write, sink, stderr};
use std::sync::atomic::{AtomicBool, Ordering};

use tracing::{Level, Metadata};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::{FilterExt as _, filter_fn};
use tracing_subscriber::layer::{Layer as _, SubscriberExt as _};
use tracing_subscriber::util::SubscriberInitExt as _;

/// Warnings and errors, and what the program itself has to tell.
const USUAL: &str = "warn,zenoh=error,flexcrank=info";
/// Parts of zenoh that log their whole configuration, passwords included, and the level from which on they do.
const INDISCREET: [(&str, Level); 2] = [("zenoh::api::session", Level::DEBUG), ("zenoh::api::scouting", Level::TRACE)];

/// Whether the terminal is used for something else.
static MUTED: AtomicBool = AtomicBool::new(false);

/// How to log.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Format {
    /// Lines for people.
    #[default]
    Text,
    /// An object a line.
    Json,
}

/// Begins to log; more or less than usual with `RUST_LOG`.
pub(super) fn begin(format: Format) {
    let asked = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(USUAL));
    let lines = tracing_subscriber::fmt::layer().with_writer(writer).with_target(false).log_internal_errors(false);
    let lines = match format {
        Format::Json => lines.json().boxed(),
        Format::Text => lines.compact().with_ansi(stderr().is_terminal()).boxed(),
    };
    // Logging can already have been set up only by a program that uses this as a library: then its own stands.
    let _ = tracing_subscriber::registry().with(lines.with_filter(asked.and(filter_fn(is_discreet)))).try_init();
}

/// Whether what is logged holds no configuration.
fn is_discreet(event: &Metadata) -> bool {
    !INDISCREET.iter().any(|(target, level)| event.target() == *target && event.level() >= level)
}

/// Logs nothing to the terminal from now on, because a picture is there; a file still gets everything.
pub(super) fn mute() {
    MUTED.store(stderr().is_terminal(), Ordering::Relaxed);
}

fn writer() -> Box<dyn Write> {
    if MUTED.load(Ordering::Relaxed) { Box::new(sink()) } else { Box::new(stderr()) }
}
