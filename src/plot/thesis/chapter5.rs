//! Chapter 5: runs over time.

use super::{axis, entry};
use crate::plot::{Axis, Entry, Figure};
use crate::study::Table;

/// One of the two hinged beams.
pub(super) struct Beam {
    section: &'static str,
    numbers: [&'static str; 5],
    sentences: [&'static str; 5],
}

pub(super) const BEAM: Beam = Beam {
    section: "Section 5.4: a beam hinged on a torsion spring, after a pulse of 0.1 N·m for 0.1 s",
    numbers: ["5.6.1", "5.6.2", "5.6.3", "5.6.4", "5.6.5"],
    sentences: [
        "The hinge swings by 1.76 mrad with a period of 3.56 s, as a rigid beam would.",
        "The free end moves back along x by less than a thousandth of a millimetre, twice in a period.",
        "The free end swings by 0.88 mm across.",
        "The free end turns as the hinge does: the beam is stiff against its spring.",
        "So does the beam's chord.",
    ],
};

pub(super) const BEAM_WITH_TIP_MASS: Beam = Beam {
    section: "Section 5.5: the same beam with 100 kg at its free end",
    numbers: ["5.7.1", "5.7.2", "5.7.3", "5.7.4", "5.7.5"],
    sentences: [
        "With the mass the period is 10.55 s, and the same pulse moves the hinge less.",
        "The free end moves back along x, twice in a period.",
        "The free end swings across with the hinge.",
        "The free end turns as the hinge does.",
        "So does the beam's chord.",
    ],
};

pub(super) fn beam(beam: &Beam, table: &Table) -> Vec<Entry> {
    let what = [
        ("Rotation of node 1", "beam_start_rotation_rad"),
        ("Displacement of node 2 along x", "beam_end_x_m"),
        ("Displacement of node 2 along y", "beam_end_y_m"),
        ("Rotation of node 2", "beam_end_rotation_rad"),
        ("Chord angle Ψ", "beam_angle_rad"),
    ];
    let figure = |((title, column), (number, sentence)): ((&str, &str), (&&'static str, &&'static str))| {
        let values = table.column(column).unwrap_or_default();
        let start = values.first().copied().unwrap_or_default();
        let moved: Vec<f64> = values.iter().map(|value| value - start).collect();
        entry(beam.section, number, sentence, Figure::new(title, time(), axis(title, column)).line("", times(table), &moved))
    };
    what.into_iter().zip(beam.numbers.iter().zip(&beam.sentences)).map(figure).collect()
}

const CRANK_SLIDER: &str =
    "Section 5.6: the crank-slider, pushed by 1 N·m for 0.1 s, by the incremental method with h = 0.1 s and ϑ = 0.55";

/// Number, title, column, sentence.
type OverTime = [&'static str; 4];

const OF_CRANK_SLIDER: [OverTime; 7] = [
    [
        "5.8.2",
        "Rotation of node A",
        "crank_start_rotation_rad",
        "The crank's rotation at A. The method adds the bending that is there again at every step, so this rotation runs away from the chord's.",
    ],
    ["5.8.3", "Rotation of node B of element 1", "crank_end_rotation_rad", "The crank's rotation at B."],
    ["5.8.4", "Position of node B along x", "crank_end_x_m", "B along x; the crank turns 1.8 times."],
    ["5.8.5", "Position of node B along y", "crank_end_y_m", "B along y; the crank turns 1.8 times."],
    [
        "5.8.6",
        "Rotation of node B of element 2",
        "rod_start_rotation_rad",
        "The rod's rotation at B, likewise with its bending counted again.",
    ],
    [
        "5.8.7",
        "Position of node Γ along x",
        "rod_end_x_m",
        "The slider goes from one dead centre to the other and back, farther each time as B spirals.",
    ],
    ["5.8.8", "Rotation of node Γ", "rod_end_rotation_rad", "The rod's rotation at the slider."],
];

pub(super) fn crank_slider(table: &Table) -> Vec<Entry> {
    let column = |name: &str| table.column(name).unwrap_or_default();
    let path = Figure::new("Path of node B", Axis::new("x", "m"), Axis::new("y", "m"));
    let path = Figure { equal_aspect: true, ..path }.line("", column("crank_end_x_m"), column("crank_end_y_m"));
    let mut figures = vec![entry(
        CRANK_SLIDER,
        "5.8.1",
        "B ought to go round at the crank's length of 0.5 m; the method keeps no axial strain from step to step, so B spirals outwards.",
        path,
    )];
    for [number, title, name, sentence] in OF_CRANK_SLIDER {
        let figure = Figure::new(title, time(), axis(title, name)).line("", times(table), column(name));
        figures.push(entry(CRANK_SLIDER, number, sentence, figure));
    }
    let angles = Figure::new("Chord angles", time(), Axis::new("crank angle Ψ₁", "rad"))
        .line("Ψ₁", times(table), column("crank_angle_rad"))
        .panel(Axis::new("rod angle Ψ₂", "rad"))
        .line("Ψ₂", times(table), column("rod_angle_rad"));
    figures.push(entry(CRANK_SLIDER, "5.8.9", "The crank turns on; the rod swings to either side.", angles));
    let (at, torque) = staircase(times(table), column("driving_torque_nm"));
    let torque = Figure::new("Applied torque", time(), Axis::new("torque", "N·m")).line("", &at, &torque);
    figures.push(entry(CRANK_SLIDER, "5.8.10", "The pulse lasts one step.", torque));
    figures
}

fn time() -> Axis {
    Axis::new("time", "s")
}

fn times(table: &Table) -> &[f64] {
    table.column("time_s").unwrap_or_default()
}

/// Means over steps as the steps they are: `values[k]` from `times[k − 1]` to `times[k]`.
fn staircase(times: &[f64], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let steps = times.windows(2).zip(values.iter().skip(1));
    steps.flat_map(|(ends, value)| [(ends[0], *value), (ends[1], *value)]).unzip()
}
