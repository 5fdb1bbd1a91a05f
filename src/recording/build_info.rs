//! Which program this is: what a recording says of the build that made it.

/// Version of the package.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Names and values: the same in two programs that compute the same bits.
///
/// `commit` is what `git describe --always --dirty` said when the program was built, or `unknown` outside of git.
pub const FACTS: [(&str, &str); 5] = [
    ("version", VERSION),
    ("commit", env!("FLEXCRANK_COMMIT")),
    ("profile", env!("FLEXCRANK_PROFILE")),
    ("rustc", env!("FLEXCRANK_RUSTC")),
    ("target", env!("FLEXCRANK_TARGET")),
];
