//! Figures of several files, laid over one another.

use super::figure::{Figure, Mark, Panel, Series};

/// Lays the figures of files over one another: a panel for each signal, a curve for each file, under its name. The curve of the
/// first file is wide and pale.
///
/// Figures of one name, title and horizontal quantity share a figure. If a name has several of these, the later ones get a number:
/// `path-2`. A limit is in every panel of its file. Bands and numbered points are left out: each file has its own.
pub fn overlaid(files: &[(String, Vec<(String, Figure)>)]) -> Vec<(String, Figure)> {
    let names: Vec<String> = files.iter().map(|(file, _)| file.clone()).collect();
    let mut laid: Vec<(&str, Figure)> = Vec::new();
    for (place, (_, figures)) in files.iter().enumerate() {
        for (name, figure) in figures {
            let is_same = |(other, overlay): &(&str, Figure)| {
                let same_x = (&overlay.x.label, &overlay.x.unit) == (&figure.x.label, &figure.x.unit);
                *other == name.as_str() && overlay.title == figure.title && same_x
            };
            let at = laid.iter().position(is_same).unwrap_or_else(|| {
                laid.push((name.as_str(), without_curves(figure, &names)));
                laid.len() - 1
            });
            add_curves(&mut laid[at].1, figure, place);
        }
    }
    with_distinct_names(laid)
}

impl Figure {
    /// The places of the files of an overlay that have a curve in it.
    pub fn files_drawn(&self) -> Vec<usize> {
        let is_drawn = |file: &str| self.panels.iter().flat_map(|panel| &panel.series).any(|series| series.label == file);
        (0..self.files.len()).filter(|place| is_drawn(&self.files[*place])).collect()
    }

    /// Gives the files of an overlay other names in the legend: a name for each, in their order.
    pub fn rename_files(&mut self, names: &[String]) {
        for series in self.panels.iter_mut().flat_map(|panel| &mut panel.series) {
            let place = self.files.iter().position(|file| *file == series.label);
            if let Some(name) = place.and_then(|place| names.get(place)) {
                series.label.clone_from(name);
            }
        }
        self.files = names.to_vec();
    }
}

/// An overlay of files without curves yet, with the title and the horizontal axis of a figure.
fn without_curves(figure: &Figure, files: &[String]) -> Figure {
    Figure {
        title: figure.title.clone(),
        x: figure.x.clone(),
        equal_aspect: figure.equal_aspect,
        files: files.to_vec(),
        ..Figure::default()
    }
}

/// Adds the curves of the file at `place` to the panels of their signals, its limits to each of these panels, and explains its
/// marks and limits.
fn add_curves(overlay: &mut Figure, figure: &Figure, place: usize) {
    let file = overlay.files[place].clone();
    let all = figure.panels.iter().flat_map(|panel| panel.series.iter().map(move |series| (panel, series)));
    let (limits, curves): (Vec<_>, Vec<_>) = all.partition(|(_, series)| series.mark == Mark::Limit);
    let names_of_limits = limits.iter().map(|(_, limit)| (limit.mark, limit.label.clone()));
    for explained in figure.explained.iter().cloned().chain(names_of_limits) {
        if !overlay.explained.contains(&explained) {
            overlay.explained.push(explained);
        }
    }
    for (panel, series) in curves {
        let y = panel.y.of(&series.label);
        let at = overlay.panels.iter().position(|other| other.y == y).unwrap_or_else(|| {
            overlay.panels.push(Panel { y, series: Vec::new() });
            overlay.panels.len() - 1
        });
        let mark = match (place, series.mark) {
            // Where files agree, the wide line is seen on either side of the thin one.
            (0, Mark::Line | Mark::Dashes) => Mark::Wide,
            // An exact solution has a panel of its own.
            (1, Mark::Dashes) => Mark::Line,
            // The gaps show the second.
            (2.., Mark::Line) => Mark::Dashes,
            (_, mark) => mark,
        };
        overlay.panels[at].series.push(Series { label: file.clone(), mark, ..series.clone() });
    }
    for (_, limit) in limits {
        let own_panels = overlay.panels.iter_mut().filter(|panel| panel.series.iter().any(|series| series.label == file));
        own_panels.for_each(|panel| panel.series.push(Series { label: file.clone(), ..limit.clone() }));
    }
}

/// The figures under distinct names: later ones of a name get a number.
fn with_distinct_names(figures: Vec<(&str, Figure)>) -> Vec<(String, Figure)> {
    let mut named: Vec<(String, Figure)> = Vec::new();
    let mut names: Vec<&str> = Vec::new();
    for (name, figure) in figures {
        let distinct = match names.iter().filter(|other| **other == name).count() {
            0 => name.to_owned(),
            before if name.is_empty() => format!("{}", before + 1),
            before => format!("{name}-{}", before + 1),
        };
        names.push(name);
        named.push((distinct, figure));
    }
    named
}
