//! A figure as data: a title, two axes, curves. It holds what is drawn; the drawing decides how it looks.

/// Curves over two axes, in one panel or in several stacked over one horizontal axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Figure {
    /// Title of the figure.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The panels, from above.
    pub panels: Vec<Panel>,
    /// Whether both axes have the same scale, as paths and hodographs need.
    pub equal_aspect: bool,
    /// Whether the curves are different signals: those that would look flat beside others get panels of their own.
    pub signals: bool,
    /// Parts of the horizontal axis that are shaded behind the curves.
    pub bands: Vec<Band>,
    /// Points that are numbered in place and listed beside the panel, joined by a line.
    pub numbered: Vec<Numbered>,
    /// Marks that the legend explains, in grey: each stands for the same in every colour.
    pub explained: Vec<(Mark, String)>,
    /// Files whose curves lie over one another, each labelled with its file, in the order of their colours. One legend above all
    /// panels names those that are shown, also a single one.
    pub files: Vec<String>,
}

/// Curves over one vertical axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// The vertical axis.
    pub y: Axis,
    /// The curves, in the order of the legend.
    pub series: Vec<Series>,
}

/// A part of the horizontal axis, shaded from below to above.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Band {
    /// Its name in the legend; bands of one name have one colour.
    pub label: String,
    /// Where it begins and ends.
    pub span: [f64; 2],
}

/// A numbered point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Numbered {
    /// Position in the panel.
    pub at: [f64; 2],
    /// The curve whose colour it has.
    pub series: usize,
    /// Its marker; a dot unless it is a hollow one.
    pub mark: Mark,
    /// Two lines of the list: name and details.
    pub lines: [String; 2],
}

/// One axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// In what unit; empty for pure numbers.
    pub unit: String,
    /// Scale of the axis.
    pub scale: Scale,
    /// Labels at 0, 1, 2, … of an axis that lists cases; empty for others.
    pub names: Vec<String>,
}

/// Scale of an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// Evenly in the logarithm; values that are not positive are left out.
    Log,
    /// Evenly, an angle in radians labelled in multiples of π.
    Pi,
}

/// One curve. A value that is not finite interrupts it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub label: String,
    /// Horizontal values.
    pub xs: Vec<f64>,
    /// Vertical values; what has no partner in `xs` is left out.
    pub ys: Vec<f64>,
    /// The way the curve is drawn.
    pub mark: Mark,
}

/// Style of a curve. Its colour follows from its label's position among the labels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Mark {
    /// A line.
    #[default]
    Line,
    /// A wide, pale line, for a curve on which others may lie.
    Wide,
    /// A dashed line, for a curve that may lie on another.
    Dashes,
    /// A dashed line, for a limit that is the same for all curves.
    Limit,
    /// A dot at every point.
    Points,
    /// A ring at every point.
    Rings,
    /// A hollow triangle on its tip at every point, for values that are upper bounds.
    Triangles,
}

impl Figure {
    /// A figure without curves yet.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Figure { title: title.into(), x, panels: vec![Panel { y, series: Vec::new() }], ..Figure::default() }
    }

    /// Begins another panel under the last one.
    #[must_use]
    pub fn panel(mut self, y: Axis) -> Self {
        self.panels.push(Panel { y, series: Vec::new() });
        self
    }

    /// Adds a line to the last panel.
    #[must_use]
    pub fn line(self, label: impl Into<String>, xs: &[f64], ys: &[f64]) -> Self {
        self.series(label, xs, ys, Mark::Line)
    }

    /// Adds a curve to the last panel.
    #[must_use]
    pub fn series(mut self, label: impl Into<String>, xs: &[f64], ys: &[f64], mark: Mark) -> Self {
        let series = Series { label: label.into(), xs: xs.to_vec(), ys: ys.to_vec(), mark };
        self.panels.last_mut().into_iter().for_each(|panel| panel.series.push(series.clone()));
        self
    }
}

impl Axis {
    /// A linear axis.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Axis { label: label.into(), unit: unit.into(), ..Axis::default() }
    }

    /// An angle in radians, labelled in multiples of π.
    pub fn angle(label: impl Into<String>) -> Self {
        Axis { scale: Scale::Pi, ..Axis::new(label, "rad") }
    }

    /// A logarithmic axis.
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Axis { scale: Scale::Log, ..Axis::new(label, unit) }
    }
}

impl Series {
    /// Its points.
    pub(super) fn points(&self) -> impl Iterator<Item = [f64; 2]> {
        self.xs.iter().zip(&self.ys).map(|(x, y)| [*x, *y])
    }
}
