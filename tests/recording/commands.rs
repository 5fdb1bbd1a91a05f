//! Tables of recorded commands: which command it was.

use flexcrank::bus::client;
use flexcrank::recording::{Export, RecordingError, export, read_columns};
use flexcrank::runtime::Pace;
use flexcrank::simulation::PublishRate;
use flexcrank::wire::{self, control::Action};

use crate::common::{Outcome, Service, scene};

/// Commands without content were rows without a difference.
#[test]
fn regress_commands_are_told_apart_in_tables() -> Outcome {
    let service = Service::start(scene(&[])?, Pace::Factor(1.0), None, PublishRate::Hz(100.0))?;
    let actions = [Action::Pause(wire::Pause {}), Action::Reset(wire::Reset {}), Action::Resume(wire::Resume {})];
    for action in actions {
        let control = wire::Control { id: String::new(), action: Some(action) };
        assert!(client::control(&service.client, &service.name, &control)?.accepted, "{control:?}");
    }
    let (_, folder) = service.stop()?;
    let recording = folder.path().join("run.mcap");
    let contents = read_columns(&recording, &|_| {})?;
    let commands = contents.topics.iter().find(|topic| topic.name.ends_with("/commands")).ok_or("no commands")?;
    let texts = |column: &str| commands.texts.iter().find(|(name, _)| name == column).map(|(_, texts)| texts.as_slice());
    let names = ["pause", "reset", "resume", "stop"].map(str::to_owned);
    assert_eq!(texts("control.action"), Some(&names[..]), "in the order in which they took effect");
    assert_eq!(texts("command"), Some(&["control".to_owned()][..]));
    let numbers = commands.columns.iter().find(|(name, _)| name == "control.action").map(|(_, numbers)| numbers.as_slice());
    assert_eq!(numbers, Some(&[0.0, 1.0, 2.0, 3.0][..]), "one for each row");
    let tables = folder.path().join("tables");
    let of = |column: &str| Export { csv: Some(tables.clone()), columns: vec![column.to_owned()], ..Export::default() };
    export(&recording, &of("control.action"), &|_| {})?;
    let table = std::fs::read_to_string(tables.join("flexcrank.test.commands.csv"))?;
    let last: Vec<&str> = table.lines().filter_map(|line| line.rsplit(',').next()).collect();
    assert_eq!(last, ["control.action", "pause", "reset", "resume", "stop"]);
    let refused = export(&recording, &of("control.actions"), &|_| {});
    assert!(matches!(refused, Err(RecordingError::Column { .. })), "{refused:?}");
    Ok(())
}
