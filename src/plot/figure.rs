//! A figure as data: a title, two axes, curves. It holds what is drawn; the drawing decides how it looks.

/// Curves over two axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Figure {
    /// Title of the figure.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves, in the order of the legend.
    pub series: Vec<Series>,
    /// Whether both axes have the same scale, as paths and hodographs need.
    pub equal_aspect: bool,
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
    /// How the curve is drawn.
    pub mark: Mark,
}

/// Style of a curve. Colour, dash and marker follow from its position among the curves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Mark {
    /// A line, with sparse markers to distinguish it.
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
