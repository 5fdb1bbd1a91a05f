//! The asynchronous runtime, which waits for signals and threads.

use super::failure::{CommandResult, Failure};

pub(super) fn runtime() -> CommandResult<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|cause| Failure::Failed(format!("cannot start the async runtime: {cause}")))
}
