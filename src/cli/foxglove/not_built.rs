//! A build without the server.

use std::sync::mpsc::Sender;

use super::FoxgloveArgs;
use crate::bus::{LogTime, Name, Session};
use crate::cli::failure::{CommandResult, Failure};
use crate::service::{OnStatus, ReplayCommand, ReplayStart, ReplayViewer, ServiceError};

/// No viewers.
#[derive(Default)]
pub(in crate::cli) struct Viewers {}

impl Viewers {
    /// Refuses a server.
    pub(in crate::cli) fn check(args: FoxgloveArgs) -> CommandResult<()> {
        let FoxgloveArgs { foxglove, foxglove_control } = args;
        let problem = "this build has no Foxglove server: build it with `--features foxglove`";
        if foxglove.is_some() || foxglove_control { Err(Failure::Usage(problem.to_owned())) } else { Ok(()) }
    }

    /// There is none.
    pub(in crate::cli) async fn beside_run(_: FoxgloveArgs, _: &Session, _: &[Name]) -> CommandResult<Self> {
        Ok(Viewers {})
    }

    /// There is none.
    pub(in crate::cli) async fn beside_replay(
        _: FoxgloveArgs,
        _: &Session,
        _: &ReplayStart<'_>,
        _: Sender<ReplayCommand>,
        on_status: OnStatus,
    ) -> Result<(Self, ReplayViewer), ServiceError> {
        Ok((Viewers {}, on_status.into()))
    }

    /// There is none.
    pub(in crate::cli) fn log_time(&self, _: usize) -> Option<LogTime> {
        None
    }

    /// There is none.
    pub(in crate::cli) fn place(&self) -> Option<String> {
        None
    }

    /// Does nothing.
    pub(in crate::cli) async fn stop(self) -> CommandResult<()> {
        Ok(())
    }
}
