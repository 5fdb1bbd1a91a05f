//! Passes the facts of the build to the program.

use std::env;
use std::process::Command;

/// Commit, profile, compiler and target; outside of git, the commit is `unknown`.
fn main() {
    for file in ["src", "Cargo.lock"] {
        println!("cargo:rerun-if-changed={file}");
    }
    let rustc = env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let facts = [
        ("COMMIT", said_by("git", &["describe", "--always", "--dirty", "--exclude=*"])),
        ("PROFILE", env::var("PROFILE").ok()),
        ("RUSTC", said_by(&rustc, &["--version"])),
        ("TARGET", env::var("TARGET").ok()),
    ];
    for (name, fact) in facts {
        println!("cargo:rustc-env=FLEXCRANK_{name}={}", fact.as_deref().unwrap_or("unknown"));
    }
}

/// The first line that a program prints; `None` when it fails or is not there.
fn said_by(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok().filter(|output| output.status.success())?;
    let text = String::from_utf8(output.stdout).ok()?;
    text.lines().next().map(str::to_owned)
}
