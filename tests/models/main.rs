//! The ladder of models against references that were computed elsewhere (`tests/data/README.md`), laws and closed forms.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod bench;
mod references;
