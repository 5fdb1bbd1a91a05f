//! Fields of messages: their places, other values for them, and those that the guide names as not provable.

use std::collections::{BTreeMap, BTreeSet};

use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, ReflectMessage, Value};

use crate::Failure;
use crate::common::rewritten::Entry;

/// The names in the section of the guide that says what cannot be proved; `*` stands for any ending.
pub fn not_provable() -> Result<BTreeSet<String>, Failure> {
    let guide = include_str!("../../src/guide/recordings.md");
    let section = guide.split("## Limits of `verify`").nth(1).and_then(|rest| rest.split("\n## ").next());
    let names = section.ok_or("no such section")?.lines().filter(|line| line.starts_with("- ") || line.starts_with("  "));
    Ok(names.flat_map(|line| line.split('`').skip(1).step_by(2)).map(str::to_owned).collect())
}

pub fn is_named(names: &BTreeSet<String>, name: &str) -> bool {
    names.iter().any(|known| known.strip_suffix('*').map_or(known == name, |beginning| name.starts_with(beginning)))
}

/// A field in a message: field numbers and indices of lists, from the outside inwards.
pub type Place = Vec<(u32, Option<usize>)>;

/// Adds all fields of a message with values of their own, by dotted name.
pub fn places(message: &DynamicMessage, name: &str, at: &Place, found: &mut BTreeMap<String, Vec<Place>>) {
    for field in message.descriptor().fields() {
        let name = format!("{name}.{}", field.name());
        let of_choice = field.containing_oneof().is_some_and(|oneof| !oneof.is_synthetic());
        if of_choice && !message.has_field(&field) {
            continue;
        }
        let value = message.get_field(&field);
        let mut add = |index: Option<usize>, value: &Value| {
            let at: Place = at.iter().copied().chain([(field.number(), index)]).collect();
            match value {
                Value::Message(inner) if message.has_field(&field) => places(inner, &name, &at, found),
                Value::Message(_) => {}
                _ => found.entry(name.clone()).or_default().push(at),
            }
        };
        match value.as_ref() {
            Value::List(values) => values.iter().enumerate().for_each(|(index, value)| add(Some(index), value)),
            value => add(None, value),
        }
    }
}

fn other(value: &Value, field: &FieldDescriptor) -> Value {
    match value {
        Value::Bool(value) => Value::Bool(!value),
        Value::I32(value) => Value::I32(value.wrapping_add(1)),
        Value::I64(value) => Value::I64(value.wrapping_add(1)),
        Value::U32(value) => Value::U32(value.wrapping_add(1)),
        Value::U64(value) => Value::U64(value.wrapping_add(1)),
        Value::F32(value) => Value::F32(value.next_up()),
        // The last bit of an input may have no effect.
        Value::F64(value) if ["TorquePulse", ".Setpoint", ".Advance"].iter().any(|of| field.full_name().contains(of)) => {
            Value::F64(value * (1.0 + 1e-9) + 1e-9)
        }
        Value::F64(value) => Value::F64(value.next_up()),
        Value::String(value) => Value::String(format!("{value}x")),
        Value::EnumNumber(value) => Value::EnumNumber((value + 1) % 3),
        other => panic!("{}: {other:?}", field.full_name()),
    }
}

pub fn alter(message: &mut DynamicMessage, place: &[(u32, Option<usize>)]) {
    let [(number, index), inner @ ..] = place else { return };
    let field = message.descriptor().get_field(*number).expect("a known field");
    let change = |value: &mut Value| match value {
        Value::Message(next) => alter(next, inner),
        value => *value = other(value, &field),
    };
    match (message.get_field_mut(&field), index) {
        (Value::List(values), Some(index)) => change(&mut values[*index]),
        (value, _) => change(value),
    }
}

pub fn decoded(entry: &Entry) -> Result<DynamicMessage, Failure> {
    let pool = DescriptorPool::decode(entry.schema_data.as_slice())?;
    let descriptor = pool.get_message_by_name(&entry.schema).ok_or("an unknown schema")?;
    Ok(DynamicMessage::decode(descriptor, entry.data.as_slice())?)
}
