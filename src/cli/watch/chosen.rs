//! The signals that `watch --plain --signals` prints, and the refusal of names that no signal has.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use super::super::failure::{CommandResult, Failure};
use super::signals::{Signals, topic_of_signal};
use crate::nearest::did_you_mean_column;
use crate::shown::shown_name;
use crate::wire::{Message, NodeState, Shadow, Stamp, Status, Topic};

/// Lists of messages, whose names `export` sets before those of links, nodes, joints and elements.
const LISTS: [&str; 4] = ["links", "nodes", "joints", "elements"];

/// The chosen signals; none stands for all.
#[derive(Debug, Default)]
pub(super) struct ChosenSignals {
    /// Their names, as given.
    pub names: Vec<String>,
    /// All signals so far, until each name has one.
    seen: Signals,
    /// The topics that have published until then.
    heard: HashSet<Topic>,
    /// Arrival of the first sample.
    since: Option<Instant>,
}

impl ChosenSignals {
    pub(super) fn new(names: &[String]) -> Self {
        let mut seen = Signals::default();
        // A shadow may begin later, and has no samples while the service is paused. Of status, some are absent at first.
        seen.shadow(&Shadow { stamp: Some(Stamp::default()), joint_force_n: Some(0.0), ..Shadow::default() });
        seen.status(&Status { lateness_p99_s: Some(0.0), sample_age_p99_s: Some(0.0), ..Status::default() });
        ChosenSignals { names: names.to_vec(), seen, ..ChosenSignals::default() }
    }

    /// Adds the signals of a message.
    pub(super) fn add(&mut self, message: &Message) {
        if self.missing().next().is_none() {
            return;
        }
        self.seen.add(message);
        // Loads show whether there is a slider, perhaps long before the next displacements.
        if self.seen.has_slider {
            self.seen.slider(f64::NAN, &NodeState::default());
        }
        if message.topic().is_telemetry() {
            self.heard.insert(message.topic());
            self.since.get_or_insert_with(Instant::now);
        }
    }

    /// Whether every name has a signal, may have one later, or no sample has come yet. Topics have rates of their own, so that a signal
    /// may come later than others.
    ///
    /// # Errors
    /// [`Failure`] for a name that is refused: this long after the first sample, or once all topics of samples have published.
    pub(super) fn are_there(&self, patience: Duration) -> CommandResult<bool> {
        let Some(since) = self.since.filter(|_| self.missing().next().is_some()) else { return Ok(true) };
        let mut telemetry = Topic::ALL.iter().filter(|topic| topic.is_telemetry());
        if since.elapsed() < patience && !telemetry.all(|topic| self.heard.contains(topic)) {
            return Ok(false);
        }
        self.missing().find_map(|name| self.refusal(name)).map_or(Ok(true), Err)
    }

    /// The names that have no signal so far.
    fn missing(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str).filter(move |name| self.seen.find(name).is_none())
    }

    /// The refusal of a name without a signal. As long as its topic has published nothing, a name with the right last part may be right.
    /// One without a link, joint or node is right: its signal may come later.
    fn refusal(&self, name: &str) -> Option<Failure> {
        let shown = shown_name(name);
        match topic_of_signal(name).filter(|topic| !self.heard.contains(topic)) {
            Some(_) if !name.contains('.') => None,
            Some(silent) => Some(Failure::Failed(format!(
                "the service has published nothing on `{}` yet, so it is not known whether there is a signal `{shown}`",
                silent.chunk()
            ))),
            None => {
                let near = |name| Some(did_you_mean_column(name, self.seen.names())).filter(|near| !near.is_empty());
                let without_list = || near(name.split_once('.').filter(|(list, _)| LISTS.contains(list))?.1);
                let hint = near(name).or_else(without_list);
                let hint = hint.unwrap_or_else(|| "; `watch --plain --json` prints all by name".to_owned());
                Some(Failure::Usage(format!("no signal `{shown}`{hint}")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::recording::Messages;
    use crate::wire::{Displacements, Loads};

    fn chosen(names: &[&str]) -> ChosenSignals {
        ChosenSignals::new(&names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn val_a_name_is_refused_when_no_sample_has_it() {
        let loads = Message::Loads(Box::new(Loads { resistance_n: Some(1.0), ..Loads::default() }));
        for (name, refusal) in [
            ("driving_torque_nm", None),
            ("shadow.angle_rad", None),
            ("driving_torqe_nm", Some("no signal `driving_torqe_nm`; did you mean `driving_torque_nm`?")),
            ("xyz", Some("no signal `xyz`; `watch --plain --json` prints all by name")),
        ] {
            let mut chosen = chosen(&[name]);
            assert!(matches!(chosen.are_there(Duration::ZERO), Ok(true)), "{name}: no sample has come");
            chosen.add(&loads);
            let soon = chosen.are_there(Duration::from_secs(60));
            assert!(soon.is_ok_and(|there| there == refusal.is_none()), "{name}: it may come soon");
            let said = match chosen.are_there(Duration::ZERO) {
                Ok(true) => None,
                Err(Failure::Usage(said)) => Some(said),
                other => Some(format!("{other:?}")),
            };
            assert_eq!(said.as_deref(), refusal, "{name}");
        }
    }

    /// Every refusal took three seconds.
    #[test]
    fn regress_a_wrong_name_is_refused_as_soon_as_all_topics_of_samples_have_published() {
        let minute = Duration::from_secs(60);
        let (mut wrong, mut of_status) = (chosen(&["xyz"]), chosen(&["sample_age_p99_s"]));
        for (message, is_last) in [
            (Message::Displacements(Box::default()), false),
            (Message::Angles(Box::default()), false),
            (Message::Energies(Box::default()), false),
            (Message::Loads(Box::default()), true),
        ] {
            [&mut wrong, &mut of_status].into_iter().for_each(|chosen| chosen.add(&message));
            let judged = wrong.are_there(minute);
            assert!(if is_last { judged.is_err() } else { matches!(judged, Ok(false)) }, "{message:?}");
            assert!(matches!(of_status.are_there(minute), Ok(true)), "it may come with a later status");
        }
    }

    #[test]
    fn regress_an_unknown_signal_of_a_node_has_one_that_moves_suggested() {
        let node = |index| NodeState { link: "beam".to_owned(), index, deflection_m: Some(0.0), ..NodeState::default() };
        let nodes = (0..=12).map(node).collect();
        let displacements = Message::Displacements(Box::new(Displacements { nodes, ..Displacements::default() }));
        for (name, near) in
            [("tip.y_m", "beam.12.y_m"), ("beam.deflection_m", "beam.6.deflection_m"), ("nodes.beam.8.dy_m", "beam.8.y_m")]
        {
            let mut chosen = chosen(&[name]);
            chosen.add(&displacements);
            let judged = chosen.are_there(Duration::ZERO);
            let refusal = format!("no signal `{name}`; did you mean `{near}`?");
            assert!(matches!(&judged, Err(Failure::Usage(said)) if *said == refusal), "{judged:?}");
        }
    }

    /// A replay that begins between two samples of a topic, or displacements that are published rarely.
    #[test]
    fn regress_a_name_whose_topic_has_published_nothing_is_not_called_unknown() {
        let displacements = Message::Displacements(Box::default());
        let loads = Message::Loads(Box::new(Loads { resistance_n: Some(1.0), ..Loads::default() }));
        let silent = "the service has published nothing on `angles` yet, so it is not known whether there is a signal";
        let unknown = |name: &str| Failure::Usage(format!("no signal `{name}`; `watch --plain --json` prints all by name"));
        for (name, refusal) in [
            ("kinetic_j", None),
            ("slider.vx_m_per_s", None),
            ("crank.chord_rad", Some(Failure::Failed(format!("{silent} `crank.chord_rad`")))),
            ("links.crank.chord_rad", Some(Failure::Failed(format!("{silent} `links.crank.chord_rad`")))),
            ("chord_rad", Some(unknown("chord_rad"))),
            ("crank.2.y_m", Some(unknown("crank.2.y_m"))),
            ("crank.revolutions", Some(unknown("crank.revolutions"))),
        ] {
            let mut chosen = chosen(&[name]);
            [&displacements, &loads].into_iter().for_each(|message| chosen.add(message));
            let judged = chosen.are_there(Duration::ZERO);
            assert_eq!(format!("{judged:?}"), format!("{:?}", refusal.map_or(Ok(true), Err)), "{name}");
        }
        let mut chosen = chosen(&["crank.chord_rad"]);
        chosen.add(&loads);
        chosen.add(&Message::Angles(Box::default()));
        let judged = chosen.are_there(Duration::ZERO);
        assert!(matches!(&judged, Err(Failure::Usage(said)) if said.starts_with("no signal `crank.chord_rad`")), "{judged:?}");
    }

    #[test]
    fn prop_the_topic_of_each_signal_is_known_by_its_name() -> Result<(), Box<dyn std::error::Error>> {
        for message in Messages::open(Path::new("recordings/sample-three-pulses.mcap"))?.take(100) {
            let message = message?;
            let schema = message.channel.schema.as_ref().map_or("", |schema| &schema.name);
            let Some(message) = Message::decode(schema, &message.data)? else { continue };
            let mut signals = Signals::default();
            signals.add(&message);
            for name in signals.names().filter(|_| message.topic().is_telemetry()) {
                assert_eq!(topic_of_signal(name), Some(message.topic()), "{name}");
            }
        }
        Ok(())
    }
}
