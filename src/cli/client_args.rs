//! Options of commands to one service: the bus, and how long to wait for the service.

use std::path::Path;
use std::time::{Duration, Instant};

use super::bus_args::BusArgs;
use super::failure::{CommandResult, Failure};
use super::signals::{interruption_leaves, interruption_leaves_nothing};
use super::values::{positive_time, seconds};
use crate::bus::{self, BusError, BusOptions, Name, NameClaim, Session, client};
use crate::recording::begins_as_mcap;
use crate::scene::toml_hint;

/// Time between two looks for a service that is not there yet.
const RETRY_PERIOD: Duration = Duration::from_millis(100);
/// Longest wait where `--wait` states none, s.
const USUAL_WAIT_S: f64 = 60.0;

#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct ClientArgs {
    /// Wait until the service is on the bus, at most this time (a minute if none is given), instead of failing.
    #[arg(long, global = true, value_name = "TIME", num_args = 0..=1, require_equals = true, value_parser = positive_time)]
    wait: Option<Option<f64>>,
    #[command(flatten)]
    pub bus: BusArgs,
}

impl ClientArgs {
    /// Opens a session on which the service is present, to send it something.
    pub(super) fn open(&self, name: &Name) -> CommandResult<Session> {
        interruption_leaves("nothing was sent".to_owned());
        self.open_present(name)
    }

    /// Opens a session on which the service is present, to read from it.
    pub(super) fn open_to_read(&self, name: &Name) -> CommandResult<Session> {
        interruption_leaves_nothing();
        self.open_present(name)
    }

    fn open_present(&self, name: &Name) -> CommandResult<Session> {
        self.refuse_time_as_name(name)?;
        if let Some(hint) = file_hint(&name.to_string()) {
            return self.try_open(name).map_err(|absent| match may_appear(&absent) {
                true => Failure::Usage(format!("{name}: not a service, but {hint}")),
                false => absent.into(),
            });
        }
        self.waiting_for(&format!("`{name}`"), || self.try_open(name))
    }

    /// Refuses a time to wait where no service is named: `named` is the option that names one.
    pub(super) fn must_not_wait(&self, named: &str) -> CommandResult<()> {
        match self.wait {
            Some(_) => Err(Failure::Usage(format!("--wait waits for a service: give {named}, too"))),
            None => Ok(()),
        }
    }

    /// Refuses a name that was meant as the time to wait: `--wait 3s`.
    fn refuse_time_as_name(&self, name: &Name) -> CommandResult<()> {
        if self.wait == Some(None) && seconds(&name.to_string()).is_some() {
            let why = format!("`{name}` is read as the name of a service: --wait={name} waits that long");
            return Err(Failure::Usage(format!("{why}; --wait=1min waits for a service of this name")));
        }
        Ok(())
    }

    /// Tries until it succeeds, or fails for a reason that waiting does not mend, or the time to wait is over.
    pub(super) fn waiting_for<T>(&self, awaited: &str, attempt: impl Fn() -> Result<T, BusError>) -> CommandResult<T> {
        let (begun, longest_s) = (Instant::now(), self.wait.map(|given_s| given_s.unwrap_or(USUAL_WAIT_S)));
        loop {
            match (attempt(), longest_s) {
                (Err(error), Some(wait_s)) if may_appear(&error) => {
                    if begun.elapsed().as_secs_f64() > wait_s {
                        return Err(Failure::Failed(format!("{awaited} did not appear in {wait_s} s: {error}")));
                    }
                    std::thread::sleep(RETRY_PERIOD);
                }
                (Err(error @ BusError::Silent(_)), None) => {
                    return Err(Failure::Failed(format!("{error}; --wait waits for one that is still starting")));
                }
                (done, _) => return Ok(done?),
            }
        }
    }

    fn try_open(&self, name: &Name) -> Result<Session, BusError> {
        let options = self.bus.options();
        // A service that listens elsewhere claims no name.
        let is_silent = || options.connect.is_empty() && options.is_local() && NameClaim::is_taken(name);
        Self::find(name, &options).map_err(|absent| match absent {
            BusError::NoLocalService | BusError::NoSuchService { .. } if is_silent() => BusError::Silent(name.clone()),
            absent => absent,
        })
    }

    /// Opens a session on which the service answers.
    fn find(name: &Name, options: &BusOptions) -> Result<Session, BusError> {
        let session = options.open_client()?;
        match client::wait_for_service(&session, name) {
            Ok(()) => Ok(session),
            Err(absent) => {
                bus::close(&session)?;
                Err(absent)
            }
        }
    }
}

/// The commands for a file that was given in place of the name of a service, if it is a recording, a scene or a campaign.
pub(super) fn file_hint(name: &str) -> Option<String> {
    let path = Path::new(name);
    let recording = || format!("a recording: `flexcrank replay {name}` plays it on the bus, `flexcrank plot {name}` draws it");
    begins_as_mcap(path).then(recording).or_else(|| toml_hint(path))
}

/// Whether a service that starts later would mend the error.
fn may_appear(error: &BusError) -> bool {
    use BusError::{NoAnswer, NoLocalService, NoSuchService, NotAdmitted, Silent};
    matches!(error, NoLocalService | NoAnswer | NoSuchService { .. } | Silent(_) | NotAdmitted(_))
}
