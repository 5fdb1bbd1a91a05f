//! The labels of diverged and wrong cells.

/// Why a cell is wrong or diverged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Label {
    /// The mechanism itself makes small differences a thousand times as large: no scheme stays right for long.
    Mechanism,
    /// The mechanism does not, and the same model is right at a fine step: the scheme fails at its step.
    Scheme,
    /// The mechanism does not, but the same model fails alike at fine steps: by its mesh, its modes, or its range.
    Model,
    /// The growth or the fine runs could not be computed, or those of two steps do not agree.
    Undecided,
}

impl Label {
    /// All labels.
    pub const ALL: [Label; 4] = [Label::Scheme, Label::Mechanism, Label::Model, Label::Undecided];

    /// Name of the label.
    pub fn as_str(self) -> &'static str {
        match self {
            Label::Mechanism => "mechanism",
            Label::Scheme => "scheme",
            Label::Model => "model",
            Label::Undecided => "undecided",
        }
    }
}
