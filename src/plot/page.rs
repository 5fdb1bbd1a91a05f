//! A page that shows pictures: plain HTML, nothing from elsewhere, no scripts.

use super::canvas::escape;
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
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Entry {
    /// The section it belongs to.
    pub section: String,
    /// Its number; empty if it has none.
    pub number: String,
    /// Name of its files, without ending.
    pub file: String,
    /// Title of the picture.
    pub title: String,
    /// Caption: what the picture shows.
    pub sentence: String,
    /// Endings of its files; the first is shown, all are linked.
    pub endings: Vec<&'static str>,
}

/// The page with a title, an introduction in HTML, and entries.
pub fn page(title: &str, introduction: &str, entries: &[Entry]) -> String {
    let title = escape(title);
    let mut page = format!("{HEAD}<title>{title}</title>\n</head>\n<body>\n<h1>{title}</h1>\n{introduction}\n<nav>\n");
    for Entry { number, file, title, .. } in entries {
        page.push_str(&format!("<a href=\"#{}\">{} {}</a>\n", escape(file), escape(number), escape(title)));
    }
    page.push_str("</nav>\n");
    let mut section = "";
    for entry in entries {
        if entry.section != section {
            section = &entry.section;
            page.push_str(&format!("<h2>{}</h2>\n", escape(section)));
        }
        page.push_str(&figure(entry));
    }
    page.push_str("</body>\n</html>\n");
    page
}

fn figure(entry: &Entry) -> String {
    let [number, file, title, sentence] = [&entry.number, &entry.file, &entry.title, &entry.sentence].map(|text| escape(text));
    let shown = entry.endings.first().unwrap_or(&"svg");
    // As addresses have them.
    let address = file.replace('%', "%25").replace('#', "%23").replace('?', "%3F");
    let links: Vec<String> = entry.endings.iter().map(|ending| format!("<a href=\"{address}.{ending}\">{ending}</a>")).collect();
    format!(
        "<figure id=\"{file}\">\n<img src=\"{address}.{shown}\" width=\"{}\" alt=\"{number} {title}\">\n\
         <figcaption><b>{number}</b> {title}. {sentence} ({})</figcaption>\n</figure>\n",
        sheet::WIDTH,
        links.join(", ")
    )
}
