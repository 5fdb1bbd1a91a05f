//! Pictures as files: SVG as drawn, PNG rasterised from it with the embedded font.

use std::path::Path;

use resvg::{tiny_skia, usvg};

use super::canvas::Lettering;
use super::error::PlotError;
use super::figure::Figure;
use super::heat_map::HeatMap;
use super::strobe::Strobe;

/// Pixels of a PNG for every px of its SVG.
pub const PNG_SCALE: f32 = 2.0;

/// A file format for pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Scalable, small, for pages.
    Svg,
    /// Pixels, for everything else.
    Png,
}

impl Format {
    /// The ending of its files' names.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Svg => "svg",
            Format::Png => "png",
        }
    }

    /// The format that a file name's ending asks for.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?;
        [Format::Svg, Format::Png].into_iter().find(|format| ending.eq_ignore_ascii_case(format.extension()))
    }
}

/// Something to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Picture {
    /// Curves.
    Figure(Figure),
    /// A map.
    HeatMap(HeatMap),
    /// A mechanism at several instants.
    Strobe(Strobe),
}

impl Picture {
    /// Title of the picture.
    pub fn title(&self) -> &str {
        match self {
            Picture::Figure(figure) => &figure.title,
            Picture::HeatMap(map) => &map.title,
            Picture::Strobe(strobe) => &strobe.title,
        }
    }

    /// The picture as SVG.
    pub fn to_svg(&self) -> String {
        self.drawn(Lettering::Text)
    }

    fn drawn(&self, lettering: Lettering) -> String {
        match self {
            Picture::Figure(figure) => figure.drawn(lettering),
            Picture::HeatMap(map) => map.drawn(lettering),
            Picture::Strobe(strobe) => strobe.drawn(lettering),
        }
    }

    /// The picture as the bytes of a file.
    ///
    /// # Errors
    /// [`PlotError::Png`] when the rasterising library refuses.
    pub fn render(&self, format: Format) -> Result<Vec<u8>, PlotError> {
        match format {
            Format::Svg => Ok(self.to_svg().into_bytes()),
            Format::Png => png(&self.drawn(Lettering::Outlines))
                .map_err(|cause| PlotError::Png { title: self.title().to_owned(), cause: cause.to_string() }),
        }
    }

    /// Writes the picture to a file.
    ///
    /// # Errors
    /// [`PlotError`] when it cannot be drawn or written.
    pub fn write(&self, path: &Path, format: Format) -> Result<(), PlotError> {
        std::fs::write(path, self.render(format)?).map_err(|cause| PlotError::File { path: path.to_owned(), cause })
    }
}

impl From<Figure> for Picture {
    fn from(figure: Figure) -> Self {
        Picture::Figure(figure)
    }
}

impl From<HeatMap> for Picture {
    fn from(map: HeatMap) -> Self {
        Picture::HeatMap(map)
    }
}

impl From<Strobe> for Picture {
    fn from(strobe: Strobe) -> Self {
        Picture::Strobe(strobe)
    }
}

fn png(svg: &str) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
    let [width, height] = [tree.size().width(), tree.size().height()].map(|px| (px * PNG_SCALE).round() as u32);
    let mut pixels = tiny_skia::Pixmap::new(width, height).ok_or("it has no size")?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(PNG_SCALE, PNG_SCALE), &mut pixels.as_mut());
    Ok(pixels.encode_png()?)
}
