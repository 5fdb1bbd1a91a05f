//! The output thread: everything that leaves the stepping thread goes on the bus and into the recording here.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender};

use prost::Message as _;

use crate::bus::{Endpoint, Name, Topic};
use crate::recording::{self, Recorder, RecordingError, Session, WhenFull, Written, place};
use crate::runtime::{Counts, Output, RecordingRequest};
use crate::simulation::{Checkpoint, Sample, Stamp};
use crate::wire::{self, Angles, AppliedCommand, CommandReply, Status, Telemetry, applied_command, control::Action};

/// Called with every status, off the stepping thread.
pub type OnStatus = Box<dyn Fn(&Status) + Send>;

/// Where and how to record.
#[derive(Debug, Clone)]
pub(super) struct RecordingPlan {
    pub folder: PathBuf,
    pub flush_period: std::time::Duration,
    pub when_full: WhenFull,
    pub session: Session,
}

impl RecordingPlan {
    pub(super) fn start(&self, path: &std::path::Path) -> Result<Recorder, RecordingError> {
        Recorder::start(path, &self.session, self.flush_period, self.when_full)
    }
}

/// The output thread's state.
pub(super) struct Desk {
    pub name: Name,
    pub endpoint: Endpoint,
    pub telemetry: Telemetry,
    pub plan: RecordingPlan,
    pub recorder: Option<Recorder>,
    pub pool: SyncSender<Box<Sample>>,
    pub counts: Arc<Counts>,
    pub on_status: OnStatus,
    pub finished: Vec<Result<Written, RecordingError>>,
    /// The last angles published.
    pub angles: Option<Angles>,
}

/// What is left when the stepping thread has ended.
pub(super) struct Closed {
    pub endpoint: Endpoint,
    pub recordings: Vec<Result<Written, RecordingError>>,
    pub angles: Option<Angles>,
}

impl Desk {
    /// Handles everything until the stepping thread hangs up, then finishes the recording.
    pub(super) fn serve(mut self, output: &Receiver<Output>) -> Closed {
        while let Ok(output) = output.recv() {
            self.handle(output);
        }
        self.close_recording();
        Closed { endpoint: self.endpoint, recordings: self.finished, angles: self.angles }
    }

    fn handle(&mut self, output: Output) {
        match output {
            Output::Sample(sample) => {
                self.sample(&sample);
                // The stepping thread may be gone already: then nobody needs the sample any more.
                let _ = self.pool.try_send(sample);
            }
            Output::Shadow(shadow, stamp) => self.send(Topic::Shadow, shadow.encode_to_vec(), &stamp),
            Output::Status(status, stamp) => self.status(*status, &stamp),
            Output::Answer(reply, reply_to, applied, stamp) => {
                self.counts.answered();
                reply_to(reply);
                if let Some(applied) = applied {
                    self.send(Topic::Commands, applied.encode_to_vec(), &stamp);
                }
            }
            Output::Recording(request) => self.recording(request),
            Output::Checkpoint(checkpoint, stamp) => self.checkpoint(&checkpoint, &stamp),
        }
    }

    fn sample(&mut self, sample: &Sample) {
        let stamp = &sample.stamp;
        self.send(Topic::Displacements, self.telemetry.displacements(sample).encode_to_vec(), stamp);
        if !self.telemetry.turns() {
            return;
        }
        let angles = self.telemetry.angles(sample);
        self.send(Topic::Angles, angles.encode_to_vec(), stamp);
        self.angles = Some(angles);
        self.send(Topic::Loads, self.telemetry.loads(sample).encode_to_vec(), stamp);
    }

    fn status(&mut self, mut status: Status, stamp: &Stamp) {
        status.recording = self.recorder.as_ref().map(|recorder| recorder.path().display().to_string());
        (self.on_status)(&status);
        self.send(Topic::Status, status.encode_to_vec(), stamp);
    }

    fn send(&mut self, topic: Topic, payload: Vec<u8>, stamp: &Stamp) {
        self.record(self.name.topic(topic), topic.schema(), payload.clone(), stamp);
        self.endpoint.publish(topic, payload);
    }

    fn record(&self, topic: String, schema: &'static str, payload: Vec<u8>, stamp: &Stamp) {
        let Some(recorder) = &self.recorder else { return };
        let message = recording::Message {
            topic,
            schema,
            payload,
            log_time_ns: self.plan.session.log_time_ns(stamp.session_s),
            publish_time_ns: recording::nanoseconds(stamp.wall),
        };
        if !recorder.record(message) {
            self.counts.count_dropped();
        }
    }

    fn checkpoint(&self, checkpoint: &Checkpoint, stamp: &Stamp) {
        let message = wire::checkpoint(checkpoint, stamp);
        self.record(self.name.checkpoint(), "flexcrank.v1.Checkpoint", message.encode_to_vec(), stamp);
    }

    /// Does what the request asks for the recording, then answers.
    fn recording(&mut self, request: RecordingRequest) {
        let RecordingRequest { action, answer, reply, stamp } = request;
        let done = match &action {
            Action::StartRecording(start) => self.start_recording(&start.name),
            _ => self.stop_recording(),
        };
        let answer = match done {
            Ok(path) => CommandReply { reason: path.display().to_string(), ..answer },
            Err(reason) => CommandReply { id: answer.id, accepted: false, reason, ..CommandReply::default() },
        };
        if answer.accepted {
            let control = wire::Control { id: answer.id.clone(), action: Some(action) };
            let command = Some(applied_command::Command::Control(control));
            let applied = AppliedCommand { stamp: Some(wire::stamp(&stamp)), reply: Some(answer.clone()), command };
            self.send(Topic::Commands, applied.encode_to_vec(), &stamp);
        }
        self.counts.answered();
        reply(answer);
    }

    fn start_recording(&mut self, name: &str) -> Result<PathBuf, String> {
        if let Some(recorder) = &self.recorder {
            return Err(format!("recording to {} already: stop it first", recorder.path().display()));
        }
        let path = match name {
            "" => place::fresh(&self.plan.folder, &self.name.to_string(), std::time::SystemTime::now()),
            name => place::named(&self.plan.folder, name).map_err(|error| error.to_string())?,
        };
        self.recorder = Some(self.plan.start(&path).map_err(|error| error.to_string())?);
        Ok(path)
    }

    fn stop_recording(&mut self) -> Result<PathBuf, String> {
        let path = self.recorder.as_ref().map(|recorder| recorder.path().to_owned()).ok_or("not recording")?;
        self.close_recording();
        Ok(path)
    }

    fn close_recording(&mut self) {
        if let Some(recorder) = self.recorder.take() {
            self.finished.push(recorder.finish());
        }
    }
}
