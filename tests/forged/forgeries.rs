//! Changes of whole recordings, as a forger would make them.

use flexcrank::wire;
use prost_reflect::{DynamicMessage, Value};

use crate::common::rewritten::{Contents, Entry};
use crate::decoded;

/// A change of a whole recording that leaves every message as it is.
pub type Forgery = (&'static str, fn(&mut Contents, usize));

/// Place of message `n` of a topic, counted around.
pub fn nth(all: &Contents, chunk: &str, n: usize) -> usize {
    let found: Vec<usize> = (0..all.messages.len()).filter(|i| all.messages[*i].chunk() == chunk).collect();
    found[n % found.len()]
}

/// Removes a message and, as a careful forger would, closes the gap in its sequence numbers and counts anew.
pub fn remove_and_renumber(all: &mut Contents, at: usize) {
    let removed = all.messages.remove(at);
    all.messages[at..].iter_mut().filter(|entry| entry.topic == removed.topic).for_each(|entry| entry.sequence -= 1);
    all.recount();
}

fn state_fact(all: &mut Contents, key: &str, value: Option<&str>) {
    for (_, entries) in &mut all.metadata {
        match value {
            Some(value) => _ = entries.insert(key.to_owned(), value.to_owned()),
            None => _ = entries.remove(key),
        }
    }
}

/// Sets a number of a message.
fn change(all: &mut Contents, at: usize, field: &str, place: &[(u32, Option<usize>)], value: f64) {
    fn set(message: &mut DynamicMessage, place: &[(u32, Option<usize>)], number: f64) {
        let [(field, index), inner @ ..] = place else { return };
        match (message.get_field_by_number_mut(*field), index) {
            (Some(Value::List(values)), Some(index)) => match &mut values[*index] {
                Value::Message(next) => set(next, inner, number),
                value => *value = Value::F64(number),
            },
            (Some(Value::Message(next)), _) => set(next, inner, number),
            (Some(value), _) => *value = Value::F64(number),
            (None, _) => {}
        }
    }
    let mut message = decoded(&all.messages[at]).expect("a message");
    if message.has_field_by_name(field) {
        set(&mut message, place, value);
        all.messages[at].data = prost::Message::encode_to_vec(&message);
    }
}

fn unstamped(entry: &mut Entry) {
    let mut message = decoded(entry).expect("a message");
    message.clear_field_by_name("stamp");
    entry.data = prost::Message::encode_to_vec(&message);
}

/// Names and changes.
pub const FORGERIES: &[Forgery] = &[
    ("the session's metadata twice", |all, n| all.metadata.insert(n % 2, all.metadata[0].clone())),
    ("a message removed", |all, n| _ = all.messages.remove(n)),
    ("a message removed, counts right", |all, n| {
        let is_report = ["overruns", "gaps", "scene_updates"].contains(&all.messages[n].chunk());
        all.messages.remove(if is_report { nth(all, "angles", n) } else { n });
        all.recount();
    }),
    ("a sample removed, numbers and counts right", |all, n| remove_and_renumber(all, nth(all, "angles", n))),
    ("the first sample removed, numbers and counts right", |all, _| remove_and_renumber(all, nth(all, "angles", 0))),
    ("a command removed, numbers and counts right", |all, n| remove_and_renumber(all, nth(all, "commands", n))),
    ("a sample doubled, numbers and counts right", |all, n| {
        let at = nth(all, ["displacements", "angles", "loads", "energies"][n % 4], n);
        let copy = all.messages[at].clone();
        all.messages[at + 1..].iter_mut().filter(|entry| entry.topic == copy.topic).for_each(|entry| entry.sequence += 1);
        all.messages.insert(at + 1, Entry { sequence: copy.sequence + 1, ..copy });
        all.recount();
    }),
    ("a message doubled", |all, n| {
        all.messages.insert(n, all.messages[n].clone());
        all.recount();
    }),
    ("two messages of different instants exchanged", |all, n| {
        let time = all.messages[n].log_time;
        let next = all.messages.iter().position(|entry| entry.log_time > time).unwrap_or(0);
        all.messages.swap(n, next);
    }),
    ("a sequence number raised", |all, n| all.messages[n].sequence += 1),
    ("all later sequence numbers raised", |all, n| {
        let topic = all.messages[n].topic.clone();
        all.messages[n..].iter_mut().filter(|entry| entry.topic == topic).for_each(|entry| entry.sequence += 1);
    }),
    ("a log time raised", |all, n| all.messages[n].log_time += 1),
    ("a log time lowered", |all, n| all.messages[n].log_time -= 1),
    ("a stamp removed", |all, n| {
        let stamped: Vec<usize> = (0..all.messages.len()).filter(|i| all.messages[*i].chunk() != "scene_updates").collect();
        unstamped(&mut all.messages[stamped[n % stamped.len()]]);
    }),
    ("a message emptied", |all, n| all.messages[n].data.clear()),
    ("bytes that are no message", |all, n| all.messages[n].data = vec![0xff, 0xff]),
    ("bytes appended", |all, n| all.messages[n].data.extend([0xa2, 0x7d, 0x01, 0x00])),
    ("a schema renamed", |all, n| {
        let topic = all.messages[n].topic.clone();
        all.messages.iter_mut().filter(|entry| entry.topic == topic).for_each(|entry| entry.schema = "x.Status".to_owned());
    }),
    ("a schema exchanged", |all, n| {
        let topic = all.messages[n].topic.clone();
        all.messages.iter_mut().filter(|entry| entry.topic == topic).for_each(|entry| entry.schema_data.truncate(100));
    }),
    ("an encoding renamed", |all, n| {
        let topic = all.messages[n].topic.clone();
        all.messages.iter_mut().filter(|entry| entry.topic == topic).for_each(|entry| entry.encoding = "json".to_owned());
    }),
    ("a topic renamed", |all, n| {
        let topic = all.messages[n].topic.clone();
        all.messages.iter_mut().filter(|entry| entry.topic == topic).for_each(|entry| entry.topic.push('2'));
        all.recount();
    }),
    ("the end cut off", |all, n| {
        all.messages.truncate(all.messages.len() - 1 - n % 50);
        all.end = None;
    }),
    ("the end cut off, counts right", |all, n| {
        all.messages.truncate(all.messages.len() - 1 - n % 50);
        all.recount();
    }),
    ("the end cut off, statement kept", |all, n| all.messages.truncate(all.messages.len() - 1 - n % 50)),
    ("the beginning cut off", |all, n| {
        all.messages.drain(..1 + n % 50);
        all.recount();
    }),
    ("no message left", |all, _| {
        all.messages.clear();
        all.recount();
    }),
    ("no status left", |all, _| {
        all.messages.retain(|entry| entry.chunk() != "status");
        all.recount();
    }),
    ("the rate forgotten", |all, _| state_fact(all, "publish_hz", None)),
    ("another rate", |all, _| state_fact(all, "publish_hz", Some("displacements=100,angles=100,loads=100,energies=100"))),
    ("the scene's sum forgotten", |all, _| {
        state_fact(all, "scene_crc32", None);
        all.scene.push_str("# a comment");
    }),
    ("a comment added to the scene", |all, _| all.scene.push_str("# a comment")),
    ("another start", |all, _| state_fact(all, "started", Some("2026-01-01T00:00:00Z"))),
    ("another name", |all, _| state_fact(all, "name", Some("other"))),
    ("a number that is not finite", |all, n| change(all, nth(all, "angles", n), "links", &[(2, Some(0)), (2, None)], f64::NAN)),
    ("a pulse over the limit", |all, n| change(all, nth(all, "commands", n % 3), "torque", &[(3, None), (2, None)], 1e9)),
    ("a checkpoint of another model", |all, n| {
        let at = nth(all, "checkpoint", n);
        let mut message = decoded(&all.messages[at]).expect("a checkpoint");
        message.clear_field_by_name("state");
        all.messages[at].data = prost::Message::encode_to_vec(&message);
    }),
    ("a gap of the status", |all, n| {
        let gap = wire::Gap { stamp: Some(wire::Stamp::default()), topic: "status".to_owned(), count: 1, ..wire::Gap::default() };
        let beside = all.messages[n].clone();
        let topic = format!("{}/gaps", beside.topic.rsplit_once('/').map_or("", |(prefix, _)| prefix));
        let (schema, data) = ("flexcrank.v1.Gap".to_owned(), prost::Message::encode_to_vec(&gap));
        let schema_data = all.messages[nth(all, "angles", 0)].schema_data.clone();
        all.messages.insert(n, Entry { topic, schema, schema_data, sequence: 0, data, ..beside });
        all.recount();
    }),
    ("another end", |all, _| {
        let end = all.end.as_mut().expect("an end");
        end.insert("reason".to_owned(), "stopped by a command".to_owned());
    }),
];
