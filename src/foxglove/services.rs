//! Services that viewers call: the command keys of each service, with JSON.

use ::foxglove::Schema;
use ::foxglove::websocket::service::{Handler, Request, Responder, Service, ServiceSchema};

use super::commander::{Commander, Done};
use super::requests::{self, CONTROL_SCHEMA, PULSE_SCHEMA, REPLY_SCHEMA, SETPOINT_SCHEMA};
use crate::bus::Name;

/// Encoding of requests and replies.
pub(super) const JSON: &str = "json";

/// Sends one command and passes its reply on.
type Send = fn(&Commander, &Name, &[u8], Done) -> Result<(), (String, Done)>;

/// The services of one name.
pub(super) fn services(commander: &Commander, name: &Name) -> Vec<Service> {
    let service = |key: String, (title, schema): (&str, &'static str), send: Send| {
        let request = Schema::new(title, "jsonschema", schema.as_bytes());
        let reply = Schema::new("flexcrank.v1.CommandReply", "jsonschema", REPLY_SCHEMA.as_bytes());
        let described = ServiceSchema::new(title).with_request(JSON, request).with_response(JSON, reply);
        Service::builder(key.as_str(), described).handler(CommandService {
            commander: commander.clone(),
            name: name.clone(),
            key,
            send,
        })
    };
    vec![
        service(name.torque(), ("flexcrank.v1.TorquePulse", PULSE_SCHEMA), |commander, name, json, done| {
            with(requests::pulse(json), done, |pulse, done| commander.pulse(name, pulse, done))
        }),
        service(name.setpoint(), ("flexcrank.v1.Setpoint", SETPOINT_SCHEMA), |commander, name, json, done| {
            with(requests::setpoint(json), done, |setpoint, done| commander.setpoint(name, setpoint, done))
        }),
        service(name.control(), ("flexcrank.v1.Control", CONTROL_SCHEMA), |commander, name, json, done| {
            with(requests::control(json), done, |action, done| commander.control(name, action, done))
        }),
    ]
}

fn with<T>(request: Result<T, String>, done: Done, send: impl FnOnce(T, Done)) -> Result<(), (String, Done)> {
    match request {
        Ok(request) => {
            send(request, done);
            Ok(())
        }
        Err(why) => Err((why, done)),
    }
}

/// A command key as a service.
struct CommandService {
    commander: Commander,
    name: Name,
    key: String,
    send: Send,
}

impl Handler for CommandService {
    fn call(&self, request: Request, responder: Responder) {
        let done: Done = Box::new(move |reply| responder.respond(reply.map(|reply| requests::reply(&reply))));
        if let Some(why) = self.commander.refusal(&self.key) {
            return done(Err(why));
        }
        if let Err((why, done)) = (self.send)(&self.commander, &self.name, request.payload(), done) {
            done(Err(format!("`{}` refuses: {why}", self.key)));
        }
    }
}
