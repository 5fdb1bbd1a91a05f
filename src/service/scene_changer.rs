//! Prepares changes of a running scene, one after the other, on a thread of its own that begins with the first.

use std::sync::OnceLock;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::Builder;

use crate::runtime::{Action, Command, Inbox, PreparedChange, Request, Response};
use crate::scene::{ModelKind, SceneSource};

/// Changes that may wait to be prepared; more are refused.
const QUEUE: usize = 64;

/// The way of a change from the bus to the stepping thread.
pub(super) struct SceneChanger {
    inbox: Inbox,
    first: SceneSource,
    shadow: Option<ModelKind>,
    queue: OnceLock<SyncSender<Command>>,
}

impl SceneChanger {
    /// For a run that begins with `first`, and has a shadow of this model.
    pub(super) fn new(inbox: &Inbox, first: SceneSource, shadow: Option<ModelKind>) -> Self {
        SceneChanger { inbox: inbox.clone(), first, shadow, queue: OnceLock::new() }
    }

    /// Hands a command on to the stepping thread, a change of the scene once it is prepared. Returns at once.
    pub(super) fn submit(&self, command: Command) {
        if !matches!(command.request, Request::Control(Action::Set { .. })) {
            return self.inbox.submit(command);
        }
        let refuse = |command: Command, why: &str| self.inbox.refuse(command.id, why.to_owned(), command.reply);
        match self.queue.get_or_init(|| self.begin()).try_send(command) {
            Ok(()) => {}
            Err(TrySendError::Full(command)) => refuse(command, "too many changes are waiting"),
            Err(TrySendError::Disconnected(command)) => refuse(command, "no thread could be started to prepare a change"),
        }
    }

    fn begin(&self) -> SyncSender<Command> {
        let (queue, commands) = sync_channel(QUEUE);
        let (inbox, shadow) = (self.inbox.clone(), self.shadow);
        let mut source = self.first.clone();
        // Without a thread the queue is closed, and its commands are refused.
        let _ =
            Builder::new().name("scene-changer".to_owned()).spawn(move || prepare_all(&commands, &inbox, &mut source, shadow));
        queue
    }
}

/// Prepares every change upon the scene that the changes before it left.
fn prepare_all(commands: &Receiver<Command>, inbox: &Inbox, source: &mut SceneSource, shadow: Option<ModelKind>) {
    while let Ok(Command { id, request, reply, .. }) = commands.recv() {
        if let Some(again) = inbox.shared().reply_to_retry(&id, &request) {
            reply(again.into());
            continue;
        }
        let Request::Control(Action::Set { changes }) = &request else { continue };
        let prepared = match PreparedChange::new(source, changes, shadow) {
            Ok(prepared) => prepared,
            Err(why) => {
                inbox.refuse(id, why, reply);
                continue;
            }
        };
        let after = prepared.base.clone();
        let (done, outcome) = sync_channel(1);
        let reply = Box::new(move |answer: Response| {
            let accepted = answer.reply.accepted;
            reply(answer);
            // The receiver waits for exactly this.
            let _ = done.send(accepted);
        });
        inbox.submit(Command { id, request, reply, change: Some(Box::new(prepared)) });
        if outcome.recv() == Ok(true) {
            *source = after;
        }
    }
}
