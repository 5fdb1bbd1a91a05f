//! `--foxglove`: a server for Foxglove and Lichtblick beside `run` and `replay`.

#[cfg_attr(not(feature = "foxglove"), path = "not_built.rs")]
mod viewers;

use std::net::SocketAddr;

pub(super) use viewers::Viewers;

/// Rate of scene updates beside a server, unless another is given, Hz.
const SCENE_UPDATES_HZ: f64 = 25.0;

/// Options of the server.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub(super) struct FoxgloveArgs {
    /// Show everything in Foxglove and Lichtblick: serve it at ws://127.0.0.1:8765, or at ADDR. A run then also publishes scene
    /// updates, and a replay follows the viewer's timeline and stays at its end.
    #[arg(long, value_name = "ADDR", num_args = 0..=1, require_equals = true, default_missing_value = "127.0.0.1:8765")]
    #[arg(value_parser = address)]
    foxglove: Option<SocketAddr>,
    /// Let viewers send torque pulses, setpoints and control commands, and set parameters.
    #[arg(long, requires = "foxglove")]
    foxglove_control: bool,
}

impl FoxgloveArgs {
    /// Whether there is a server.
    pub(super) fn is_given(self) -> bool {
        self.foxglove.is_some()
    }

    /// Whether viewers may send commands.
    pub(super) fn has_control(self) -> bool {
        self.foxglove_control
    }

    /// Rate of scene updates: the given one, or that of the server.
    pub(super) fn scene_updates_hz(self, given: Option<f64>) -> Option<f64> {
        given.or(self.foxglove.map(|_| SCENE_UPDATES_HZ))
    }
}

fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| "not of the form IP:PORT, such as 127.0.0.1:8765 or [::1]:8765".to_owned())
}
