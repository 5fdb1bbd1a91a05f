//! How a cell of the sweep ended.

use crate::simulation::{Cause, EnergyVerdict};

/// What became of a cell. The first four are clean ends; the others are faults of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Category {
    /// Ran to its end, within the bound of its reference.
    Stable,
    /// Ran to its end, but is off by more than the bound, or says itself that it bends too much for its model.
    Wrong,
    /// The simulation declared divergence.
    Diverged,
    /// Refused when the scene was checked or the model built.
    Refused,
    /// A number that is not finite was given out.
    NotFinite,
    /// The program panicked.
    Panicked,
    /// The cell did not end in the time allowed.
    Hung,
}

impl Category {
    /// All of them; a category's place here is its number in tables.
    pub const ALL: [Category; 7] = [
        Category::Stable,
        Category::Wrong,
        Category::Diverged,
        Category::Refused,
        Category::NotFinite,
        Category::Panicked,
        Category::Hung,
    ];

    /// In words.
    pub fn as_str(self) -> &'static str {
        match self {
            Category::Stable => "stable",
            Category::Wrong => "stable but wrong",
            Category::Diverged => "diverged",
            Category::Refused => "refused",
            Category::NotFinite => "not finite",
            Category::Panicked => "panicked",
            Category::Hung => "hung",
        }
    }

    /// In one character, for maps of text.
    pub fn symbol(self) -> char {
        match self {
            Category::Stable => '.',
            Category::Wrong => 'w',
            Category::Diverged => 'D',
            Category::Refused => 'r',
            Category::NotFinite | Category::Panicked | Category::Hung => '!',
        }
    }

    /// Its place in [`Category::ALL`].
    pub fn number(self) -> usize {
        self as usize
    }

    /// Whether the program did as it should.
    pub fn is_clean(self) -> bool {
        self <= Category::Refused
    }
}

/// A cell's end.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What became of it.
    pub category: Category,
    /// Largest error over the run: of position over the cell's [`Measure`](super::Measure), or, where no reference reaches, of the
    /// energy balance over the energy put in. `None` when it did not get that far.
    pub error: Option<f64>,
    /// Steps taken; of a diverged cell, the step that failed.
    pub step: u64,
    /// Simulated time reached, s.
    pub sim_time_s: f64,
    /// Energy last observed, J; `None` when refused.
    pub energy_j: Option<f64>,
    /// What the energy balance says of it, or said before it diverged; `None` when refused.
    pub verdict: Option<EnergyVerdict>,
    /// Why it diverged.
    pub cause: Option<Cause>,
    /// What was said on refusal or divergence.
    pub message: String,
}

impl Outcome {
    /// The verdict on its energy in words; empty when there is none.
    pub fn verdict_as_str(&self) -> &'static str {
        match self.verdict {
            Some(EnergyVerdict::Balanced) => "balanced",
            Some(EnergyVerdict::Unbalanced { .. }) => "unbalanced",
            Some(EnergyVerdict::NotJudged) => "not judged",
            None => "",
        }
    }
}
