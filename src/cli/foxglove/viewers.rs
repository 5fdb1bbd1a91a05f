//! The server, if one is asked for.

use std::sync::mpsc::Sender;

use super::FoxgloveArgs;
use crate::bus::{LogTime, Name, Session};
use crate::cli::failure::{CommandResult, Failure};
use crate::foxglove::{FoxgloveError, FoxgloveServer, ServerOptions, Source, Timeline};
use crate::service::{OnStatus, ReplayCommand, ReplayStart, ReplayViewer, ServiceError};

/// The viewers of a run or a replay: a server with the log times that it reads; nothing if none was asked for.
#[derive(Default)]
pub(in crate::cli) struct Viewers {
    server: Option<FoxgloveServer>,
    log_times: Vec<LogTime>,
}

impl FoxgloveArgs {
    fn options(self) -> Option<ServerOptions> {
        self.foxglove.map(|address| ServerOptions { address, control: self.foxglove_control })
    }
}

impl Viewers {
    /// Whether this build has a server: it has.
    pub(in crate::cli) fn check(_: FoxgloveArgs) -> CommandResult<()> {
        Ok(())
    }

    /// Starts a server for services of these names, if one is asked for.
    pub(in crate::cli) async fn beside_run(args: FoxgloveArgs, session: &Session, names: &[Name]) -> CommandResult<Self> {
        let Some(options) = args.options() else { return Ok(Viewers::default()) };
        let log_times: Vec<LogTime> = names.iter().map(|_| LogTime::default()).collect();
        let sources = names.iter().zip(&log_times).map(|(name, log_time)| Source::live(name.clone(), log_time.clone())).collect();
        let server = Some(FoxgloveServer::start(session, options, sources, None).await?);
        Ok(Viewers { server, log_times })
    }

    /// Starts a server for a replay, if one is asked for.
    pub(in crate::cli) async fn beside_replay(
        args: FoxgloveArgs,
        session: &Session,
        start: &ReplayStart<'_>,
        commands: Sender<ReplayCommand>,
        on_status: OnStatus,
    ) -> Result<(Self, ReplayViewer), ServiceError> {
        let Some(options) = args.options() else { return Ok((Viewers::default(), on_status.into())) };
        let log_time = LogTime::default();
        let source = Source::replay(start, log_time.clone());
        let timeline = Timeline::new(start.span_ns, commands);
        let server = FoxgloveServer::start(session, options, vec![source], Some(timeline)).await;
        let server = server.map_err(|error| ServiceError::Viewer(error.to_string()))?;
        let viewer = ReplayViewer { on_status, log_time: Some(log_time), stays_at_end: true };
        Ok((Viewers { server: Some(server), log_times: Vec::new() }, viewer))
    }

    /// The cell for the log times of service `index`.
    pub(in crate::cli) fn log_time(&self, index: usize) -> Option<LogTime> {
        self.log_times.get(index).cloned()
    }

    /// The address of the server, for people.
    pub(in crate::cli) fn place(&self) -> Option<String> {
        self.server.as_ref().map(|server| format!("Foxglove at ws://{}", server.address()))
    }

    /// Ends the server.
    pub(in crate::cli) async fn stop(self) -> CommandResult<()> {
        match self.server {
            Some(server) => Ok(server.stop().await?),
            None => Ok(()),
        }
    }
}

impl From<FoxgloveError> for Failure {
    fn from(error: FoxgloveError) -> Self {
        Failure::Failed(error.to_string())
    }
}
