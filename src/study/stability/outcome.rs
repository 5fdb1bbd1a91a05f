//! Outcomes of the cells of a sweep.

use super::label::Label;
use crate::simulation::{Cause, EnergyVerdict};

/// The end of a cell. The first four are clean ends, and the last is none; the others are faults of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Category {
    /// Ran to its end, within the bound of its reference.
    Stable,
    /// Ran to its end with an error above the bound, or with deflections out of the model's range.
    Wrong,
    /// The simulation declared divergence.
    Diverged,
    /// Refused by the check of the scene or by the model.
    Refused,
    /// A result was not finite.
    NotFinite,
    /// The program panicked.
    Panicked,
    /// The cell exceeded the time limit.
    Hung,
    /// The sweep was interrupted before it.
    NotRun,
}

impl Category {
    /// All categories; tables use the index.
    pub const ALL: [Category; 8] = [
        Category::Stable,
        Category::Wrong,
        Category::Diverged,
        Category::Refused,
        Category::NotFinite,
        Category::Panicked,
        Category::Hung,
        Category::NotRun,
    ];

    /// Name of the category.
    pub fn as_str(self) -> &'static str {
        match self {
            Category::Stable => "stable",
            Category::Wrong => "stable but wrong",
            Category::Diverged => "diverged",
            Category::Refused => "refused",
            Category::NotFinite => "not finite",
            Category::Panicked => "panicked",
            Category::Hung => "hung",
            Category::NotRun => "not run",
        }
    }

    /// Symbol in text maps.
    pub fn symbol(self) -> char {
        match self {
            Category::Stable => '.',
            Category::Wrong => 'w',
            Category::Diverged => 'D',
            Category::Refused => 'r',
            Category::NotFinite | Category::Panicked | Category::Hung => '!',
            Category::NotRun => ' ',
        }
    }

    /// Index in [`Category::ALL`].
    pub fn number(self) -> usize {
        self as usize
    }

    /// Whether the program behaved correctly.
    pub fn is_clean(self) -> bool {
        self <= Category::Refused || self == Category::NotRun
    }
}

/// The end of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The end.
    pub category: Category,
    /// Largest error over the run: of position over the cell's [`Measure`](super::Measure), or, where no reference reaches, of the
    /// energy balance over the energy put in. `None` when it did not get that far.
    pub error: Option<f64>,
    /// Steps taken; for a diverged cell, the step that failed.
    pub step: u64,
    /// Simulated time reached, s.
    pub sim_time_s: f64,
    /// Kinetic and strain energy last observed, J; `None` when refused.
    pub energy_j: Option<f64>,
    /// Verdict on the energy balance, at the end or before divergence; `None` if refused.
    pub verdict: Option<EnergyVerdict>,
    /// Why it diverged.
    pub cause: Option<Cause>,
    /// Message on refusal or divergence.
    pub message: String,
    /// Why it is wrong or diverged; `None` for other ends.
    pub label: Option<Label>,
    /// Growth of small differences by the mechanism itself; `None` where it is not known.
    pub growth: Option<f64>,
}

impl Outcome {
    /// An end of which nothing but a message is known.
    pub fn without_run(category: Category, message: String) -> Self {
        let (error, energy_j, verdict, cause, label, growth) = Default::default();
        Outcome { category, error, step: 0, sim_time_s: 0.0, energy_j, verdict, cause, message, label, growth }
    }

    /// Symbol in text maps: of the category; another letter where the scheme is not to blame.
    pub fn symbol(&self) -> char {
        let letter = match self.label {
            Some(Label::Mechanism) => 'm',
            Some(Label::Model) => 'l',
            Some(Label::Undecided) => 'u',
            Some(Label::Scheme) | None => return self.category.symbol(),
        };
        if self.category == Category::Diverged { letter.to_ascii_uppercase() } else { letter }
    }

    /// The label in words; empty if there is none.
    pub fn label_as_str(&self) -> &'static str {
        self.label.map_or("", Label::as_str)
    }

    /// The verdict in words; empty if there is none.
    pub fn verdict_as_str(&self) -> &'static str {
        match self.verdict {
            Some(EnergyVerdict::Balanced) => "balanced",
            Some(EnergyVerdict::Unbalanced { .. }) => "unbalanced",
            Some(EnergyVerdict::NotJudged) => "not judged",
            None => "",
        }
    }
}
