//! Answers to questions for the modes of a running simulation, computed off the stepping thread from a checkpoint.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::Builder;
use std::time::Duration;

use crate::bus::Question;
use crate::runtime::SharedState;
use crate::scene::Scene;
use crate::simulation::{Checkpoint, Simulation, Stamp};
use crate::small_motion::{LiveModes, ModeReport, NoModes, Subject, beyond_shapes, modes};

/// Questions that are computed at a time; more are refused.
const AT_ONCE: usize = 2;
/// Time to wait for a checkpoint of the present instant; a service that is late answers from its last one.
const PATIENCE: Duration = Duration::from_secs(2);
/// Modes that are told without a number asked for, and the most.
const COUNT: usize = 8;
const MOST: usize = 100;

/// Answers questions about one simulation.
pub(super) struct ModesService {
    scene: Mutex<Scene>,
    shared: Arc<SharedState>,
    /// The checkpoint and how many there have been.
    last: Mutex<(u64, Option<(Checkpoint, Stamp)>)>,
    newer: Condvar,
    computing: AtomicUsize,
}

impl ModesService {
    pub(super) fn new(scene: Scene, shared: Arc<SharedState>) -> Arc<Self> {
        let last = Mutex::new((0, None));
        Arc::new(ModesService { scene: Mutex::new(scene), shared, last, newer: Condvar::new(), computing: AtomicUsize::new(0) })
    }

    /// Sets the scene in force; checkpoints from here on are its own.
    pub(super) fn change_scene(&self, scene: &Scene) {
        self.scene.lock().unwrap_or_else(PoisonError::into_inner).clone_from(scene);
    }

    /// Keeps a checkpoint.
    pub(super) fn keep(&self, checkpoint: Checkpoint, stamp: Stamp) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        *last = (last.0 + 1, Some((checkpoint, stamp)));
        self.newer.notify_all();
    }

    /// Takes a question, and answers it from a thread of its own.
    pub(super) fn take(self: &Arc<Self>, question: Question) {
        if self.computing.fetch_add(1, Ordering::Relaxed) >= AT_ONCE {
            self.computing.fetch_sub(1, Ordering::Relaxed);
            return question.refuse("the modes are being computed for others; ask again");
        }
        let service = Arc::clone(self);
        let begun = Builder::new().name("modes".to_owned()).spawn(move || {
            service.answer(question);
            service.computing.fetch_sub(1, Ordering::Relaxed);
        });
        if begun.is_err() {
            self.computing.fetch_sub(1, Ordering::Relaxed);
        }
    }

    fn answer(&self, question: Question) {
        let count = match question.parameter("count").map_or(Ok(COUNT), str::parse) {
            Ok(count) if (1..=MOST).contains(&count) => count,
            _ => return question.refuse(&format!("count: a whole number from 1 to {MOST}")),
        };
        match self.present().ok_or(None).and_then(|(checkpoint, stamp)| self.modes(&checkpoint, &stamp, count).map_err(Some)) {
            Ok(found) => question.answer_json(serde_json::to_vec(&found).unwrap_or_default()),
            Err(None) => question.refuse("the service has no state yet"),
            Err(Some(refusal)) => question.refuse(&refusal.to_string()),
        }
    }

    /// A checkpoint that is newer than the question, or else the last one.
    fn present(&self) -> Option<(Checkpoint, Stamp)> {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let before = last.0;
        self.shared.want_checkpoint();
        let waited = self.newer.wait_timeout_while(last, PATIENCE, |last| last.0 == before);
        let (last, _) = waited.unwrap_or_else(PoisonError::into_inner);
        last.1.clone()
    }

    fn modes(&self, checkpoint: &Checkpoint, stamp: &Stamp, count: usize) -> Result<LiveModes, NoModes> {
        let scene = self.scene.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let subject = Subject::new(&scene, None)?;
        let mut simulation = Simulation::new(&scene).map_err(|_| NoModes::Singular)?;
        if !simulation.restore(checkpoint) {
            return Err(NoModes::Singular);
        }
        let motion = simulation.motion().ok_or(NoModes::Singular)?;
        let moved_rad_per_s = motion.input.motion.map(|[_, rate_rad_per_s, _]| rate_rad_per_s);
        let point = motion.into();
        let found = modes(&subject, &point, count)?;
        let crank = simulation.observe().ok().and_then(|observation| observation.links.first());
        Ok(LiveModes {
            step: stamp.step,
            epoch: stamp.epoch,
            sim_time_s: stamp.sim_time_s,
            crank_rate_rad_per_s: moved_rad_per_s.unwrap_or(crank.map_or(0.0, |link| link.rate_rad_per_s)),
            has_crank: !subject.is_oscillator(),
            crank_is_moved: moved_rad_per_s.is_some(),
            modes: found.iter().map(ModeReport::from).collect(),
            beyond_shapes: beyond_shapes(&subject, &point, &found),
        })
    }
}
