//! `list`: the services on the bus.

use serde::Serialize;

use super::aligned_table;
use super::client_args::ClientArgs;
use super::exit_status::ExitStatus;
use super::failure::CommandResult;
use super::output::print_json;
use super::signals::interruption_leaves_nothing;
use super::status_line::state_word;
use crate::bus::client::{self, Described};
use crate::bus::{self, BusError, BusOptions};
use crate::wire::status::State;

/// Shown by `--help`.
pub(super) const EXAMPLES: &str = "\
Examples:
  flexcrank list
  flexcrank list --json
  flexcrank list --wait=10s                            also if the first service is still to start
  flexcrank list --connect tcp/192.0.2.1:7447

--json prints one line per service: name, kind (live or replay), state, scene, sim_time_s, endpoints, recording, version; null \
    for what a service did not answer.";

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Print one JSON object per service.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub client: ClientArgs,
}

/// A service as listed.
#[derive(Serialize)]
struct Listed {
    name: String,
    kind: Option<&'static str>,
    state: Option<String>,
    /// The recording that a replay plays.
    scene: Option<String>,
    sim_time_s: Option<f64>,
    endpoints: Option<Vec<String>>,
    /// The file that the service records to.
    recording: Option<String>,
    version: Option<String>,
}

pub(super) fn list(args: &Args) -> CommandResult {
    interruption_leaves_nothing();
    let described = args.client.waiting_for("a service", || described(&args.client.bus.options()))?;
    let services: Vec<Listed> = described.into_iter().map(Listed::from).collect();
    if args.json {
        services.iter().try_for_each(print_json)?;
    } else {
        let head = ["name", "kind", "state", "t, s", "scene", "endpoint", "recording"].map(str::to_owned).to_vec();
        let rows: Vec<Vec<String>> = std::iter::once(head).chain(services.iter().map(Listed::row)).collect();
        aligned_table::print_narrow(&rows)?;
    }
    Ok(ExitStatus::Success)
}

/// The services on the bus.
fn described(options: &BusOptions) -> Result<Vec<Described>, BusError> {
    let expected = options.expected_links();
    let session = options.open_client()?;
    let complete = || client::link_count(&session) >= expected;
    let found = client::services(&session, client::DISCOVERY_TIMEOUT / 2, |found| !found.is_empty() && complete());
    let described = found.and_then(|found| client::describe(&session, &found));
    bus::close(&session)?;
    described.and_then(|described| if described.is_empty() { Err(BusError::NoAnswer) } else { Ok(described) })
}

impl From<Described> for Listed {
    fn from(Described { name, about, status }: Described) -> Self {
        let replays = |state: State, replay| state == State::Replaying || replay;
        let status = status.as_ref();
        let kind = status.map(|status| if replays(status.state(), status.replay.is_some()) { "replay" } else { "live" });
        let (scene, endpoints, version) = about
            .map(|about| (about.scene, about.endpoints, about.version))
            .map_or((None, None, None), |(scene, endpoints, version)| (Some(scene), Some(endpoints), Some(version)));
        Listed {
            name: name.to_string(),
            kind,
            state: status.map(|status| state_word(status).to_lowercase()),
            scene,
            sim_time_s: status.and_then(|status| Some(status.stamp.as_ref()?.sim_time_s)),
            endpoints,
            recording: status.and_then(|status| status.recording.clone()),
            version,
        }
    }
}

impl Listed {
    /// The row of the table; a dash for what is absent.
    fn row(&self) -> Vec<String> {
        let or_dash = |text: Option<String>| text.filter(|text| !text.is_empty()).unwrap_or_else(|| "–".to_owned());
        vec![
            self.name.clone(),
            or_dash(self.kind.map(str::to_owned)),
            or_dash(self.state.clone()),
            or_dash(self.sim_time_s.map(|time_s| format!("{time_s:.1}"))),
            or_dash(self.scene.clone()),
            or_dash(self.endpoints.as_ref().map(|endpoints| endpoints.join(" "))),
            or_dash(self.recording.clone()),
        ]
    }
}
