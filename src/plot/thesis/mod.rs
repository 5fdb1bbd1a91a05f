//! The figures of the thesis, from tables that the program has computed itself.
//!
//! A figure more is an entry in [`figures`] or in the lists that it calls.

mod chapter4;
mod chapter5;
mod oscillators;

use super::figure::Figure;
use super::page::Entry;
use crate::study::Table;

/// Title of the page.
pub const TITLE: &str = "The figures of the thesis";
/// The introduction, in HTML.
pub const INTRODUCTION: &str = "<p>N. K. Danias, <i>Elastodynamic analysis of mechanisms with the finite element method</i>, National Technical University of Athens, 2011. Every figure is drawn from numbers that flexcrank has just computed. In chapter 4 the numbers are those of the equations that are drawn; in chapter 5 those of the thesis's own list, carried on where the print has none.</p>";

/// The tables that the figures are drawn from.
#[derive(Debug, Clone, PartialEq)]
pub struct Tables {
    /// Chapter 4: [`cycle`](crate::study::cycle::cycle), dimensionless, of all ratios.
    pub compressor: Table,
    /// Section 5.2: [`history`](crate::study::history) of the oscillator with one mass, of that with two, of the stiff one.
    pub oscillators: [Table; 3],
    /// Section 5.4: [`history`](crate::study::history) of the hinged beam.
    pub beam: Table,
    /// Section 5.5: the same with the tip mass.
    pub beam_with_tip_mass: Table,
    /// Section 5.6: the crank-slider.
    pub crank_slider: Table,
}

/// All figures, in the order of the thesis.
pub fn figures(tables: &Tables) -> Vec<Entry> {
    let mut figures = chapter4::figures(&tables.compressor);
    figures.extend(oscillators::figures(&tables.oscillators));
    figures.extend(chapter5::beam(&chapter5::BEAM, &tables.beam));
    figures.extend(chapter5::beam(&chapter5::BEAM_WITH_TIP_MASS, &tables.beam_with_tip_mass));
    figures.extend(chapter5::crank_slider(&tables.crank_slider));
    figures
}

/// An entry of the page: its number, in chapter 4 that of the equation it draws, and its caption.
fn entry(section: &str, number: &'static str, sentence: &str, figure: Figure) -> Entry {
    let (section, sentence, file) = (section.to_owned(), sentence.to_owned(), file(number, &figure.title));
    Entry { section, number, file, sentence, picture: Box::new(figure) }
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
