//! The command line of the process.

/// The command line of the process, for its recordings and scenes.
pub(super) fn command_line() -> String {
    std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}
