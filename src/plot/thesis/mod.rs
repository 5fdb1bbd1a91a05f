//! The figures of the thesis, from tables that the program has computed itself.
//!
//! A figure more is an entry in [`figures`] or in the lists that it calls.

mod chapter4;
mod chapter5;
mod oscillators;

use super::figure::{Axis, Figure};
use super::page::Entry;
use super::quantity;
use crate::study::Table;

/// Title of the page.
pub const TITLE: &str = "The figures of the thesis";
/// The introduction, in HTML.
pub const INTRODUCTION: &str = "<p>N. K. Danias, <i>Elastodynamic analysis of mechanisms with the finite element method</i>, National Technical University of Athens, 2011. Every figure is drawn from numbers that flexcrank has just computed. In chapter 4 the numbers are those of the equations that are drawn; in chapter 5 those of the thesis's own list, carried on where the print has none.</p>";

/// All figures, in the order of the thesis: chapter 4 from [`cycle`](crate::study::cycle::cycle), dimensionless, of all ratios;
/// chapter 5 from [`history`](crate::study::history) of the three oscillators, of the hinged beam without and with its tip mass,
/// and of the crank-slider.
pub fn figures(compressor: &Table, oscillators: &[Table; 3], beams: &[Table; 2], crank_slider: &Table) -> Vec<Entry> {
    let mut figures = chapter4::figures(compressor);
    figures.extend(oscillators::figures(oscillators));
    figures.extend(chapter5::beam(&chapter5::BEAM, &beams[0]));
    figures.extend(chapter5::beam(&chapter5::BEAM_WITH_TIP_MASS, &beams[1]));
    figures.extend(chapter5::crank_slider(crank_slider));
    figures
}

/// An entry of the page: its number, in chapter 4 that of the equation it draws, and its caption.
fn entry(section: &str, number: &'static str, sentence: &str, figure: Figure) -> Entry {
    let (section, sentence, file) = (section.to_owned(), sentence.to_owned(), file(number, &figure.title));
    Entry { section, number, file, sentence, picture: Box::new(figure) }
}

/// The axis of what a title names: its unit, or what it is divided by, is in the column's name.
fn axis(title: &str, column: &str) -> Axis {
    let Axis { label, unit, .. } = quantity::axis(column);
    let divisor = label.find(" / ").map_or("", |place| &label[place..]);
    let mut letters = title.chars();
    let first = letters.next().map(|first| first.to_lowercase().to_string()).unwrap_or_default();
    Axis::new(format!("{first}{}{divisor}", letters.as_str()), unit)
}

/// `4.30, 4.31` and `Path of B` as `4-30-31-path-of-b`, numbers of two digits so that files sort as the figures do.
fn file(number: &str, what: &str) -> String {
    let chapter = number.split('.').next().unwrap_or_default();
    let mut name = chapter.to_owned();
    for equation in number.split(", ") {
        for part in equation.split('.').skip(1) {
            name.push_str(&format!("-{part:0>2}"));
        }
    }
    let what = what.replace('Γ', "gamma").replace('Ψ', "psi").to_ascii_lowercase();
    for word in what.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty()) {
        name.push_str(&format!("-{word}"));
    }
    name
}
