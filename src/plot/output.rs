//! Pictures as files: SVG as drawn, PNG rasterised from it with the embedded font.

use std::path::{Path, PathBuf};

use resvg::{tiny_skia, usvg};

use super::canvas::Lettering;
use super::error::PlotError;
use crate::whole_file::write_whole;

/// Pixels of a PNG for every px of its SVG.
pub const PNG_SCALE: f32 = 2.0;

/// A file format for pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Scalable, small, for pages.
    Svg,
    /// Pixels, for everything else.
    Png,
}

impl Format {
    /// The ending of its files' names.
    pub fn extension(self) -> &'static str {
        if self == Format::Svg { "svg" } else { "png" }
    }

    /// The format that a file name's ending asks for.
    pub fn of(path: &Path) -> Option<Self> {
        clap::ValueEnum::from_str(path.extension()?.to_str()?, true).ok()
    }
}

/// Something that can be drawn.
pub trait Picture {
    /// Title of the picture.
    fn title(&self) -> &str;

    /// The picture as SVG, its texts in this lettering.
    fn draw(&self, lettering: Lettering) -> String;

    /// The formats that the picture can have, of these.
    fn formats(&self, asked: &[Format]) -> Vec<Format> {
        asked.to_vec()
    }

    /// The picture as SVG.
    fn to_svg(&self) -> String {
        self.draw(Lettering::Text)
    }

    /// The picture as the bytes of a file.
    ///
    /// # Errors
    /// [`PlotError::Png`] when the rasterising library refuses.
    fn render(&self, format: Format) -> Result<Vec<u8>, PlotError> {
        match format {
            Format::Svg => Ok(self.to_svg().into_bytes()),
            Format::Png => {
                png(&self.draw(Lettering::Outlines)).map_err(|cause| PlotError::Png(self.title().to_owned(), cause.to_string()))
            }
        }
    }

    /// Writes the picture to a file.
    ///
    /// # Errors
    /// [`PlotError`] when it cannot be drawn or written.
    fn write(&self, path: &Path, format: Format) -> Result<(), PlotError> {
        write_whole(path, &self.render(format)?).map_err(|cause| PlotError::File(path.to_owned(), cause))
    }

    /// Writes the picture into a folder, in the formats that it can have of these; returns the paths.
    ///
    /// # Errors
    /// [`PlotError`] when it cannot be drawn or written.
    fn write_into(&self, folder: &Path, name: &str, formats: &[Format]) -> Result<Vec<PathBuf>, PlotError> {
        let write = |format: Format| {
            let path = folder.join(format!("{name}.{}", format.extension()));
            self.write(&path, format).map(|()| path)
        };
        self.formats(formats).into_iter().map(write).collect()
    }
}

fn png(svg: &str) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
    let [width, height] = [tree.size().width(), tree.size().height()].map(|px| (px * PNG_SCALE).round() as u32);
    let mut pixels = tiny_skia::Pixmap::new(width, height).ok_or("it has no size")?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(PNG_SCALE, PNG_SCALE), &mut pixels.as_mut());
    Ok(pixels.encode_png()?)
}
