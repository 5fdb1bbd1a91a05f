//! The table of a study in the terminal.

use std::io::Write as _;

use super::aligned_table::{print, with_column_wrapped};
use super::failure::CommandResult;
use super::formatting::counted;
use super::output::output;
use crate::study::trade::{Configuration, Corrections, Measured, OutputGroup, Ringing, Row, Study};

const HEAD: [&str; 21] = [
    "",
    "model",
    "integrator",
    "links",
    "step s",
    "s/s",
    "±",
    "steps/s",
    "p99.9 µs",
    "worst µs",
    "error",
    "angle",
    "slider",
    "deflection",
    "forces",
    "energy",
    "order",
    "mesh",
    "newton",
    "factor",
    "note",
];

/// Place of `links` in the complete and the narrow table. Columns of figures follow.
const LINKS: usize = 3;

/// Prints a study: all columns if `wide`, or those that fit 80 columns.
pub(super) fn print_study(name: &str, study: &Study, wide: bool) -> CommandResult<()> {
    let row = |(row, measured): (&Row, &Measured)| {
        let all = line(study, row, measured);
        let cells = if wide { all } else { narrow(&all) };
        with_corrections(cells, study, wide, || corrections(measured))
    };
    let head = if wide { &HEAD[..] } else { &NARROW_HEAD[..] };
    let head = head.iter().map(|&name| study_word(study, name).to_owned()).collect();
    let head = with_corrections(head, study, wide, || "corr.".to_owned());
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(study.measured().map(row)).collect();
    let mut out = output();
    let grid = &study.grid;
    let instants = counted(grid.count as u64, "instant");
    writeln!(out, "{name}: {} s, compared at {instants}, {} s apart", grid.until_s(), grid.interval_s)?;
    let errors = &study.reference.estimate;
    let estimate = OutputGroup::COMPARED.map(|output| format!("{} {:.1e}", study.word(output), errors.of(output)));
    writeln!(out, "reference: {}", study.reference.configuration)?;
    writeln!(out, "  uncertain by {}", estimate.join(", "))?;
    if let Some(left_out) = study.reference.left_out.filter(|left_out| left_out.counts) {
        let minutes = (left_out.budget_s / 60.0).ceil();
        let part = match left_out.part {
            Ringing::Link => "the bending of a link at",
            Ringing::Base => "vibrations, such as of the base spring, of up to",
        };
        let [why, ends] = match left_out.errors {
            Some(_) => ["which rings as a load begins or ends", "resolves it"],
            None => ["and there is no time to see whether that rings", "gives that time"],
        };
        let hz = left_out.hz;
        writeln!(
            out,
            "  its steps do not resolve {part} some {hz:.0} Hz,\n  {why}: so it is uncertain; --budget {minutes}min {ends}"
        )?;
    }
    writeln!(out)?;
    let rows = if wide { rows } else { with_column_wrapped(&rows, LINKS) };
    print(&rows, LINKS + 1)?;
    for row in &study.rows {
        if let Err(failed) = &row.outcome {
            writeln!(out, "  {}: {failed}", row.configuration)?;
        }
    }
    writeln!(out, "\nfront, by {}:", words(study))?;
    for (row, measured) in study.front() {
        writeln!(
            out,
            "  {:>9.2e} s/s  error {}{:.1e}  {}",
            measured.timing.seconds_per_s, measured.mark, measured.error, row.configuration
        )?;
    }
    if study.left_out > 0 {
        let [skipped, allowed] = match study.measured().next() {
            Some(_) if study.not_begun.is_empty() => ["finer configuration", "no more"],
            Some(_) => ["configuration", "no more"],
            None => ["configuration", "none"],
        };
        let were = if study.left_out == 1 { "was" } else { "were" };
        writeln!(out, "{} {were} skipped: --budget allows {allowed}", counted(study.left_out as u64, skipped))?;
    }
    if let [first, others @ ..] = &study.not_begun[..]
        && study.measured().next().is_some()
    {
        let of = match others.len() {
            0 => format!("the family {first}"),
            more => format!("{} families, the first {first}", 1 + more),
        };
        say!("warning: nothing was measured of {of}: a cheaper setting may be there, and a larger --budget has time for it");
    }
    if study.cut_short {
        say!("warning: the time budget ran out: another run may compute more or fewer configurations");
    }
    Ok(())
}

/// The row with the corrections that suffice, if the study has them: in the narrow table, instead of its last cell.
fn with_corrections(mut row: Vec<String>, study: &Study, wide: bool, cell: impl Fn() -> String) -> Vec<String> {
    if study.is_rated() {
        if !wide {
            row.pop();
        }
        row.push(cell());
    }
    row
}

fn corrections(measured: &Measured) -> String {
    match measured.corrections {
        Corrections::NotAsked => String::new(),
        Corrections::Suffice(number) => number.to_string(),
        Corrections::NoneSuffice => "none".to_owned(),
    }
}

/// The head of the table that fits 80 columns.
const NARROW_HEAD: [&str; 8] = ["", "model", "integrator", "links", "step s", "s/s", "error", "angle"];

/// Words of the complete table, and their abbreviations in the narrow one. `rigid/axial`: the crank is rigid, the rod stretches.
const ABBREVIATIONS: [(&str, &str); 7] = [
    ("finite-element", "FE"),
    ("incremental", "incr."),
    ("generalized-alpha", "gen.-alpha"),
    ("runge-kutta", "RK4"),
    ("elements", "el."),
    ("crank rigid, rod axial", "rigid/axial"),
    ("rod rigid, crank axial", "axial/rigid"),
];

/// The cells of the narrow table: configuration, cost, the largest error that counts, and that of the crank angle. `row` has all.
fn narrow(row: &[String]) -> Vec<String> {
    let cell = |head: &str| HEAD.iter().position(|other| *other == head).and_then(|place| row.get(place)).cloned();
    let short = |head: &str| {
        let cell = cell(head).unwrap_or_default();
        ABBREVIATIONS.iter().fold(cell, |cell, (long, short)| cell.replace(long, short))
    };
    NARROW_HEAD.iter().map(|head| short(head)).collect()
}

/// One row of the table: a configuration with its measurements.
fn line(study: &Study, row: &Row, m: &Measured) -> Vec<String> {
    let Configuration { family, step_s } = &row.configuration;
    let error = |output: OutputGroup| {
        format!("{}{:.1e}", study.reference.mark(&m.errors, output), study.reference.bounded_error(&m.errors, &[output]))
    };
    let timing = &m.timing;
    let spread = 50.0 * (timing.slowest_per_s - timing.quickest_per_s) / timing.seconds_per_s;
    let order = |order: Option<f64>| order.filter(|order| order.is_finite()).map_or(String::new(), |order| format!("{order:.1}"));
    let per_step = |count: u64| format!("{:.2}", count as f64 / m.effort.steps.max(1) as f64);
    let [angle, slider, deflection, forces, energy] = OutputGroup::ALL.map(error);
    vec![
        if m.on_front { "*".to_owned() } else { String::new() },
        family.model.as_str().to_owned(),
        family.integrator.as_str().to_owned(),
        family.discretization(),
        format!("{step_s:.2e}"),
        format!("{:.2e}", timing.seconds_per_s),
        format!("{spread:.0}%"),
        format!("{:.0}", 1.0 / (step_s * timing.seconds_per_s)),
        format!("{:.1}", 1e6 * timing.step_p999_s),
        format!("{:.0}", 1e6 * timing.step_worst_s),
        format!("{}{:.1e}", m.mark, m.error),
        angle,
        slider,
        deflection,
        forces,
        energy,
        order(m.order),
        order(m.mesh_order),
        per_step(m.effort.newton_iterations),
        per_step(m.effort.factorizations),
        match (m.out_of_range, m.effort.retried) {
            (true, _) => "out of range".to_owned(),
            (_, 0) => String::new(),
            (_, retried) => format!("{retried} retried"),
        },
    ]
}

/// The head of a column: of an output, the study's word for it.
fn study_word(study: &Study, head: &'static str) -> &'static str {
    OutputGroup::ALL.into_iter().find(|output| output.as_str() == head).map_or(head, |output| study.word(output))
}

/// Names of the outputs that count, as in a sentence.
pub(super) fn words(study: &Study) -> String {
    study.outputs.iter().map(|output| study.word(*output)).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::aligned_table::widths;

    /// The narrow table of one row, and its width in characters.
    fn narrow_table([model, integrator, links]: [&str; 3], error: &str) -> (Vec<Vec<String>>, usize) {
        let cell = |head: &str| match head {
            "" => "*",
            "model" => model,
            "integrator" => integrator,
            "links" => links,
            "step s" => "2.50e-4",
            "s/s" => "1.23e-2",
            _ => error,
        };
        let row: Vec<String> = HEAD.iter().map(|head| cell(head).to_owned()).collect();
        let rows = with_column_wrapped(&[NARROW_HEAD.map(str::to_owned).to_vec(), narrow(&row)], LINKS);
        let width = widths(&rows).iter().map(|width| 2 + width).sum();
        (rows, width)
    }

    #[test]
    fn regress_the_table_fits_80_columns() {
        for (row, shown) in [
            (["finite-element", "generalized-alpha", "16 elements, crank rigid"], ["FE", "gen.-alpha", "16 el., crank rigid"]),
            (["modal", "runge-kutta", "4 modes, crank rigid"], ["modal", "RK4", "4 modes, crank rigid"]),
            (["modal", "generalized-alpha", "2 modes, crank rigid, rod axial"], ["modal", "gen.-alpha", "2 modes, rigid/axial"]),
            (["incremental", "two-point", "–"], ["incr.", "two-point", "–"]),
        ] {
            let (rows, width) = narrow_table(row, "<1.2e-8");
            assert!(width <= 80 && rows.len() == 2, "{width}: {rows:?}");
            assert_eq!(rows[1][1..4], shown);
        }
        let (rows, width) = narrow_table(["modal", "generalized-alpha", "20 modes, rod rigid, crank axial"], "<1.2e-10");
        assert!(width <= 80, "{width}: {rows:?}");
        assert_eq!([&rows[1][LINKS], &rows[2][LINKS]], ["20 modes,", "axial/rigid"]);
    }
}
