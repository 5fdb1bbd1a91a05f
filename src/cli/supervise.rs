//! `run --supervise`: the service runs in a process of its own; if that is killed, the next one resumes its recording.

use std::collections::VecDeque;
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::pin::{Pin, pin};
use std::process::{Child, Command, ExitStatus as ProcessStatus};
use std::time::{Duration, Instant, SystemTime};

use rustix::process::{Pid, Signal, kill_process};

use super::async_runtime::runtime;
use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::run_args::Args;
use super::service_names::NAME;
use super::signals::interrupted;
use crate::recording::{self, paths};

/// The supervisor gives up at this many deaths within [`PERIOD`].
const DEATHS: usize = 5;
const PERIOD: Duration = Duration::from_secs(60);
/// Exit code of a process whose main thread panicked.
const PANICKED: i32 = 101;

/// Starts the service as often as it dies, and ends as it ends.
pub(super) fn supervise(args: &Args) -> CommandResult {
    runtime()?.block_on(watch_over(args))
}

async fn watch_over(args: &Args) -> CommandResult {
    let mut signal = pin!(interrupted());
    let in_parts = args.split.is_some();
    let (mut recordings, mut resumed) = (vec![first_recording(args)], None);
    let mut deaths = VecDeque::new();
    while let Some(record) = recordings.last() {
        let (ended, asked) = watch(start(record, resumed.as_deref())?, signal.as_mut()).await?;
        if asked || !died(ended) {
            return Ok(ended.code().map_or(ExitStatus::Interrupted, |code| ExitStatus::OfService(code as u8)));
        }
        resumed = recordings.iter().rev().find_map(|base| last_resumable(base, in_parts));
        deaths.push_back(Instant::now());
        if deaths.len() == DEATHS && deaths.pop_front().is_some_and(|first| first.elapsed() < PERIOD) {
            say!("error: the service died ({ended})");
            break;
        }
        say!("error: the service died ({ended}); {}", way_on(&recordings, in_parts, resumed.as_deref()));
        recordings.push(next_recording(&recordings[0], in_parts));
    }
    Err(Failure::Failed(given_up(resumed.as_deref())))
}

/// The way on after a death, in words: from the file that it resumes, or from its start. A later recording that is
/// not there, as after somebody moved it away, is named.
fn way_on(recordings: &[PathBuf], in_parts: bool, resumed: Option<&Path>) -> String {
    let is_resumed = |base: &PathBuf| files(base, in_parts).iter().any(|file| resumed == Some(file.as_path()));
    let later = recordings.iter().rev().take_while(|base| !is_resumed(base));
    let absent = later.map(|base| first_file(base, in_parts)).find(|file| !file.exists());
    match (absent, resumed) {
        (None, Some(_)) => "it resumes from its recording".to_owned(),
        (None, None) => "it starts again: it has recorded nothing yet".to_owned(),
        (Some(absent), Some(resumed)) => {
            format!("its recording {} is not there: it resumes from {}", absent.display(), resumed.display())
        }
        (Some(absent), None) => format!("its recording {} is not there: it starts again at t = 0", absent.display()),
    }
}

/// Why no further service is started, and the way on from the last file that a session can be resumed from.
fn given_up(resumable: Option<&Path>) -> String {
    let file = |file: &Path| format!("; `flexcrank run --resume {}` goes on from its recording", file.display());
    format!("the service died {DEATHS} times within {} s: given up{}", PERIOD.as_secs(), resumable.map_or(String::new(), file))
}

fn first_recording(args: &Args) -> PathBuf {
    let name = args.name.as_ref().map_or(NAME.to_owned(), ToString::to_string);
    args.record.clone().unwrap_or_else(|| paths::fresh(Path::new(paths::FOLDER), &name, SystemTime::now()))
}

/// The next recording of the session: `take.mcap` is followed by `take-resumed-1.mcap`, or the next number that is free.
fn next_recording(first: &Path, in_parts: bool) -> PathBuf {
    let stem = first.file_stem().unwrap_or_default().to_string_lossy();
    let named = |number: u32| first.with_file_name(format!("{stem}-resumed-{number}.mcap"));
    let is_free = |path: &PathBuf| !first_file(path, in_parts).exists();
    (1..).map(named).find(is_free).unwrap_or_else(|| first.to_owned())
}

/// The file with which a recording begins: itself, or its first part.
fn first_file(base: &Path, in_parts: bool) -> PathBuf {
    if in_parts { paths::part(base, 1) } else { base.to_owned() }
}

/// The last file of a recording that a session can be resumed from, if it has one.
fn last_resumable(base: &Path, in_parts: bool) -> Option<PathBuf> {
    files(base, in_parts).into_iter().rev().find(|file| recording::has_checkpoint(file))
}

/// The files of a recording: itself, or its parts that are there.
fn files(base: &Path, in_parts: bool) -> Vec<PathBuf> {
    let parts = (1..).map(|part| paths::part(base, part)).take_while(|part| part.exists());
    if in_parts { parts.collect() } else { vec![base.to_owned()] }
}

/// Starts the service: this very command, with the recordings to resume from and to write.
fn start(record: &Path, resume: Option<&Path>) -> CommandResult<Child> {
    let failed = |cause| Failure::Failed(format!("cannot start the service: {cause}"));
    let words: Vec<_> = std::env::args_os().skip(1).collect();
    let after_run = words.iter().position(|word| word == "run").map_or(0, |run| run + 1);
    let mut command = Command::new(std::env::current_exe().map_err(failed)?);
    command.args(&words[..after_run]).arg("--supervised-record").arg(record);
    if let Some(file) = resume {
        command.arg("--supervised-resume").arg(file);
    }
    command.args(&words[after_run..]).spawn().map_err(failed)
}

/// Waits until the service ends, and passes a request to end on to it. Returns whether there was one.
async fn watch(mut service: Child, signal: Pin<&mut impl Future<Output = ()>>) -> CommandResult<(ProcessStatus, bool)> {
    let id = Pid::from_child(&service);
    let mut waiting = tokio::task::spawn_blocking(move || service.wait());
    let (ended, asked) = tokio::select! {
        ended = &mut waiting => (ended, false),
        () = signal => {
            // It may have ended already.
            let _ = kill_process(id, Signal::TERM);
            (waiting.await, true)
        }
    };
    let failed = |cause: std::io::Error| Failure::Failed(format!("cannot wait for the service: {cause}"));
    Ok((ended.map_err(|error| failed(error.into()))?.map_err(failed)?, asked))
}

fn died(ended: ProcessStatus) -> bool {
    ended.signal().is_some() || ended.code() == Some(PANICKED)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_the_next_recording_replaces_none() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let take = folder.path().join("take.mcap");
        assert_eq!(next_recording(&take, false), folder.path().join("take-resumed-1.mcap"));
        std::fs::write(folder.path().join("take-resumed-1.mcap"), "of another session")?;
        assert_eq!(next_recording(&take, false), folder.path().join("take-resumed-2.mcap"));
        std::fs::write(folder.path().join("take-resumed-1-001.mcap"), "of another session")?;
        assert_eq!(next_recording(&take, true), folder.path().join("take-resumed-2.mcap"));
        Ok(())
    }

    /// A recording that the user had moved away was said to have recorded nothing yet.
    #[test]
    fn regress_a_recording_that_is_not_there_is_named_with_the_way_on() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let [take, next] = ["take.mcap", "take-resumed-1.mcap"].map(|name| folder.path().join(name));
        let both = [take.clone(), next.clone()];
        let not_there = |file: &Path| format!("its recording {} is not there: it ", file.display());
        assert_eq!(way_on(&both[..1], false, None), format!("{}starts again at t = 0", not_there(&take)));
        let first_part = folder.path().join("take-001.mcap");
        assert_eq!(way_on(&both[..1], true, None), format!("{}starts again at t = 0", not_there(&first_part)));
        std::fs::write(&take, "nothing to resume from")?;
        assert_eq!(way_on(&both[..1], false, None), "it starts again: it has recorded nothing yet");
        assert_eq!(way_on(&both[..1], false, Some(&take)), "it resumes from its recording");
        let from_take = format!("{}resumes from {}", not_there(&next), take.display());
        assert_eq!(way_on(&both, false, Some(&take)), from_take);
        std::fs::rename(&take, &next)?;
        assert_eq!(way_on(&both, false, Some(&next)), "it resumes from its recording", "the later one is enough");
        Ok(())
    }
}
