//! The output thread: it publishes on the bus and records whatever the stepping thread sends.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender};

use prost::Message as _;
use tokio::sync::oneshot;

use super::drop_ledger::DropLedger;
use super::scene_update_timer::SceneUpdateTimer;
use crate::bus::{BusError, Name, ServiceEndpoint, SnapshotEntry, Topic};
use crate::recording::{self, Recorder, RecordingError, SessionInfo, Settings, Written, paths};
use crate::runtime::{DueTopics, MissedSamplesByTopic, Output, RecordingRequest, SharedState, TELEMETRY};
use crate::simulation::{Checkpoint, Sample, Stamp};
use crate::wire::{self, Angles, AppliedCommand, CommandReply, Gap, Status, TelemetryEncoder, applied_command, control::Action};

/// The telemetry topics, in the order of [`DueTopics::by_topic`].
const TELEMETRY_TOPICS: [Topic; TELEMETRY] = [Topic::Displacements, Topic::Angles, Topic::Loads, Topic::Energies];

/// Called with every status message, off the stepping thread.
pub type OnStatus = Box<dyn Fn(&Status) + Send>;

/// Folder, settings and session facts of the recordings of one simulation.
#[derive(Debug, Clone)]
pub(super) struct RecordingTarget {
    pub folder: PathBuf,
    pub settings: Settings,
    pub session: SessionInfo,
}

impl RecordingTarget {
    pub(super) fn start(&self, path: &std::path::Path) -> Result<Recorder, RecordingError> {
        Recorder::start(path, &self.session, self.settings)
    }
}

/// Handles the output of each simulation until it ends or the stepping thread is gone, then closes its worker.
pub(super) fn serve(workers: Vec<(OutputWorker, oneshot::Sender<Closed>)>, outputs: &Receiver<(usize, Output)>) {
    let mut workers: Vec<Option<(OutputWorker, oneshot::Sender<Closed>)>> = workers.into_iter().map(Some).collect();
    // The receiver is gone only if the service is being torn down.
    let close = |(output_worker, closed): (OutputWorker, oneshot::Sender<Closed>)| drop(closed.send(output_worker.close()));
    let mut open = workers.len();
    while open > 0
        && let Ok((index, output)) = outputs.recv()
    {
        let Some(place) = workers.get_mut(index) else { continue };
        if let Output::Over = output {
            open -= usize::from(place.is_some());
            place.take().into_iter().for_each(close);
        } else if let Some((output_worker, _)) = place {
            output_worker.handle(output);
        }
    }
    workers.into_iter().flatten().for_each(close);
}

/// Publishes and records the output of one simulation.
pub(super) struct OutputWorker {
    pub name: Name,
    pub endpoint: ServiceEndpoint,
    pub telemetry: Arc<TelemetryEncoder>,
    pub target: RecordingTarget,
    pub recorder: Option<Recorder>,
    pub pool: SyncSender<Arc<Sample>>,
    pub shared: Arc<SharedState>,
    pub on_status: OnStatus,
    pub finished_recordings: Vec<Result<Written, RecordingError>>,
    /// Number of messages encoded.
    pub encoded: u64,
    pub drops: DropLedger,
    /// Decides which samples are published as scene updates, if any are.
    pub scene_update_timer: Option<SceneUpdateTimer>,
    /// Why the last recording ended early.
    pub recording_failure: Option<String>,
    /// Stamp of the last message.
    pub last_stamp: Option<Stamp>,
    /// Whether the recording had reached its part size at the last check.
    pub recording_full: bool,
}

/// The results of a simulation that has ended.
pub(super) struct Closed {
    /// Whether it left the bus in order.
    pub left: Result<(), BusError>,
    pub recordings: Vec<Result<Written, RecordingError>>,
    pub angles: Option<Angles>,
    pub encoded: u64,
}

impl OutputWorker {
    /// Finishes the recording and leaves the bus.
    fn close(mut self) -> Closed {
        self.close_recording();
        let angles = self.endpoint.snapshot().angles;
        Closed { left: self.endpoint.close(), recordings: self.finished_recordings, angles, encoded: self.encoded }
    }

    fn handle(&mut self, output: Output) {
        match output {
            Output::Sample(sample, due) => {
                self.sample(&sample, due);
                self.check_recording_full();
                self.return_to_pool(sample);
            }
            Output::Shadow(shadow, stamp) => self.send(Topic::Shadow, &stamp, || shadow.encode_to_vec()),
            Output::Status(status, stamp) => self.status(*status, &stamp),
            Output::Answer(reply, reply_to, applied, stamp) => {
                self.shared.answered();
                reply_to(reply);
                if let Some(applied) = applied {
                    self.send(Topic::Commands, &stamp, || applied.encode_to_vec());
                }
            }
            Output::Recording(request) => self.recording(request),
            Output::Checkpoint(checkpoint, stamp) => self.checkpoint(&checkpoint, &stamp),
            Output::MissedSamples(missed, stamp) => self.missed(&missed, &stamp),
            Output::Overruns(overruns, stamp) => self.send(Topic::Overruns, &stamp, || overruns.encode_to_vec()),
            Output::Over => {}
        }
    }

    /// When the file reaches its part size, requests a checkpoint: the recording goes on in a new file from there.
    fn check_recording_full(&mut self) {
        let recording_full = self.recorder.as_ref().is_some_and(Recorder::is_full);
        if recording_full && !self.recording_full {
            self.shared.want_checkpoint();
        }
        self.recording_full = recording_full;
    }

    fn sample(&mut self, sample: &Arc<Sample>, due: DueTopics) {
        let (telemetry, stamp) = (Arc::clone(&self.telemetry), &sample.stamp);
        if due.displacements {
            self.publish_telemetry(Topic::Displacements, sample, || telemetry.displacements(sample).encode_to_vec());
        }
        if self.scene_update_timer.as_mut().is_some_and(|scene_update_timer| scene_update_timer.is_due(stamp.session_s())) {
            let time_ns = self.target.session.log_time_ns(stamp.session_s());
            let has_slider = sample.observation.resistance_n.is_some();
            let draw = || wire::scene_update(&telemetry.displacements(sample), has_slider, time_ns).encode_to_vec();
            self.send(Topic::SceneUpdates, stamp, draw);
        }
        if due.angles && telemetry.turns() {
            self.publish_telemetry(Topic::Angles, sample, || telemetry.angles(sample).encode_to_vec());
        }
        if due.loads && telemetry.turns() {
            self.publish_telemetry(Topic::Loads, sample, || telemetry.loads(sample).encode_to_vec());
        }
        if due.energies {
            self.publish_telemetry(Topic::Energies, sample, || telemetry.energies(sample).encode_to_vec());
        }
    }

    /// Returns a sample to the pool, unless the snapshot still holds it: then it returns when a newer one replaces it.
    fn return_to_pool(&self, sample: Arc<Sample>) {
        if Arc::strong_count(&sample) == 1 {
            // If the stepping thread is gone, nothing needs the sample.
            let _ = self.pool.try_send(sample);
        }
    }

    fn status(&mut self, mut status: Status, stamp: &Stamp) {
        self.check_recording_ended();
        self.publish_gaps(stamp);
        if let Some(recording_failure) = &self.recording_failure {
            let more = if status.message.is_empty() { "" } else { "; " };
            status.message = format!("{recording_failure}{more}{}", status.message);
        }
        status.recording = self.recorder.as_ref().map(|recorder| recorder.path().display().to_string());
        status.drops = self.drops.totals();
        (status.commands_accepted, status.commands_rejected) = (self.shared.accepted(), self.shared.rejected());
        (self.on_status)(&status);
        let payload = status.encode_to_vec();
        self.publish_and_record(Topic::Status, stamp, payload.clone().into(), || payload);
    }

    /// Publishes and records a telemetry message; the snapshot keeps the sample.
    fn publish_telemetry(&mut self, topic: Topic, sample: &Arc<Sample>, make: impl FnOnce() -> Vec<u8>) {
        let kept = SnapshotEntry::Sample(Arc::clone(&self.telemetry), Arc::clone(sample));
        if let SnapshotEntry::Sample(_, before) = self.publish_and_record(topic, &sample.stamp, kept, make) {
            self.return_to_pool(before);
        }
    }

    /// Publishes and records a message that the snapshot does not hold.
    fn send(&mut self, topic: Topic, stamp: &Stamp, make: impl FnOnce() -> Vec<u8>) {
        self.publish_and_record(topic, stamp, SnapshotEntry::Number, make);
    }

    /// Counts a message and stores its snapshot entry. Encodes it only if the topic has subscribers or a recording runs. Returns
    /// the previous snapshot entry.
    fn publish_and_record(
        &mut self,
        topic: Topic,
        stamp: &Stamp,
        kept: SnapshotEntry,
        make: impl FnOnce() -> Vec<u8>,
    ) -> SnapshotEntry {
        self.last_stamp = Some(*stamp);
        let (number, before) = self.endpoint.keep(topic, kept);
        let (wanted, recorded) = (self.endpoint.has_subscribers(topic), self.recorder.is_some());
        if wanted || recorded {
            let payload = make();
            self.encoded += 1;
            match (wanted, recorded) {
                (true, true) => {
                    self.endpoint.put(topic, number, payload.clone());
                    self.record(topic, payload, stamp);
                }
                (true, false) => self.endpoint.put(topic, number, payload),
                (false, _) => self.record(topic, payload, stamp),
            }
        }
        before
    }

    /// Records a message, or counts it as dropped.
    fn record(&mut self, topic: Topic, payload: Vec<u8>, stamp: &Stamp) {
        self.last_stamp = Some(*stamp);
        let Some(recorder) = &self.recorder else { return };
        if !recorder.record(self.message(topic, payload, stamp)) && !self.check_recording_ended() {
            self.shared.count_dropped();
            self.drops.count_unrecorded(topic.chunk(), stamp);
        }
    }

    /// Notes that a recording has ended early; the simulation goes on without it. Returns whether it has.
    fn check_recording_ended(&mut self) -> bool {
        let Some(recorder) = self.recorder.take_if(|recorder| recorder.has_ended()) else { return false };
        let results = recorder.finish();
        let why = match results.last() {
            Some(Err(error)) => error.to_string(),
            _ => "it reached --max-recording-size".to_owned(),
        };
        let recording_failure = format!("recording stopped: {why}");
        tracing::error!("{recording_failure}; the simulation goes on");
        self.recording_failure = Some(recording_failure);
        self.finished_recordings.extend(results);
        true
    }

    fn message(&self, topic: Topic, payload: Vec<u8>, stamp: &Stamp) -> recording::Message {
        recording::Message {
            topic: self.name.topic(topic),
            schema: topic.schema(),
            payload,
            log_time_ns: self.target.session.log_time_ns(stamp.session_s()),
            publish_time_ns: recording::nanoseconds(stamp.wall),
            begins_part: topic == Topic::Checkpoint,
        }
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint, stamp: &Stamp) {
        let message = wire::checkpoint(checkpoint, stamp);
        self.record(Topic::Checkpoint, message.encode_to_vec(), stamp);
    }

    /// Adds samples dropped by the stepping thread to the drop ledger.
    fn missed(&mut self, missed: &MissedSamplesByTopic, stamp: &Stamp) {
        let turns = self.telemetry.turns();
        let exists = |topic: &Topic| turns || !matches!(topic, Topic::Angles | Topic::Loads);
        for (topic, missed) in TELEMETRY_TOPICS.iter().zip(missed).filter(|(topic, _)| exists(topic)) {
            let Some(missed) = missed else { continue };
            self.drops.add(Gap {
                stamp: Some(wire::stamp(&missed.last)),
                topic: topic.chunk().to_owned(),
                count: missed.count,
                first_step: missed.first_step,
                published: false,
            });
        }
        self.publish_gaps(stamp);
    }

    /// Publishes and records the pending gaps. A gap that cannot be recorded now is retried later.
    fn publish_gaps(&mut self, stamp: &Stamp) {
        for gap in self.drops.take() {
            let payload = gap.encode_to_vec();
            let message = self.message(Topic::Gaps, payload.clone(), stamp);
            if self.recorder.as_ref().is_none_or(|recorder| recorder.record(message)) {
                self.endpoint.publish(Topic::Gaps, payload);
            } else {
                self.drops.merge(gap);
            }
        }
    }

    /// Starts or stops a recording, then replies.
    fn recording(&mut self, request: RecordingRequest) {
        let RecordingRequest { action, answer, reply, stamp } = request;
        if let Some(reply_again) = self.shared.reply_to_retry(&answer.id) {
            self.shared.answered();
            return reply(reply_again);
        }
        let done = match &action {
            Action::StartRecording(start) => self.start_recording(&start.name),
            _ => self.stop_recording(),
        };
        let answer = match done {
            Ok(path) => CommandReply { reason: path.display().to_string(), ..answer },
            Err(reason) => CommandReply { id: answer.id, accepted: false, reason, ..CommandReply::default() },
        };
        if answer.accepted {
            self.shared.count_accepted(&answer);
            let control = wire::Control { id: answer.id.clone(), action: Some(action) };
            let command = Some(applied_command::Command::Control(control));
            let applied = AppliedCommand { stamp: Some(wire::stamp(&stamp)), reply: Some(answer.clone()), command };
            self.send(Topic::Commands, &stamp, || applied.encode_to_vec());
        } else {
            self.shared.count_rejected();
        }
        self.shared.answered();
        reply(answer);
    }

    fn start_recording(&mut self, name: &str) -> Result<PathBuf, String> {
        if let Some(recorder) = &self.recorder {
            return Err(format!("already recording to {}: stop that first", recorder.path().display()));
        }
        let path = match name {
            "" => paths::fresh(&self.target.folder, &self.name.to_string(), std::time::SystemTime::now()),
            name => paths::named(&self.target.folder, name).map_err(|error| error.to_string())?,
        };
        self.recorder = Some(self.target.start(&path).map_err(|error| error.to_string())?);
        self.recording_failure = None;
        Ok(self.recorder.as_ref().map_or(path, Recorder::path))
    }

    fn stop_recording(&mut self) -> Result<PathBuf, String> {
        let path = self.recorder.as_ref().map(Recorder::path).ok_or("not recording")?;
        self.close_recording();
        Ok(path)
    }

    fn close_recording(&mut self) {
        let Some(recorder) = self.recorder.take() else { return };
        for gap in self.drops.take() {
            let payload = gap.encode_to_vec();
            if let Some(now) = self.last_stamp {
                recorder.record_blocking(self.message(Topic::Gaps, payload.clone(), &now));
            }
            self.endpoint.publish(Topic::Gaps, payload);
        }
        self.finished_recordings.extend(recorder.finish());
    }
}
