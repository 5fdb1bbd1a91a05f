//! Panels of a figure: signals that would look flat beside others get panels of their own.

use super::figure::{Axis, Figure, Panel, Series};

/// A curve that spans less than this part of its panel looks flat.
const FLAT: f64 = 0.1;
/// Most signals in a panel: more lines cannot be told apart.
const MOST: usize = 5;

impl Figure {
    /// The panels as they are drawn. Signals share one while none of them looks flat.
    pub(super) fn drawn_panels(&self) -> Vec<Panel> {
        if !self.signals {
            return self.panels.clone();
        }
        let mut panels: Vec<Panel> = Vec::new();
        for panel in &self.panels {
            let first = panels.len();
            for series in &panel.series {
                let fitting = panels[first..].iter_mut().find(|other| other.series.len() < MOST && fits(&other.series, series));
                match fitting {
                    Some(other) => other.series.push(series.clone()),
                    None => panels.push(Panel { y: panel.y.clone(), series: vec![series.clone()] }),
                }
            }
        }
        for panel in &mut panels {
            if panel.y.label.is_empty() && panel.series.len() > 1 {
                panel.y.label = last_words(&panel.series);
            }
            if let [series] = panel.series.as_slice() {
                panel.y = panel.y.of(&series.label);
            }
        }
        panels
    }
}

impl Axis {
    /// The axis of one signal alone: `crank chord angle`.
    pub(super) fn of(&self, signal: &str) -> Axis {
        Axis { label: format!("{signal} {}", self.label).trim().to_owned(), ..self.clone() }
    }
}

/// The words that all labels end with: `force` of `peak guide force` and `peak shaking force`.
fn last_words(series: &[Series]) -> String {
    let backwards = |series: &Series| series.label.split(' ').rev().map(str::to_owned).collect::<Vec<_>>();
    let mut words = series.first().map(backwards).unwrap_or_default();
    for other in series.iter().map(backwards) {
        words.truncate(words.iter().zip(&other).take_while(|(a, b)| a == b).count());
    }
    words.reverse();
    words.join(" ")
}

/// Whether no curve looks flat once `series` is among `others`.
fn fits(others: &[Series], series: &Series) -> bool {
    let spans = || others.iter().chain([series]).filter_map(span);
    let (low, high) = spans().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), span| (low.min(span[0]), high.max(span[1])));
    // A constant is flat anywhere.
    spans().all(|span| span[0] == span[1] || span[1] - span[0] >= FLAT * (high - low))
}

fn span(series: &Series) -> Option<[f64; 2]> {
    let finite = || series.ys.iter().copied().filter(|value| value.is_finite());
    let span = [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
    (span[0] <= span[1]).then_some(span)
}
