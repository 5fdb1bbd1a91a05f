//! The limit of open files.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use super::failure::{CommandResult, Failure};

/// A service opens some forty files, and its listener holds up to a hundred connections that do not say who they are.
const NEEDED: u64 = 256;

/// Raises the limit of open files as far as the system lets it; refuses to work with too few, as zenoh would panic later.
pub(super) fn raise_limit() -> CommandResult<()> {
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    // A refusal shows in the limit.
    let _ = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum });
    match getrlimit(Resource::Nofile).current {
        Some(files) if files < NEEDED => {
            let why = format!("only {files} files may be open at a time, and {NEEDED} are needed: raise `ulimit -n`");
            Err(Failure::Failed(why))
        }
        _ => Ok(()),
    }
}
