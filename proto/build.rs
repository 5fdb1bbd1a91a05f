//! Compiles the messages with a pure-Rust protobuf compiler; leaves the descriptor set beside the generated code.
use std::{env, error::Error, fs, path::PathBuf};

use prost::Message;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=proto");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set")?);
    let descriptors = protox::compile(["proto/flexcrank.proto"], ["proto"])?;
    fs::write(out.join("flexcrank.bin"), descriptors.encode_to_vec())?;
    prost_build::Config::new().out_dir(out).compile_fds(descriptors)?;
    Ok(())
}
