//! Tables and pictures written to files, and told on standard output.

use std::io::Write as _;
use std::path::Path;

use super::failure::CommandResult;
use super::formatting::counted;
use super::output::output;
use crate::plot::{Format, Picture};
use crate::study::Table;

/// Draws a picture into a folder, as SVG and PNG; its paths are printed on standard output if `told`.
pub(super) fn draw(folder: &Path, name: &str, picture: &dyn Picture, told: bool) -> CommandResult<()> {
    for path in picture.write_into(folder, name, &[Format::Svg, Format::Png])? {
        if told {
            writeln!(output(), "{}", path.display())?;
        }
    }
    Ok(())
}

/// Writes a table as CSV, in place of one of the same name; the file is told on standard output, unless that is JSON.
pub(super) fn write_table(path: &Path, table: &Table, told: bool) -> CommandResult<()> {
    let replaced = if path.is_file() { "replaced " } else { "" };
    table.write_csv(path)?;
    if told {
        writeln!(output(), "{replaced}{} ({})", path.display(), counted(table.rows() as u64, "row"))?;
    }
    Ok(())
}
