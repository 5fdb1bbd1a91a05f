//! The `flexcrank` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    flexcrank::cli::main()
}
