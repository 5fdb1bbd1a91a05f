//! The output of one simulation: published on the bus and recorded.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use prost::Message as _;

use super::advance_answers::AdvanceAnswers;
use super::applied::applied;
use super::beside::Beside;
use super::best_level::LAST_DIFFERENCES;
use super::drop_ledger::DropLedger;
use super::scene_update_timer::SceneUpdateTimer;
use crate::bus::{BusError, Name, ServiceEndpoint, SnapshotEntry};
use crate::recording::{self, EndReason, Recorder, RecordingError, SessionInfo, Settings, Written, paths};
use crate::runtime::{
    Action, Advanced, Answer, DurationHistogram, MissedSamples, Output, Reply, ReplyTo, Request, Response, RunStatus,
    SceneInForce, SharedState, StateAfter,
};
use crate::simulation::{PerTelemetry, Sample, Stamp};
use crate::wire::{self, Angles, AppliedCommand, Displacements, Gap, Message, Overruns, Snapshot, Status, Topic};

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

/// Publishes and records the output of one simulation.
pub(super) struct OutputWorker {
    pub name: Name,
    pub endpoint: ServiceEndpoint,
    /// The scene in force.
    pub in_force: Arc<SceneInForce>,
    pub target: RecordingTarget,
    pub recorder: Option<Recorder>,
    pub pool: SyncSender<Arc<Sample>>,
    pub shared: Arc<SharedState>,
    pub on_status: OnStatus,
    pub recordings: RecordingHistory,
    pub beside: Beside,
    pub statistics: OutputStatistics,
    /// Replies to commands that start or stop a recording. They are sent after the next status, which names the recording.
    pub replies_after_status: Vec<(Reply, ReplyTo)>,
    pub drops: DropLedger,
    /// Answers retries of advances.
    pub advances: AdvanceAnswers,
    /// Decides which samples are published as scene updates, if any are.
    pub scene_update_timer: Option<SceneUpdateTimer>,
    /// Stamp of the last message.
    pub last_stamp: Option<Stamp>,
}

/// The recordings made so far.
#[derive(Default)]
pub(super) struct RecordingHistory {
    pub finished: Vec<Result<Written, RecordingError>>,
    /// Why the last one ended early.
    pub failure: Option<String>,
    /// Whether the present one had reached its part size at the last check.
    pub was_full: bool,
}

/// Statistics over the whole run.
pub(super) struct OutputStatistics {
    /// Commands accepted, up to the last message.
    pub commands_accepted: u64,
    /// Number of messages encoded.
    pub encoded: u64,
    /// Number of messages handed to the bus.
    pub put: u64,
    /// Their bytes since the last look.
    pub bytes_to_bus: usize,
    /// Ages of the samples of which a message was handed to the bus.
    pub sample_age: DurationHistogram,
}

impl OutputStatistics {
    pub(super) fn new() -> Result<Self, hdrhistogram::CreationError> {
        Ok(OutputStatistics { commands_accepted: 0, encoded: 0, put: 0, bytes_to_bus: 0, sample_age: DurationHistogram::new()? })
    }
}

/// The results of a simulation that has ended.
pub(super) struct Closed {
    /// Commands accepted.
    pub commands_accepted: u64,
    /// Whether it left the bus in order.
    pub left: Result<(), BusError>,
    pub recordings: Vec<Result<Written, RecordingError>>,
    pub angles: Option<Angles>,
    pub displacements: Option<Displacements>,
    pub encoded: u64,
}

impl OutputWorker {
    /// Finishes the recording and leaves the bus. `others`: the output of other simulations waits meanwhile.
    pub(super) fn close(mut self, others: bool) -> Closed {
        self.finish_best_level(if others { Duration::ZERO } else { LAST_DIFFERENCES });
        self.close_recording(EndReason::RunEnded);
        let Snapshot { angles, displacements, .. } = self.endpoint.snapshot();
        let OutputStatistics { commands_accepted, encoded, .. } = self.statistics;
        let recordings = self.recordings.finished;
        Closed { left: self.endpoint.close(), recordings, angles, displacements, commands_accepted, encoded }
    }

    pub(super) fn handle(&mut self, output: Output) {
        self.follow_at_best_level(&output);
        match output {
            Output::Sample { sample, topics, deadline } => {
                self.sample(&sample, topics, deadline);
                self.check_recording_full();
                self.return_to_pool(sample);
            }
            Output::Shadow(shadow, stamp) => self.send(Topic::Shadow, &stamp, || wire::shadow(&shadow, &stamp).encode_to_vec()),
            Output::Status(run) => self.status(*run),
            Output::Answer(answer) => self.answer(*answer),
            Output::Advanced(advanced) => self.advanced(*advanced),
            Output::Checkpoint(checkpoint, stamp) => {
                let (scene, level) = self.scene_beside_recorded();
                let message = wire::Checkpoint { scene, level, ..wire::checkpoint(&checkpoint, &stamp) };
                self.record(Topic::Checkpoint, message.encode_to_vec(), &stamp);
                self.beside.modes.keep(*checkpoint, stamp);
            }
            Output::Scene(in_force) => self.change_scene(in_force),
            Output::ChangeLeftOver(_) => {}
            Output::MissedSamples(missed, stamp) => self.missed(*missed, &stamp),
            Output::Overruns(report, stamp) => self.send(Topic::Overruns, &stamp, || Overruns::from(&*report).encode_to_vec()),
            Output::Over => {}
        }
    }

    /// Goes on with the scene in force from here on.
    fn change_scene(&mut self, in_force: Arc<SceneInForce>) {
        self.endpoint.set_scene(&in_force.scene.source.text);
        self.beside.modes.change_scene(&in_force.scene.source.scene);
        self.in_force = in_force;
    }

    /// The scene, empty if it is the one in the metadata of recordings, and the level in force, empty if it is the first.
    fn scene_beside_recorded(&self) -> (String, String) {
        let scene = &self.in_force.scene;
        let text = Some(&scene.base.text).filter(|text| **text != self.target.session.scene);
        (text.cloned().unwrap_or_default(), scene.name_beside_first().to_owned())
    }

    /// When the file reaches its part size, requests a checkpoint: the recording goes on in a new file from there.
    fn check_recording_full(&mut self) {
        let recording_full = self.recorder.as_ref().is_some_and(Recorder::is_full);
        if recording_full && !self.recordings.was_full {
            self.shared.want_checkpoint();
        }
        self.recordings.was_full = recording_full;
    }

    fn sample(&mut self, sample: &Arc<Sample>, due: PerTelemetry<bool>, deadline: Option<Instant>) {
        let (context, stamp, put_before) = (Arc::clone(&self.in_force.context), &sample.stamp, self.statistics.put);
        for (topic, _) in due.by_topic().into_iter().filter(|(topic, due)| *due && context.has(*topic)) {
            let make = || context.message(topic, sample).as_ref().map(Message::encode_to_vec).unwrap_or_default();
            let kept = SnapshotEntry::Sample(Arc::clone(&context), Arc::clone(sample));
            if let SnapshotEntry::Sample(_, before) = self.publish_and_record(topic, stamp, kept, make) {
                self.return_to_pool(before);
            }
        }
        if self.statistics.put > put_before {
            deadline.into_iter().for_each(|deadline| self.statistics.sample_age.record(deadline.elapsed()));
        }
        if self.scene_update_timer.as_mut().is_some_and(|scene_update_timer| scene_update_timer.is_due(stamp.session_s())) {
            let time_ns = self.target.session.log_time_ns(stamp.session_s());
            let has_slider = sample.observation.resistance_n.is_some();
            let draw = || wire::scene_update(&context.displacements(sample), has_slider, time_ns).encode_to_vec();
            self.send(Topic::SceneUpdates, stamp, draw);
        }
    }

    /// Returns a sample to the pool, unless the snapshot still holds it: then it returns when a newer one replaces it.
    fn return_to_pool(&self, sample: Arc<Sample>) {
        if Arc::strong_count(&sample) == 1 {
            // If the stepping thread is gone, nothing needs the sample.
            let _ = self.pool.try_send(sample);
        }
    }

    fn status(&mut self, run: RunStatus) {
        let stamp = run.stamp;
        self.check_recording_ended();
        self.publish_gaps(&stamp);
        let status = self.joined_status(run);
        (self.on_status)(&status);
        let payload = status.encode_to_vec();
        self.publish_and_record(Topic::Status, &stamp, payload.clone().into(), || payload);
        self.replies_after_status.drain(..).for_each(|(reply, reply_to)| reply_to(reply.into()));
    }

    /// Publishes and records a message that the snapshot does not hold.
    pub(super) fn send(&mut self, topic: Topic, stamp: &Stamp, make: impl FnOnce() -> Vec<u8>) {
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
            self.statistics.encoded += 1;
            if wanted {
                self.statistics.put += 1;
                self.statistics.bytes_to_bus += payload.len();
            }
            self.endpoint.note_log_time(|| self.target.session.log_time_ns(stamp.session_s()));
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
        let results = recorder.finish(EndReason::RunEnded);
        let why = match results.last() {
            Some(Err(error)) => error.to_string(),
            _ => "it reached --max-recording-size".to_owned(),
        };
        let recording_failure = format!("recording stopped: {why}");
        tracing::error!("{recording_failure}; the simulation goes on");
        self.recordings.failure = Some(recording_failure);
        self.recordings.finished.extend(results);
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

    /// Adds samples dropped by the stepping thread to the drop ledger.
    fn missed(&mut self, missed: PerTelemetry<Option<MissedSamples>>, stamp: &Stamp) {
        for (topic, missed) in missed.by_topic().into_iter().filter(|(topic, _)| self.in_force.context.has(*topic)) {
            let Some(MissedSamples { first_step, last, count }) = missed else { continue };
            let (stamp, topic) = (Some(wire::stamp(&last)), topic.chunk().to_owned());
            self.drops.add(Gap { stamp, topic, count, first_step, published: false });
        }
        self.publish_gaps(stamp);
    }

    /// Publishes and records the pending gaps. A gap that cannot be recorded now is retried later.
    fn publish_gaps(&mut self, stamp: &Stamp) {
        for gap in self.drops.take() {
            let payload = gap.encode_to_vec();
            let message = self.message(Topic::Gaps, payload.clone(), stamp);
            self.endpoint.note_log_time(|| message.log_time_ns);
            if self.recorder.as_ref().is_none_or(|recorder| recorder.record(message)) {
                self.endpoint.publish(Topic::Gaps, payload);
            } else {
                self.drops.merge(gap);
            }
        }
    }

    /// Replies to a command, and publishes it if it took effect.
    fn answer(&mut self, answer: Answer) {
        let Answer { mut reply, reply_to, mut request, stamp } = answer;
        if let Some(of_recording) = request.as_ref().filter(|request| request.is_of_recording()) {
            // A retry may have come while the first was queued.
            match self.shared.reply_to_retry(&reply.id, of_recording) {
                Some(reply_again) => (reply, request) = (reply_again, None),
                None => reply = self.control_recording(of_recording, reply),
            }
        }
        if reply_to.is_some() {
            self.shared.answered();
        }
        match (reply_to, &request) {
            (None, _) => {}
            (Some(reply_to), None) if reply.accepted => self.advances.reply_to_retry(reply.clone(), reply_to),
            // It is answered when its steps are taken.
            (Some(_), Some(Request::Advance(_))) if reply.accepted => {}
            (Some(reply_to), Some(request)) if request.is_of_recording() => {
                self.replies_after_status.push((reply.clone(), reply_to));
            }
            (Some(reply_to), _) => reply_to(reply.clone().into()),
        }
        if let Some(request) = request.filter(|_| reply.accepted) {
            self.statistics.commands_accepted += 1;
            let changes = matches!(request, Request::Control(Action::Set { .. }));
            let scene = if changes { self.in_force.scene.base.text.clone() } else { String::new() };
            let applied = AppliedCommand { scene, ..applied(request, reply, &stamp) };
            self.send(Topic::Commands, &stamp, || applied.encode_to_vec());
        }
    }

    /// Answers an advance with the state after its steps.
    fn advanced(&mut self, Advanced { sample, reply, reply_to }: Advanced) {
        let state = sample.as_deref().map(|sample| {
            let context = Arc::clone(&self.in_force.context);
            Arc::new(StateAfter { sample: sample.clone(), context })
        });
        self.advances.answer(Response { reply, state }, reply_to);
        sample.into_iter().for_each(|sample| self.return_to_pool(sample));
    }

    /// Starts or stops a recording; returns the reply.
    fn control_recording(&mut self, request: &Request, reply: Reply) -> Reply {
        let done = match request {
            Request::Control(Action::StartRecording { name }) => self.start_recording(name),
            _ => self.stop_recording(),
        };
        match done {
            Ok(path) => {
                let reply = Reply { reason: path.display().to_string(), ..reply };
                self.shared.remember(&reply, Some(request));
                reply
            }
            Err(reason) => {
                self.shared.count_rejected();
                Reply::refused(reply.id, reason)
            }
        }
    }

    fn start_recording(&mut self, name: &str) -> Result<PathBuf, String> {
        if let Some(recorder) = &self.recorder {
            return Err(format!(
                "already recording to {}; `flexcrank control NAME stop-recording` ends that",
                recorder.path().display()
            ));
        }
        let path = match name {
            "" => paths::fresh(&self.target.folder, &self.name.to_string(), std::time::SystemTime::now()),
            name => paths::named(&self.target.folder, name).map_err(|error| error.to_string())?,
        };
        self.recorder = Some(self.target.start(&path).map_err(|error| error.to_string())?);
        self.recordings.failure = None;
        Ok(self.recorder.as_ref().map_or(path, Recorder::path))
    }

    fn stop_recording(&mut self) -> Result<PathBuf, String> {
        let path = self.recorder.as_ref().map(Recorder::path).ok_or("not recording")?;
        self.close_recording(EndReason::Stopped);
        Ok(path)
    }

    fn close_recording(&mut self, reason: EndReason) {
        let Some(recorder) = self.recorder.take() else { return };
        for gap in self.drops.take() {
            let payload = gap.encode_to_vec();
            if let Some(now) = self.last_stamp {
                recorder.record_blocking(self.message(Topic::Gaps, payload.clone(), &now));
            }
            self.endpoint.publish(Topic::Gaps, payload);
        }
        self.recordings.finished.extend(recorder.finish(reason));
    }
}
