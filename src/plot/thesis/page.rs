//! The page that shows all figures: plain HTML, nothing from elsewhere, no scripts.

use super::ThesisFigure;
use crate::plot::canvas::escape;
use crate::plot::{Format, sheet};

const HEAD: &str = "<!DOCTYPE html>
<html lang=\"en\">
<head>
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<title>The figures of the thesis</title>
<style>
body { font: 16px/1.5 sans-serif; color: #1e1e1e; background: #fff; max-width: 820px; margin: 2em auto; padding: 0 1em; }
figure { margin: 2.5em 0; }
img { max-width: 100%; height: auto; }
nav { columns: 2; }
nav a { display: block; }
</style>
</head>
<body>
<h1>The figures of the thesis</h1>
<p>N. K. Danias, <i>Elastodynamic analysis of mechanisms with the finite element method</i>, National Technical University of Athens, 2011. Every figure is drawn from numbers that flexcrank has just computed. In chapter 4 the numbers are those of the equations that are drawn; in chapter 5 those of the thesis's own list, carried on where the print has none.</p>
";

/// The page for figures that lie beside it in these formats.
pub fn page(figures: &[ThesisFigure], formats: &[Format]) -> String {
    let mut page = HEAD.to_owned();
    page.push_str("<nav>\n");
    for figure in figures {
        let (number, title) = (figure.number, escape(figure.picture.title()));
        page.push_str(&format!("<a href=\"#{}\">{number} {title}</a>\n", figure.file));
    }
    page.push_str("</nav>\n");
    let mut section = "";
    for figure in figures {
        if figure.section != section {
            section = figure.section;
            page.push_str(&format!("<h2>{}</h2>\n", escape(section)));
        }
        page.push_str(&entry(figure, formats));
    }
    page.push_str("</body>\n</html>\n");
    page
}

fn entry(figure: &ThesisFigure, formats: &[Format]) -> String {
    let ThesisFigure { number, file, sentence, picture, .. } = figure;
    let (title, sentence) = (escape(picture.title()), escape(sentence));
    // The first format is shown, all are linked.
    let shown = formats.first().map_or("svg", |format| format.extension());
    let links: Vec<String> = formats
        .iter()
        .map(|format| format.extension())
        .map(|ending| format!("<a href=\"{file}.{ending}\">{ending}</a>"))
        .collect();
    format!(
        "<figure id=\"{file}\">\n<img src=\"{file}.{shown}\" width=\"{}\" alt=\"{number} {title}\">\n\
         <figcaption><b>{number}</b> {title}. {sentence} ({})</figcaption>\n</figure>\n",
        sheet::WIDTH,
        links.join(", ")
    )
}
