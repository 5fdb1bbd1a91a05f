//! State spaces as files that programs for control read.

use std::path::{Path, PathBuf};

use nalgebra::DMatrix;
use serde_json::{Value, json};

use super::failure::{CommandResult, Failure};
use super::npz::Npz;
use crate::small_motion::StateSpace;
use crate::whole_file::write_whole;

/// A file in one of the formats.
#[derive(Debug, Clone)]
pub(super) struct StateSpaceFile {
    path: PathBuf,
    format: Format,
}

#[derive(Debug, Clone, Copy)]
enum Format {
    Json,
    Matlab,
    Python,
    Npz,
}

impl StateSpaceFile {
    /// The format follows from the extension.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        let format = match path.extension().and_then(|extension| extension.to_str()) {
            Some("json") => Format::Json,
            Some("m") => Format::Matlab,
            Some("py") => Format::Python,
            Some("npz") => Format::Npz,
            _ => return Err("a file that ends in .json, .m (MATLAB, Octave), .py or .npz (NumPy)".to_owned()),
        };
        Ok(StateSpaceFile { path, format })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes all of it, or nothing.
    pub(super) fn write(&self, space: &StateSpace, title: &str) -> CommandResult<()> {
        let bytes = match self.format {
            Format::Json => json_text(space, title).into_bytes(),
            Format::Matlab => matlab_text(space, title).into_bytes(),
            Format::Python => python_text(space, title).into_bytes(),
            Format::Npz => npz(space, title),
        };
        write_whole(&self.path, &bytes).map_err(Failure::file(&self.path))
    }
}

fn matrices(space: &StateSpace) -> [(&'static str, &DMatrix<f64>); 4] {
    [("A", &space.a), ("B", &space.b), ("C", &space.c), ("D", &space.d)]
}

fn names(space: &StateSpace) -> [(&'static str, &[String]); 3] {
    [("states", &space.states), ("inputs", &space.inputs), ("outputs", &space.outputs)]
}

fn json_text(space: &StateSpace, title: &str) -> String {
    let rows = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> { matrix.row_iter().map(|row| row.iter().copied().collect()).collect() };
    let mut whole = serde_json::Map::new();
    whole.insert("about".to_owned(), json!(title));
    names(space).into_iter().for_each(|(name, list)| _ = whole.insert(name.to_owned(), json!(list)));
    whole.insert("dt".to_owned(), json!(space.step_s));
    matrices(space).into_iter().for_each(|(name, matrix)| _ = whole.insert(name.to_owned(), json!(rows(matrix))));
    whole.insert("at".to_owned(), json!(space.at));
    format!("{}\n", Value::Object(whole))
}

/// Rows of numbers that read back to the same bits.
fn rows(matrix: &DMatrix<f64>, begin: &str, end: &str) -> String {
    let row = |row: Vec<f64>| format!("{begin}{}{end}\n", numbers(&row));
    matrix.row_iter().map(|entries| row(entries.iter().copied().collect())).collect()
}

fn numbers(list: &[f64]) -> String {
    list.iter().map(|entry| format!("{entry:?}")).collect::<Vec<_>>().join(", ")
}

/// In MATLAB an interval of 0 is continuous time.
fn matlab_text(space: &StateSpace, title: &str) -> String {
    let mut text =
        format!("% {title}\n% sys = ss(A, B, C, D, dt, 'StateName', states, 'InputName', inputs, 'OutputName', outputs)\n");
    for (name, matrix) in matrices(space) {
        text += &format!("{name} = [\n{}];\n", rows(matrix, "  ", ""));
    }
    for (name, list) in names(space) {
        let list: Vec<String> = list.iter().map(|name| format!("'{name}'")).collect();
        text += &format!("{name} = {{{}}};\n", list.join(", "));
    }
    text + &format!("at = [{}];\ndt = {:?};\n", numbers(&space.at), space.step_s.unwrap_or(0.0))
}

fn python_text(space: &StateSpace, title: &str) -> String {
    let mut text = format!(
        "# {title}\n# control.ss(A, B, C, D, dt or 0, states=states, inputs=inputs, outputs=outputs)\nimport numpy as np\n\n"
    );
    for (name, matrix) in matrices(space) {
        text += &format!("{name} = np.array([\n{}])\n", rows(matrix, "    [", "],"));
    }
    for (name, list) in names(space) {
        text += &format!("{name} = {list:?}\n");
    }
    let dt = space.step_s.map_or("None".to_owned(), |step_s| format!("{step_s:?}"));
    text + &format!("at = [{}]\ndt = {dt}\n", numbers(&space.at))
}

/// In continuous time `dt` is 0, as in python-control.
fn npz(space: &StateSpace, title: &str) -> Vec<u8> {
    let mut file = Npz::default();
    for (name, matrix) in matrices(space) {
        let by_rows = matrix.transpose();
        file.numbers(name, &[matrix.nrows(), matrix.ncols()], by_rows.iter().copied());
    }
    names(space).into_iter().for_each(|(name, list)| file.words(name, list));
    file.numbers("at", &[space.at.len()], space.at.iter().copied());
    file.numbers("dt", &[], std::iter::once(space.step_s.unwrap_or(0.0)));
    file.words("about", &[title.to_owned()]);
    file.finish()
}
