//! Bands behind curves: the times at which a scene runs at a level of detail below its best.

use super::canvas::Canvas;
use super::figure::Band;
use super::frame::Frame;
use super::legend::SAMPLE;
use super::selection::Named;
use super::style::Colour;

/// Height of a band's sample in the legend, px.
const SAMPLE_HEIGHT: f64 = 12.0;

/// The times below the best level, from the topic `angles` and its times. Where the best is not given, it has the smallest stated
/// error, or without stated errors is the one that the recording begins with.
pub(super) fn levels(angles: &Named, times: &[f64], best: Option<&str>) -> Vec<Band> {
    let column = |name: &str| angles.table.column(name).unwrap_or_default();
    let (levels, errors) = (column("level"), column("level_error_rad"));
    let names = angles.texts_of("level").unwrap_or_default();
    let error = |row: usize| errors.get(row).copied().filter(|error| error.is_finite());
    // Without an error, a level counts as the worst.
    let stated = |level: f64| levels.iter().position(|other| *other == level).and_then(error).unwrap_or(f64::INFINITY);
    let Some(least_error) = levels.iter().copied().min_by(|a, b| stated(*a).total_cmp(&stated(*b))) else { return Vec::new() };
    // A best level that the recording never had is none of its numbers.
    let number = |best: &str| names.iter().position(|name| name == best).map_or(-1.0, |place| place as f64);
    let best = best.map_or(least_error, number);
    let mut bands: Vec<Band> = Vec::new();
    let mut before = f64::NAN;
    for (row, (level, time)) in levels.iter().zip(times).enumerate() {
        // A level holds until the sample at which the next one is in force.
        if let Some(band) = bands.last_mut().filter(|_| before != best) {
            band.span[1] = *time;
        }
        if *level != best && *level != before {
            let name = names.get(*level as usize).map_or("", String::as_str);
            let error = error(row).map(|error| format!(" ({error:.1e} rad)")).unwrap_or_default();
            bands.push(Band { label: format!("level {name}{error}"), span: [*time; 2] });
        }
        before = *level;
    }
    bands
}

/// Names of bands, each once, in the order of their colours.
pub(super) fn labels(bands: &[Band]) -> Vec<&str> {
    let mut labels: Vec<&str> = Vec::new();
    for band in bands {
        if !labels.contains(&band.label.as_str()) {
            labels.push(&band.label);
        }
    }
    labels
}

/// The colour of the bands of a name.
fn colour(bands: &[Band], label: &str) -> Colour {
    Colour::band(labels(bands).iter().position(|other| *other == label).unwrap_or_default())
}

/// Shades bands in a frame, from its lower edge to its upper.
pub(super) fn draw(canvas: &mut Canvas, frame: &Frame, bands: &[Band]) {
    for band in bands {
        let [from, to] = band.span.map(|value| frame.x.part(value).map(|part| frame.left + frame.width * part.clamp(0.0, 1.0)));
        if let (Some(from), Some(to)) = (from, to) {
            canvas.fill([from, frame.top], [to, frame.top + frame.height], colour(bands, &band.label));
        }
    }
}

/// Draws the sample of the bands of a name in the legend, from a point rightwards.
pub(super) fn draw_sample(canvas: &mut Canvas, [x, y]: [f64; 2], bands: &[Band], label: &str) {
    let half = SAMPLE_HEIGHT / 2.0;
    canvas.fill([x, y - half], [x + SAMPLE, y + half], colour(bands, label));
}
