//! Parameters: the keys of the scene in force, which viewers read, and write where a running scene can be changed.

use std::collections::BTreeMap;
use std::sync::Arc;

use ::foxglove::websocket::{AnyClient, GetParametersResponder, Parameter, ParameterHandler, SetParametersResponder};

use super::commander::{Commander, Done};
use super::scene_keys::{parameters, toml};
use crate::bus::{Name, Session, client};
use crate::wire::{self, control};

/// The parameters of all services.
#[derive(Clone)]
pub(super) struct SceneParameters {
    commander: Commander,
    names: Arc<[Name]>,
}

/// The beginning of a parameter's name, before the scene's key.
fn prefix(name: &Name) -> String {
    name.key("")
}

/// All parameters of one service at this instant; none if it does not answer, as during its start.
pub(super) fn in_force(session: &Session, name: &Name) -> Vec<Parameter> {
    client::scene(session, name).map_or(Vec::new(), |scene| parameters(&prefix(name), &scene))
}

impl SceneParameters {
    /// The parameters of the services of these names.
    pub fn new(commander: Commander, names: Arc<[Name]>) -> Self {
        SceneParameters { commander, names }
    }

    /// The parameters of these names, or all of them if no name is given.
    fn named(&self, wanted: &[String]) -> Vec<Parameter> {
        let all = self.names.iter().flat_map(|name| in_force(self.commander.session(), name));
        all.filter(|parameter| wanted.is_empty() || wanted.contains(&parameter.name)).collect()
    }

    /// The changes that parameters ask for, by service.
    ///
    /// # Errors
    /// The name of a parameter that is nobody's key, or has no value.
    fn changes(&self, wanted: &[Parameter]) -> Result<BTreeMap<&Name, Vec<String>>, String> {
        let mut changes: BTreeMap<&Name, Vec<String>> = BTreeMap::new();
        for Parameter { name, value, .. } in wanted {
            let owner = self.names.iter().find_map(|owner| Some((owner, name.strip_prefix(&prefix(owner))?)));
            let (owner, key) = owner.ok_or_else(|| format!("`{name}` is no parameter"))?;
            let value = value.as_ref().ok_or_else(|| format!("`{name}` cannot be removed"))?;
            changes.entry(owner).or_default().push(format!("{key}={}", toml(value)));
        }
        Ok(changes)
    }
}

impl ParameterHandler for SceneParameters {
    fn get(&self, _: AnyClient, names: Vec<String>, _: Option<String>, responder: GetParametersResponder) {
        let all = self.clone();
        self.commander.jobs().submit(move |has_room| responder.respond(if has_room { all.named(&names) } else { Vec::new() }));
    }

    fn set(&self, client: AnyClient, wanted: Vec<Parameter>, _: Option<String>, responder: SetParametersResponder) {
        let changes = match self.changes(&wanted) {
            Ok(changes) => changes,
            Err(why) => {
                client.send_error(why);
                BTreeMap::new()
            }
        };
        for (name, changes) in changes {
            if let Some(why) = self.commander.refusal(&name.control()) {
                client.send_error(format!("{}: {why}", changes.join(", ")));
                continue;
            }
            let (client, shown) = (client.clone(), changes.join(", "));
            let done: Done = Box::new(move |reply| match reply {
                Ok(reply) if reply.accepted => {}
                Ok(reply) => client.send_error(format!("{shown}: {}", reply.reason)),
                Err(why) => client.send_error(format!("{shown}: {why}")),
            });
            self.commander.control(name, control::Action::Set(wire::Set { changes }), done);
        }
        // This is queued behind the changes, so that the answer has the values after them.
        let names: Vec<String> = wanted.into_iter().map(|parameter| parameter.name).collect();
        let all = self.clone();
        self.commander.jobs().submit(move |has_room| responder.respond(if has_room { all.named(&names) } else { Vec::new() }));
    }
}
