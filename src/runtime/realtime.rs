//! Real-time requests to the system, so that the stepping thread wakes on time. A refused request is logged, and the run goes on.

use std::fs::File;
use std::io::Write as _;
use std::time::{Duration, Instant};

use super::pacer::WAKE_UP_PERIOD;

/// Priority of a stepping thread among real-time threads, 1 to 99.
const PRIORITY: u8 = 80;
/// While this file is open with a zero in it, processors do not enter deep sleep.
const LATENCY: &str = "/dev/cpu_dma_latency";

/// The requests and their results. Dropping this releases everything that the system granted.
#[derive(Debug)]
pub(super) struct Granted {
    words: Vec<String>,
    _latency: Option<File>,
}

impl std::fmt::Display for Granted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.words.join("; "))
    }
}

/// Requests real-time scheduling of this thread, locked memory, exact timers and processors that wake fast.
pub(super) fn ask() -> Granted {
    let latency = keep_processors_awake();
    let text = |result: Result<String, String>| result.unwrap_or_else(|refused| refused);
    let words = vec![
        text(scheduling()),
        text(system::lock_memory()),
        latency.as_ref().map_or_else(
            |error| format!("processors may sleep deeply ({LATENCY}: {error})"),
            |_| "processors kept awake".to_owned(),
        ),
    ];
    Granted { words, _latency: latency.ok() }
}

/// Makes short sleeps end on time instead of up to 50 µs late.
pub(crate) fn exact_timers() {
    system::exact_timers();
}

/// Lets every other thread go first. If the system refuses, this one runs at the usual priority.
pub(crate) fn yield_to_others() {
    system::yield_to_others();
}

/// Returns the origin of a clock on which deadlines avoid the scheduler's tick, for steps of whole or half milliseconds.
///
/// On Linux since 6.4 the tick falls on multiples of 1 to 10 ms of `CLOCK_MONOTONIC`. A deadline on the tick is late by as long
/// as the tick's work takes: 15 µs measured, whenever both coincide. Multiples of [`WAKE_UP_PERIOD`] on this clock come 100 to
/// 400 µs after the system's, with different offsets for processes that share the processors. The origin lies at most one such
/// period in the past.
pub(super) fn clock() -> Instant {
    let after = Duration::from_micros(100) * (1 + std::process::id() % 4);
    let now = Instant::now();
    let since = (system::time() + WAKE_UP_PERIOD - after).subsec_nanos() % WAKE_UP_PERIOD.subsec_nanos();
    now.checked_sub(Duration::from_nanos(since.into())).unwrap_or(now)
}

/// Processor time of this thread.
pub(super) use system::processor_time;

fn keep_processors_awake() -> std::io::Result<File> {
    let mut file = File::options().write(true).open(LATENCY)?;
    file.write_all(&0_i32.to_ne_bytes())?;
    Ok(file)
}

#[cfg(unix)]
fn scheduling() -> Result<String, String> {
    use thread_priority::{
        Error, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
        set_thread_priority_and_policy, thread_native_id,
    };
    let priority = ThreadPriority::Crossplatform(ThreadPriorityValue::try_from(PRIORITY)?);
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let why = |error| match error {
        Error::OS(code) => std::io::Error::from_raw_os_error(code).to_string(),
        other => other.to_string(),
    };
    set_thread_priority_and_policy(thread_native_id(), priority, policy)
        .map(|()| format!("SCHED_FIFO, priority {PRIORITY}"))
        .map_err(|error| format!("ordinary scheduling ({}: needs CAP_SYS_NICE, or `ulimit -r {PRIORITY}`)", why(error)))
}

/// Lets the stepping thread go first, if this thread has inherited its real-time scheduling.
#[cfg(unix)]
pub(super) fn give_way() {
    use thread_priority::{
        ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
        thread_schedule_policy,
    };
    if let (Ok(policy @ ThreadSchedulePolicy::Realtime(_)), Ok(priority)) =
        (thread_schedule_policy(), ThreadPriorityValue::try_from(PRIORITY - 1))
    {
        // If the system refuses, this thread has the priority of the stepping thread, which then may wait for it.
        let _ = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), policy);
    }
}

#[cfg(not(unix))]
pub(super) fn give_way() {}

#[cfg(not(unix))]
fn scheduling() -> Result<String, String> {
    Err("ordinary scheduling".to_owned())
}

#[cfg(target_os = "linux")]
mod system {
    use std::num::NonZeroU64;
    use std::time::Duration;

    use rustix::mm::{MlockAllFlags, mlockall};
    use rustix::process::setpriority_process;
    use rustix::thread::{gettid, set_current_timer_slack};
    use rustix::time::{ClockId, clock_gettime};

    /// Niceness of a thread that yields to all others.
    const NICE: i32 = 10;

    pub(super) fn lock_memory() -> Result<String, String> {
        // Later allocations are not locked: running into a limit on locked memory must not end the run.
        mlockall(MlockAllFlags::CURRENT | MlockAllFlags::ONFAULT)
            .map(|()| "memory locked".to_owned())
            .map_err(|error| format!("memory not locked ({error}: needs CAP_IPC_LOCK, or `ulimit -l unlimited`)"))
    }

    pub(super) fn exact_timers() {
        // Without exact timers, the adaptive spin grows longer.
        let _ = set_current_timer_slack(NonZeroU64::new(1));
    }

    pub(super) fn yield_to_others() {
        let _ = setpriority_process(Some(gettid()), NICE);
    }

    pub(in super::super) fn processor_time() -> Duration {
        clock(ClockId::ThreadCPUTime)
    }

    pub(super) fn time() -> Duration {
        clock(ClockId::Monotonic)
    }

    fn clock(id: ClockId) -> Duration {
        Duration::try_from(clock_gettime(id)).unwrap_or_default()
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::time::Duration;

    pub(super) fn lock_memory() -> Result<String, String> {
        Err("memory not locked".to_owned())
    }

    pub(super) fn exact_timers() {}

    pub(super) fn yield_to_others() {}

    pub(in super::super) fn processor_time() -> Duration {
        Duration::ZERO
    }

    pub(super) fn time() -> Duration {
        Duration::ZERO
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn val_deadlines_avoid_the_tick() {
        // The thread may be interrupted between two readings of the clock, but rarely.
        let after_ns = || {
            let clock = clock();
            system::time().saturating_sub(clock.elapsed()).subsec_nanos() % WAKE_UP_PERIOD.subsec_nanos()
        };
        let off = |after_ns: u32| [1, 2, 3, 4].iter().any(|k| after_ns.abs_diff(k * 100_000) < 5_000);
        let count = (0..100).filter(|_| off(after_ns())).count();
        assert!(count > 80, "{count} of 100, {} ns", after_ns());
    }
}
