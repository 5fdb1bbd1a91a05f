//! A scene's keys as parameters, and parameters as changes of a scene.

use ::foxglove::websocket::{Parameter, ParameterValue};
use toml::Value;

/// The keys of a scene with their values. Parts of a key are joined by dots; tables of a list are numbered from 0.
pub(super) fn parameters(prefix: &str, scene: &str) -> Vec<Parameter> {
    let mut all = Vec::new();
    if let Ok(table) = scene.parse::<toml::Table>() {
        collect(prefix, &Value::Table(table), &mut all);
    }
    all
}

fn collect(name: &str, value: &Value, all: &mut Vec<Parameter>) {
    let below = |part: &str| if name.ends_with('/') { format!("{name}{part}") } else { format!("{name}.{part}") };
    match value {
        Value::Table(table) => table.iter().for_each(|(part, value)| collect(&below(part), value, all)),
        Value::Array(tables) if tables.iter().any(Value::is_table) => {
            tables.iter().enumerate().for_each(|(index, value)| collect(&below(&index.to_string()), value, all));
        }
        value => all.push(parameter(name, value)),
    }
}

fn parameter(name: &str, value: &Value) -> Parameter {
    match value {
        Value::Float(number) => Parameter::float64(name, *number),
        Value::Array(values) if values.iter().all(Value::is_float) => {
            Parameter::float64_array(name, values.iter().filter_map(Value::as_float))
        }
        value => Parameter { name: name.to_owned(), r#type: None, value: Some(parameter_value(value)) },
    }
}

fn parameter_value(value: &Value) -> ParameterValue {
    match value {
        Value::Float(number) => ParameterValue::Float64(*number),
        Value::Integer(number) => ParameterValue::Integer(*number),
        Value::Boolean(flag) => ParameterValue::Bool(*flag),
        Value::String(text) => ParameterValue::String(text.clone()),
        Value::Datetime(time) => ParameterValue::String(time.to_string()),
        Value::Array(values) => ParameterValue::Array(values.iter().map(parameter_value).collect()),
        Value::Table(table) => {
            ParameterValue::Dict(table.iter().map(|(key, value)| (key.clone(), parameter_value(value))).collect())
        }
    }
}

/// A parameter's value in TOML, as `KEY=VALUE` needs it.
pub(super) fn toml(value: &ParameterValue) -> String {
    match value {
        ParameterValue::Integer(number) => number.to_string(),
        ParameterValue::Float64(number) => Value::Float(*number).to_string(),
        ParameterValue::Bool(flag) => flag.to_string(),
        ParameterValue::String(text) => Value::String(text.clone()).to_string(),
        ParameterValue::Array(values) => format!("[{}]", values.iter().map(toml).collect::<Vec<_>>().join(", ")),
        ParameterValue::Dict(entries) => {
            let entry = |(key, value): (&String, &ParameterValue)| format!("{} = {}", Value::String(key.clone()), toml(value));
            format!("{{ {} }}", entries.iter().map(entry).collect::<Vec<_>>().join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;

    #[test]
    fn prop_each_key_of_a_scene_is_a_parameter_that_can_be_written_back() -> Result<(), Box<dyn std::error::Error>> {
        for scene in ["crank-slider", "thesis-two-masses", "thesis-compressor"] {
            let source = SceneSource::open(scene, &[])?;
            let all = parameters("", &source.text);
            assert!(all.len() > 5, "{scene}: {all:?}");
            let changes = all.iter().filter_map(|parameter| {
                let key = parameter.name.trim_start_matches('.');
                Some(format!("{key}={}", toml(parameter.value.as_ref()?)))
            });
            let changes: Vec<String> = changes.collect();
            assert_eq!(SceneSource::parse(scene, &source.text, &changes)?.scene, source.scene, "{changes:?}");
        }
        Ok(())
    }
}
