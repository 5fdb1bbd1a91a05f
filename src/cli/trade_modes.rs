//! The vibrations of a scene, after the table of a study.

use std::io::Write as _;

use super::aligned_table::{WIDTH, figure, lines, print};
use super::failure::CommandResult;
use super::formatting::degrees;
use super::output::output;
use crate::study::trade::{ExcitedMode, LostModes, OutputGroup, Reason, Row, Study};

/// Prints the vibrations of a scene, those that outputs show, and those that the front loses.
pub(super) fn print_modes(study: &Study, modes: &LostModes) -> CommandResult<()> {
    let mut out = output();
    let excitation = &modes.excitation;
    writeln!(out, "\nvibrations at rest, crank at {}°, and their part in the run:", figure(degrees(excitation.angle_rad)))?;
    let head = ["vibration", "Hz", "energy", "moving", "output", "follows", ""].map(str::to_owned).to_vec();
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(excitation.modes.iter().map(|mode| line(study, mode))).collect();
    print(&rows, 1)?;
    sentences(modes).iter().try_for_each(|sentence| writeln!(out, "{}", wrapped(sentence, 2)))?;
    if study.outputs.contains(&OutputGroup::Energy) {
        writeln!(out, "energy is not judged here")?;
    }
    writeln!(out, "\n{}, the front loses:", among(modes))?;
    for (row, _) in study.front() {
        writeln!(out, "  {}", row.configuration)?;
        lost(study, modes, row).iter().try_for_each(|lost| writeln!(out, "    {}", wrapped(lost, 6)))?;
    }
    Ok(())
}

/// The vibrations that are looked at.
pub(super) fn among(modes: &LostModes) -> String {
    format!("of vibrations and deflections that change an output by more than {:e}", modes.tolerance)
}

/// The vibrations that a configuration loses, by the reason.
pub(super) fn lost(study: &Study, modes: &LostModes, row: &Row) -> Vec<String> {
    let place = study.rows.iter().position(|other| other.configuration == row.configuration);
    let Some(errors) = place.and_then(|place| modes.rows.get(place)?.as_ref()) else {
        return vec!["not known: the model has no linearisation".to_owned()];
    };
    let by = |reason: Reason| {
        let lost = errors.iter().filter(|error| error.lost == Some(reason));
        let names: Vec<&str> = lost.map(|error| modes.excitation.modes[error.mode].name.as_str()).collect();
        (!names.is_empty()).then(|| format!("by the {reason}: {}", names.join(", ")))
    };
    let lost: Vec<String> = [Reason::Model, Reason::Step].into_iter().filter_map(by).collect();
    if lost.is_empty() { vec!["none".to_owned()] } else { lost }
}

fn line(study: &Study, mode: &ExcitedMode) -> Vec<String> {
    vec![
        mode.name.clone(),
        format!("{:.1}", mode.frequency_hz),
        format!("{:.1e}", mode.energy_part),
        format!("{:.1e}", mode.moving_part),
        format!("{:.1e}", mode.output_part),
        format!("{:.1e}", mode.following_part),
        study.word(mode.output).to_owned(),
    ]
}

/// The vibrations that change outputs by more than a tolerance, and those that do not.
fn sentences(modes: &LostModes) -> Vec<String> {
    let [vibrate, follow, others] = modes.excitation.beyond(modes.tolerance);
    let names = |modes: &[&ExcitedMode]| modes.iter().map(|mode| mode.name.as_str()).collect::<Vec<_>>().join(", ");
    let vibrating = if vibrate.is_empty() { "none".to_owned() } else { names(&vibrate) };
    let mut sentences =
        vec![format!("vibrations that change an output by more than {:e} while they swing: {vibrating}", modes.tolerance)];
    if !follow.is_empty() {
        sentences.push(format!("deflections that do so as they follow their loads: {}", names(&follow)));
    }
    if !others.is_empty() {
        let most = others.iter().map(|mode| mode.output_part.max(mode.following_part)).fold(0.0, f64::max);
        sentences.push(format!("the others change none by more than {most:.1e}: {}", names(&others)));
    }
    for mode in vibrate.iter().chain(&follow) {
        if let Some(elsewhere) = &mode.elsewhere {
            sentences.push(format!(
                "{} is {elsewhere} where it changes outputs most: as the crank turns, vibrations exchange their shapes (see \
                 `flexcrank modes --angle`), and the front may lose that instead",
                mode.name
            ));
        }
    }
    sentences.push("reasons to look, not measurements: the errors in the table are measured".to_owned());
    sentences
}

/// Lines of at most 80 columns; those after the first are indented.
fn wrapped(text: &str, indent: usize) -> String {
    lines(text, WIDTH - indent).join(&format!("\n{:indent$}", ""))
}
