//! Build information: identifies the program that made a recording.

/// Version of the package.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Names and values that are equal in two builds that compute the same bits.
///
/// `commit` is the output of `git describe --always --dirty` at build time, or `unknown` outside of git.
pub const FACTS: [(&str, &str); 5] = [
    ("version", VERSION),
    ("commit", env!("FLEXCRANK_COMMIT")),
    ("profile", env!("FLEXCRANK_PROFILE")),
    ("rustc", env!("FLEXCRANK_RUSTC")),
    ("target", env!("FLEXCRANK_TARGET")),
];
