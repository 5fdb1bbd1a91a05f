//! `plot --thesis`: every figure of the thesis, from numbers computed on the spot.

use std::io::Write as _;
use std::path::Path;

use super::exit_status::ExitStatus;
use super::failure::{CommandResult, Failure};
use super::folders::make_folder;
use super::output::output;
use crate::plot::{self, Format, thesis};
use crate::scene::SceneSource;
use crate::study::{self, Table, cycle};
use crate::whole_file::write_whole;

/// Crank-to-rod ratios of the thesis's chapter 4.
const RATIOS: [f64; 3] = [0.1, 0.25, 0.5];
/// Scenes of chapter 5 and their durations: ten seconds of the oscillators, three periods of either beam, one turn of the
/// crank-slider; s.
const OSCILLATORS: [(&str, f64); 3] =
    [("thesis-oscillator", 10.0), ("thesis-two-masses", 10.0), ("thesis-two-masses-stiff", 10.0)];
const BEAMS: [(&str, f64); 2] = [("thesis-beam", 3.0 * 3.5589), ("thesis-beam-tip", 3.0 * 10.5528)];
const CRANK_SLIDER: (&str, f64) = ("thesis-crank-slider", 22.8);

pub(super) fn write_thesis(folder: &Path, formats: &[Format]) -> CommandResult {
    let compressor = SceneSource::open("thesis-compressor", &[])?;
    let options = cycle::Options { ratios: RATIOS.to_vec(), dimensionless: true, ..cycle::Options::default() };
    let run = |(scene, until_s): (&str, f64)| -> CommandResult<Table> {
        Ok(study::history(&SceneSource::open(scene, &[])?.scene, until_s)?)
    };
    let ([one, two, stiff], [free, loaded]) = (OSCILLATORS, BEAMS);
    let oscillators = [run(one)?, run(two)?, run(stiff)?];
    let beams = [run(free)?, run(loaded)?];
    let entries = thesis::figures(&cycle::cycle(&compressor, &options)?, &oscillators, &beams, &run(CRANK_SLIDER)?);
    make_folder(folder)?;
    for entry in &entries {
        entry.write(folder, formats)?;
    }
    let page = folder.join("index.html");
    let text = plot::page(thesis::TITLE, thesis::INTRODUCTION, &entries, formats);
    write_whole(&page, text.as_bytes()).map_err(Failure::file(&page))?;
    writeln!(output(), "{} figures, all on {}", entries.len(), page.display())?;
    Ok(ExitStatus::Success)
}
