//! The figures of the thesis, from tables that the program has computed itself, and the page that shows them.
//!
//! A figure more is an entry in [`figures`] or in the lists that it calls.

mod chapter4;
mod chapter5;
mod oscillators;

use super::output::{Format, Picture};
use super::page::{self, Entry};
use crate::study::Table;

const INTRODUCTION: &str = "<p>N. K. Danias, <i>Elastodynamic analysis of mechanisms with the finite element method</i>, National Technical University of Athens, 2011. Every figure is drawn from numbers that flexcrank has just computed. In chapter 4 the numbers are those of the equations that are drawn; in chapter 5 those of the thesis's own list, carried on where the print has none.</p>";

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

/// One figure of the thesis.
#[derive(Debug, Clone, PartialEq)]
pub struct ThesisFigure {
    /// Its number: in chapter 4 that of the equation it draws.
    pub number: &'static str,
    /// Name of its file, without ending.
    pub file: String,
    /// Caption: what the figure shows.
    pub sentence: &'static str,
    /// The section it belongs to.
    pub section: &'static str,
    /// The figure.
    pub picture: Picture,
}

/// All figures, in the order of the thesis.
pub fn figures(tables: &Tables) -> Vec<ThesisFigure> {
    let mut figures = chapter4::figures(&tables.compressor);
    figures.extend(oscillators::figures(&tables.oscillators));
    figures.extend(chapter5::beam(&chapter5::BEAM, &tables.beam));
    figures.extend(chapter5::beam(&chapter5::BEAM_WITH_TIP_MASS, &tables.beam_with_tip_mass));
    figures.extend(chapter5::crank_slider(&tables.crank_slider));
    figures
}

/// The page for figures that lie beside it in these formats.
pub fn page(figures: &[ThesisFigure], formats: &[Format]) -> String {
    let entry = |figure: &ThesisFigure| Entry {
        section: figure.section.to_owned(),
        number: figure.number.to_owned(),
        file: figure.file.clone(),
        title: figure.picture.title().to_owned(),
        sentence: figure.sentence.to_owned(),
        endings: formats.iter().map(|format| format.extension()).collect(),
    };
    page::page("The figures of the thesis", INTRODUCTION, &figures.iter().map(entry).collect::<Vec<_>>())
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
