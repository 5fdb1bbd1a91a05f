//! Failures of commands, by exit code.

use std::error::Error;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::process::ExitCode;

use super::exit_status::ExitStatus;
use crate::bus::{BadName, BusError};
use crate::files::UnknownFile;
use crate::guide::UnknownChapter;
use crate::integrate::StepError;
use crate::plot::PlotError;
use crate::recording::{RecordingError, has_checkpoint};
use crate::resimulation::ResimulationError;
use crate::scene::SceneError;
use crate::service::ServiceError;
use crate::simulation::BuildError;
use crate::small_motion::NoModes;
use crate::study::cycle::CycleError;
use crate::study::stability::{NoMap, NotSuited};
use crate::study::sweep::{BadShard, NoIndices, SweepError};
use crate::study::trade::TradeError;
use crate::study::{HistoryError, TableError};

/// Result of a command or of a part of one.
pub(super) type CommandResult<T = ExitStatus> = Result<T, Failure>;

/// A command did not do what was asked.
#[derive(Debug)]
pub(super) enum Failure {
    /// The arguments, the scene or another input are wrong: exit code 2.
    Usage(String),
    /// The request was sound, but its execution failed: 1.
    Failed(String),
    /// A simulation that the request needs diverges: 4.
    Diverged(String),
    /// The reader of an endless output has closed it: 0.
    OutputClosed,
}

impl Failure {
    /// Adds the file to an error of the system.
    pub(super) fn file(path: &Path) -> impl FnOnce(io::Error) -> Failure {
        move |cause| Failure::Failed(format!("{}: {cause}", path.display()))
    }

    /// Logs the failure and returns its exit code.
    pub(super) fn report(self) -> ExitCode {
        let (text, code) = match self {
            Failure::Usage(text) => (text, 2),
            Failure::Failed(text) => (text, 1),
            Failure::Diverged(text) => (text, 4),
            Failure::OutputClosed => return ExitCode::SUCCESS,
        };
        say!("error: {text}");
        ExitCode::from(code)
    }

    /// Logs that one of several files cannot be read. The others are read all the same.
    pub(super) fn report_file(self) -> ExitStatus {
        // The exit code is that of all files.
        let _ = self.report();
        ExitStatus::Refused
    }
}

/// An error with its causes.
fn in_full(error: &dyn Error) -> String {
    match error.source() {
        None => error.to_string(),
        Some(cause) => format!("{error}: {}", in_full(cause)),
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        if error.kind() == ErrorKind::BrokenPipe { Failure::OutputClosed } else { Failure::Failed(error.to_string()) }
    }
}

impl From<SceneError> for Failure {
    fn from(refused: SceneError) -> Self {
        Failure::Usage(refused.in_full())
    }
}

impl From<ResimulationError> for Failure {
    fn from(error: ResimulationError) -> Self {
        let text = format!("{}{}", in_full(&error), checkpoint_hint(&error));
        if error.is_usage() { Failure::Usage(text) } else { Failure::Failed(text) }
    }
}

/// The way to a checkpoint that stands in the chunk in which a recording ends, and nowhere else; nothing if there is none.
fn checkpoint_hint(error: &ResimulationError) -> String {
    let ResimulationError::NothingToResume(path) = error else { return String::new() };
    let way = RecordingError::cut_chunk_hint(path).filter(|_| has_checkpoint(path));
    way.map_or(String::new(), |way| format!("; the file ends early: {way}"))
}

/// Declares for each error type which of its errors mean that the request is wrong.
macro_rules! usage {
    ($($error:ty: $is_usage:expr),* $(,)?) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                let is_usage: fn(&$error) -> bool = $is_usage;
                if is_usage(&error) { Failure::Usage(in_full(&error)) } else { Failure::Failed(in_full(&error)) }
            }
        }
    )*};
}

usage! {
    BadName: |_| true,
    BadShard: |_| true,
    BuildError: |_| true,
    BusError: |error| matches!(error, BusError::Config(_) | BusError::File { .. } | BusError::NoTls(_)),
    CycleError: |_| true,
    HistoryError: |_| false,
    NoIndices: |error| !matches!(error, NoIndices::Sweep(_)),
    NoMap: |_| true,
    NoModes: |error| !matches!(error, NoModes::NotFound),
    NotSuited: |_| true,
    PlotError: |error| matches!(error, PlotError::Request(_)),
    RecordingError: |error| {
        matches!(error, RecordingError::Column { .. } | RecordingError::Absent { .. } | RecordingError::Outside { .. })
    },
    ServiceError: |error| matches!(error, ServiceError::NoTopic { .. } | ServiceError::PastTheEnd { .. }),
    StepError: |_| false,
    SweepError: |error| matches!(error, SweepError::Spec(_) | SweepError::Scene(_) | SweepError::TableName(_)),
    TableError: |_| false,
    TradeError: |error| !matches!(error, TradeError::NoReference(_)),
    UnknownChapter: |_| true,
    UnknownFile: |_| true,
    csv::Error: |_| false,
}
