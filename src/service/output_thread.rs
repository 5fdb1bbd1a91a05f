//! The output thread: it publishes on the bus and records whatever the stepping thread sends.

use std::mem::take;
use std::sync::mpsc::{Receiver, RecvError};

use tokio::sync::oneshot;

use super::burst::Burst;
use super::output_worker::{Closed, OutputWorker};
use crate::runtime::Output;

/// Handles the output of each simulation until it ends or the stepping thread is gone, then closes its worker.
pub(super) fn serve(workers: Vec<(OutputWorker, oneshot::Sender<Closed>)>, outputs: &Receiver<(usize, Output)>) {
    let mut workers: Vec<Option<(OutputWorker, oneshot::Sender<Closed>)>> = workers.into_iter().map(Some).collect();
    // The receiver is gone only if the service is being torn down.
    let close = |(output_worker, closed): (OutputWorker, oneshot::Sender<Closed>), others: bool| {
        drop(closed.send(output_worker.close(others)));
    };
    let (mut open, mut burst) = (workers.len(), Burst::default());
    while open > 0
        && let Ok((index, output)) = next(outputs, &mut burst)
    {
        let Some(place) = workers.get_mut(index) else { continue };
        if let Output::Over = output {
            open -= usize::from(place.is_some());
            place.take().into_iter().for_each(|worker| close(worker, open > 0));
        } else if let Some((output_worker, _)) = place {
            output_worker.handle(output);
            burst.add(take(&mut output_worker.statistics.bytes_to_bus));
        }
    }
    workers.into_iter().flatten().for_each(|worker| close(worker, false));
}

/// Waits for the next output. If none is there, a burst ends.
fn next(outputs: &Receiver<(usize, Output)>, burst: &mut Burst) -> Result<(usize, Output), RecvError> {
    outputs.try_recv().or_else(|_| {
        burst.end();
        outputs.recv()
    })
}
