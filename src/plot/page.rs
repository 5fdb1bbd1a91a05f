//! A page that shows pictures: plain HTML, nothing from elsewhere, no scripts.

use std::path::{Path, PathBuf};

use super::canvas::escape;
use super::error::PlotError;
use super::output::{Format, Picture};
use super::style::sheet;

const HEAD: &str = "<!DOCTYPE html>
<html lang=\"en\">
<head>
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<style>
body { font: 16px/1.5 sans-serif; color: #1e1e1e; background: #fff; max-width: 820px; margin: 2em auto; padding: 0 1em; }
figure { margin: 2.5em 0; }
img { max-width: 100%; height: auto; }
code { overflow-wrap: anywhere; }
nav { columns: 2; }
nav a { display: block; }
</style>
";

/// A picture on a page, in files beside it.
pub struct Entry {
    /// The section it belongs to.
    pub section: String,
    /// Its number; empty if it has none.
    pub number: &'static str,
    /// Name of its files, without ending.
    pub file: String,
    /// Caption: what the picture shows.
    pub sentence: String,
    /// The picture.
    pub picture: Box<dyn Picture>,
}

impl Entry {
    /// Writes the picture into a folder, in the formats that it can have of these; returns the paths.
    ///
    /// # Errors
    /// [`PlotError`] when it cannot be drawn or written.
    pub fn write(&self, folder: &Path, formats: &[Format]) -> Result<Vec<PathBuf>, PlotError> {
        self.picture.write_into(folder, &self.file, formats)
    }

    /// Number and title.
    fn caption(&self) -> String {
        format!("{} {}", self.number, self.picture.title()).trim_start().to_owned()
    }

    fn figure(&self, formats: &[Format]) -> String {
        let [file, caption, sentence] = [&self.file, &self.caption(), &self.sentence].map(|text| escape(text));
        let bold = if self.number.is_empty() { String::new() } else { format!("<b>{}</b> ", escape(self.number)) };
        let title = escape(self.picture.title());
        // As addresses have them.
        let address = file.replace('%', "%25").replace('#', "%23").replace('?', "%3F");
        let endings: Vec<&str> = self.picture.formats(formats).into_iter().map(Format::extension).collect();
        let links: Vec<String> = endings.iter().map(|ending| format!("<a href=\"{address}.{ending}\">{ending}</a>")).collect();
        format!(
            "<figure id=\"{file}\">\n<img src=\"{address}.{}\" width=\"{}\" alt=\"{caption}\">\n\
             <figcaption>{bold}{title}. {sentence} ({})</figcaption>\n</figure>\n",
            endings.first().unwrap_or(&"svg"),
            sheet::WIDTH,
            links.join(", ")
        )
    }
}

/// The page with a title, an introduction in HTML, and pictures that lie beside it in these formats.
pub fn page(title: &str, introduction: &str, entries: &[Entry], formats: &[Format]) -> String {
    let title = escape(title);
    let mut page = format!("{HEAD}<title>{title}</title>\n</head>\n<body>\n<h1>{title}</h1>\n{introduction}\n<nav>\n");
    for entry in entries {
        page.push_str(&format!("<a href=\"#{}\">{}</a>\n", escape(&entry.file), escape(&entry.caption())));
    }
    page.push_str("</nav>\n");
    let mut section = "";
    for entry in entries {
        if entry.section != section {
            section = &entry.section;
            page.push_str(&format!("<h2>{}</h2>\n", escape(section)));
        }
        page.push_str(&entry.figure(formats));
    }
    page.push_str("</body>\n</html>\n");
    page
}
