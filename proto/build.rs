//! Compiles the messages with a pure-Rust protobuf compiler, writes the descriptor sets beside the generated code, and passes
//! build information to the program.
use std::process::Command;
use std::{env, error::Error, fs, path::PathBuf};

use prost::Message;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=proto");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set")?);
    let (own, viewers) = ("proto/flexcrank.proto", "proto/foxglove/SceneUpdate.proto");
    for (name, files) in [("flexcrank", vec![own]), ("foxglove", vec![viewers]), ("every", vec![own, viewers])] {
        let descriptors = protox::compile(&files, ["proto"])?;
        fs::write(out.join(name).with_extension("bin"), descriptors.encode_to_vec())?;
        if name == "every" {
            prost_build::Config::new().out_dir(&out).enable_type_names().compile_fds(descriptors)?;
        }
    }
    export_build_info();
    Ok(())
}

/// Commit, profile, compiler and target; outside of git, the commit is `unknown`.
fn export_build_info() {
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
