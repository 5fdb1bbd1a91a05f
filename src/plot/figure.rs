//! A figure as data: a title, two axes, curves. It says what is drawn; how it looks is decided once, in the drawing.

/// Curves over two axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Figure {
    /// What stands above it.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves, in the order of the legend.
    pub series: Vec<Series>,
    /// The same length a unit on both axes, as paths and hodographs need.
    pub equal_aspect: bool,
}

/// One axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// What it measures.
    pub label: String,
    /// In what unit; empty for pure numbers.
    pub unit: String,
    /// How values lie along it.
    pub scale: Scale,
    /// What stands at 0, 1, 2, …, where the axis is a list of cases; empty elsewhere.
    pub names: Vec<String>,
}

/// How values lie along an axis.
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
    /// How it is drawn.
    pub mark: Mark,
}

/// How a curve is drawn. Colour, dash and marker follow from its place among the curves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Mark {
    /// A line; markers here and there tell it from others.
    #[default]
    Line,
    /// A marker at every point.
    Points,
    /// Both, as a work–precision diagram has it.
    LineAndPoints,
}

impl Figure {
    /// A figure without curves yet.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Figure { title: title.into(), x, y, ..Figure::default() }
    }

    /// Adds a line.
    #[must_use]
    pub fn line(self, label: impl Into<String>, xs: &[f64], ys: &[f64]) -> Self {
        self.series(label, xs, ys, Mark::Line)
    }

    /// Adds a curve.
    #[must_use]
    pub fn series(mut self, label: impl Into<String>, xs: &[f64], ys: &[f64], mark: Mark) -> Self {
        self.series.push(Series { label: label.into(), xs: xs.to_vec(), ys: ys.to_vec(), mark });
        self
    }

    /// Draws both axes to the same measure.
    #[must_use]
    pub fn with_equal_aspect(mut self) -> Self {
        self.equal_aspect = true;
        self
    }
}

impl Axis {
    /// A linear axis.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Axis { label: label.into(), unit: unit.into(), ..Axis::default() }
    }

    /// A list of cases, at 0, 1, 2, ….
    pub fn listed(label: impl Into<String>, unit: impl Into<String>, names: Vec<String>) -> Self {
        Axis { names, ..Axis::new(label, unit) }
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
