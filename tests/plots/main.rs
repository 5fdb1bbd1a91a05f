//! `flexcrank plot` as its users meet it: files, what is in them, what is refused.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may fail")]

mod animations;
mod campaigns;
mod columns;
#[path = "../common/mod.rs"]
mod common;
mod decimal_commas;
mod maps;
mod overlays;
mod pictures;
mod recording;
mod resets;
mod strobes;
mod tables;
mod thesis;
mod vibrations;

use std::path::Path;
use std::process::{Command, Output};

fn plot(folder: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_flexcrank");
    Command::new(program).arg("plot").args(arguments).current_dir(folder).output().expect("the program starts")
}

fn complaint(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Texts of an SVG, which must be well-formed XML.
fn texts(svg: &str) -> Vec<String> {
    let document = roxmltree::Document::parse(svg).expect("well-formed XML");
    let texts = document.descendants().filter(|node| node.has_tag_name("text"));
    texts.map(|node| node.text().unwrap_or_default().trim().to_owned()).collect()
}

/// Width and height in the header of a PNG.
fn png_size(bytes: &[u8]) -> [u32; 2] {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")))
}
