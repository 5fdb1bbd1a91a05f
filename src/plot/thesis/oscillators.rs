//! Section 5.2: the two-point method against exact solutions.

use super::{axis, entry};
use crate::plot::{Axis, Entry, Figure, Mark};
use crate::study::Table;

/// Points at which the exact solution is marked.
const MARKED: usize = 50;

/// One oscillator: its section, and for every figure its number, which mass, whether its velocity, and a sentence.
type Oscillator = (&'static str, &'static [(&'static str, usize, bool, &'static str)]);

const OSCILLATORS: [Oscillator; 3] = [
    (
        "Section 5.2.1: one degree of freedom under a constant force, by the two-point method with h = 0.1 s and ϑ = 0.5",
        &[("5.3.1", 1, false, "The method stays on the exact solution 1 − cos t."), ("5.3.2", 1, true, "The velocity is sin t.")],
    ),
    (
        "Section 5.2.2: two degrees of freedom, h = 0.01 s and ϑ = 0.5",
        &[
            ("5.4.1", 1, false, "The mass that is let go, on the exact sum of two cosines."),
            ("5.4.2", 2, false, "The mass between the springs, on the exact sum of two cosines."),
            ("5.4.3", 1, true, "The velocity of mass 1."),
            ("5.4.4", 2, true, "The velocity of mass 2."),
        ],
    ),
    (
        "Section 5.2.3: two degrees of freedom, stiff, h = 0.1 s and ϑ = 0.5",
        &[
            (
                "5.5.1",
                1,
                false,
                "The slow mass falls behind the exact solution a little at every swing; the fast frequency, at a step longer than half its period, does it no harm.",
            ),
            ("5.5.2", 2, false, "The fast part of mass 2, far too fast for the step, keeps its size but not its phase."),
            ("5.5.3", 1, true, "The velocity of mass 1."),
            ("5.5.4", 2, true, "The velocity of mass 2: ϑ = 0.5 does not damp what the step cannot follow."),
        ],
    ),
];

pub(super) fn figures(tables: &[Table; 3]) -> Vec<Entry> {
    let of = |((section, list), table): (&Oscillator, &Table)| -> Vec<Entry> {
        list.iter().map(|entry| figure(section, table, *entry)).collect()
    };
    OSCILLATORS.iter().zip(tables).flat_map(of).collect()
}

fn figure(
    section: &'static str,
    table: &Table,
    (number, mass, velocity, sentence): (&'static str, usize, bool, &'static str),
) -> Entry {
    let column = |name: &str| table.column(name).unwrap_or_default();
    let times = column("time_s");
    let (what, name) = if velocity { ("Velocity", "vx_m_per_s") } else { ("Displacement", "x_m") };
    let (title, name) = (format!("{what} of mass {mass}"), format!("mass{mass}_{name}"));
    let y = axis(&title, &name);
    let title = if velocity { title } else { format!("{title} and exact solution") };
    let mut figure = Figure::new(title, Axis::new("time", "s"), y).line("two-point method", times, column(&name));
    if !velocity {
        let every = times.len().div_ceil(MARKED).max(1);
        let thinned = |values: &[f64]| values.iter().copied().step_by(every).collect::<Vec<_>>();
        let exact = column(&format!("mass{mass}_exact_x_m"));
        figure = figure.series("exact", &thinned(times), &thinned(exact), Mark::Points);
    }
    entry(section, number, sentence, figure)
}
