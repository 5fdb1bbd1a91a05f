//! Any bytes as a recording: replay's source, verify, resume, recover and export read them, without panic and in bounded memory.
#![no_main]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use flexcrank::recording::{Export, Messages, RecordingFile, export, recover};
use flexcrank::resimulation::{RecordedSession, resume, verify};
use libfuzzer_sys::fuzz_target;

/// Three times the largest chunk that is read, as the README says.
const MEMORY_LIMIT: u64 = 3 * 64 * 1024 * 1024;

/// Of this process alone.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| std::env::temp_dir().join(format!("readers-{}", std::process::id())));

fuzz_target!(|bytes: &[u8]| {
    let folder = &*FOLDER;
    fs::create_dir_all(folder).expect("a folder");
    let file = folder.join("broken.mcap");
    fs::write(&file, bytes).expect("a file");
    let memory = allocation_counter::measure(|| read(&file, folder));
    assert!(memory.bytes_max <= MEMORY_LIMIT, "{} bytes of memory", memory.bytes_max);
    fs::remove_dir_all(folder).expect("an empty folder");
});

/// Errors are fine.
fn read(file: &Path, folder: &Path) {
    if let Ok(messages) = RecordingFile::open(file).and_then(|source| source.messages_from(0)) {
        messages.for_each(drop);
    }
    if let Ok(source) = RecordedSession::open(file) {
        let _ = verify(&source, &|_, _| {});
        let _ = resume(&source, None, &|_| {});
    }
    let tables = folder.join("tables");
    let _ = export(file, &Export { csv: Some(tables), ..Export::default() }, &|_| {});
    let whole = folder.join("whole.mcap");
    if let Ok(recovered) = recover(file, &whole, |_, _| {}) {
        let read: Result<Vec<_>, _> = Messages::open(&whole).into_iter().flatten().collect();
        assert_eq!(read.map(|messages| messages.len() as u64).ok(), Some(recovered.messages), "what is recovered is whole");
    }
}
