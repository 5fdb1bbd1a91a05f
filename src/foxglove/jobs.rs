//! The thread that serves the viewers' requests in order, off their connections. Requests wait in a bounded queue.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use super::FoxgloveError;

/// Requests that may wait; more are refused.
const QUEUE: usize = 256;
/// Time between two looks at the viewers' subscriptions.
const TICK: Duration = Duration::from_millis(40);

enum Job {
    /// Called with `true` in its turn, or with `false` at once if the queue is full.
    Do(Box<dyn FnOnce(bool) + Send>),
    End,
}

/// The queue of the working thread.
#[derive(Clone)]
pub(super) struct Jobs(SyncSender<Job>);

impl Jobs {
    /// Starts the thread. It calls `tick` after each job and at least 25 times a second.
    ///
    /// # Errors
    /// [`FoxgloveError::Thread`] if the system refuses.
    pub fn start(tick: impl FnMut() + Send + 'static) -> Result<(Self, JoinHandle<()>), FoxgloveError> {
        let (sender, jobs) = sync_channel(QUEUE);
        let thread = Builder::new().name("foxglove".to_owned()).spawn(move || work(&jobs, tick));
        Ok((Jobs(sender), thread.map_err(FoxgloveError::Thread)?))
    }

    /// Queues a job, which is called with `true` in its turn; with `false` at once if it has to be refused.
    pub fn submit(&self, job: impl FnOnce(bool) + Send + 'static) {
        let refused = self.0.try_send(Job::Do(Box::new(job)));
        if let Err(TrySendError::Full(Job::Do(job)) | TrySendError::Disconnected(Job::Do(job))) = refused {
            job(false);
        }
    }

    /// Wakes the thread, so that it looks at the subscriptions.
    pub fn wake(&self) {
        self.submit(|_| {});
    }

    /// Ends the thread after the jobs that wait.
    pub fn end(&self) {
        // A thread that is gone needs no end.
        let _ = self.0.send(Job::End);
    }
}

fn work(jobs: &Receiver<Job>, mut tick: impl FnMut()) {
    loop {
        match jobs.recv_timeout(TICK) {
            Ok(Job::Do(job)) => job(true),
            Err(RecvTimeoutError::Timeout) => {}
            Ok(Job::End) | Err(RecvTimeoutError::Disconnected) => return,
        }
        tick();
    }
}
