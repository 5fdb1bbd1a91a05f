//! Pictures of a campaign: a scalar over each key, and parallel coordinates.

use super::figure::{Axis, Figure, Mark, Scale};
use crate::study::sweep::{Coordinate, Points};

/// Most runs drawn as points or lines: more cannot be told apart.
const MOST_POINTS: usize = 2000;
const MOST_LINES: usize = 200;
/// Intervals of a range in which means are taken, if a key has more values than these.
const INTERVALS: usize = 16;
/// Groups of runs by the size of the scalar, each in a colour of its own.
const QUARTERS: [&str; 4] = ["lowest quarter", "second", "third", "highest quarter"];

/// A scalar over a key: runs as points, their mean and the mean ± a standard deviation at values or over intervals of the key.
pub fn over_key(points: &Points, scalar: usize, key: usize) -> Figure {
    let (xs, ys) = (&points.keys[key], &points.scalars[scalar]);
    let mut x = axis(xs);
    x.scale = if xs.is_log { Scale::Log } else { Scale::Linear };
    let figure = Figure::new(format!("{} over {}", ys.name, xs.name), x, Axis::new(ys.name.clone(), ""));
    let [scattered_x, scattered_y] = [xs, ys].map(|column| every(&column.values, MOST_POINTS));
    let effect = marginal(xs, &ys.values);
    let centres: Vec<f64> = effect.iter().map(|bin| bin[0]).collect();
    let curve = |deviations: f64| effect.iter().map(|bin| bin[1] + deviations * bin[2]).collect::<Vec<_>>();
    figure
        .series("runs", &scattered_x, &scattered_y, Mark::Points)
        .line("mean", &centres, &curve(0.0))
        .series("mean + standard deviation", &centres, &curve(1.0), Mark::Dashes)
        .series("mean − standard deviation", &centres, &curve(-1.0), Mark::Dashes)
}

/// Parallel coordinates: a line for each run through its keys and the scalar, each from its least to its greatest value. Colours are
/// quarters of the runs by the scalar.
pub fn parallel(points: &Points, scalar: usize) -> Figure {
    let columns: Vec<&Coordinate> = points.keys.iter().chain(points.scalars.get(scalar)).collect();
    let name = &points.scalars[scalar].name;
    // The title has the scalar's name, for which there is no room at the edge.
    let names = points.keys.iter().map(|key| key.name.clone()).chain(["scalar".to_owned()]).collect();
    let x = Axis { names, ..Axis::default() };
    let mut figure =
        Figure::new(format!("{name}: parallel coordinates"), x, Axis::new("from the least value to the greatest", ""));
    let rows = places(points.scalars[scalar].values.len(), MOST_LINES);
    let quarters = QUARTERS.into_iter().zip(by_size(&points.scalars[scalar].values, rows));
    for (quarter, rows) in quarters.filter(|(_, rows)| !rows.is_empty()) {
        let (mut xs, mut ys) = (Vec::new(), Vec::new());
        for row in rows {
            for (place, column) in columns.iter().enumerate() {
                xs.push(place as f64);
                ys.push(part(column, row));
            }
            // A gap between two runs.
            xs.push(f64::NAN);
            ys.push(f64::NAN);
        }
        figure = figure.line(quarter, &xs, &ys);
    }
    figure
}

fn axis(column: &Coordinate) -> Axis {
    Axis { names: column.words.clone(), ..Axis::new(column.name.clone(), "") }
}

/// At most `most` of `count` places, evenly spread.
fn places(count: usize, most: usize) -> Vec<usize> {
    let kept = count.min(most);
    (0..kept).map(|place| place * count / kept).collect()
}

fn every(values: &[f64], most: usize) -> Vec<f64> {
    places(values.len(), most).into_iter().map(|place| values[place]).collect()
}

/// Place, mean and standard deviation: at each value of the key or, if it has more than [`INTERVALS`], in each interval, at the mean place
/// of its runs.
fn marginal(key: &Coordinate, values: &[f64]) -> Vec<[f64; 3]> {
    let positions: Vec<f64> = key.values.iter().map(|value| position(key, *value)).collect();
    let mut distinct = positions.clone();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup();
    let by_value = !key.words.is_empty() || distinct.len() <= INTERVALS;
    let (low, high) = bounds(key);
    let group = |position: f64| match by_value {
        true => distinct.partition_point(|other| *other < position),
        false => (((position - low) / (high - low) * INTERVALS as f64) as usize).min(INTERVALS - 1),
    };
    let mut sums = vec![[0.0; 4]; if by_value { distinct.len() } else { INTERVALS }];
    for (position, value) in positions.iter().zip(values) {
        let [count, places, sum, square] = &mut sums[group(*position)];
        *count += 1.0;
        *places += position;
        *sum += value;
        *square += value * value;
    }
    let back = |position: f64| if key.is_log { position.exp() } else { position };
    let effect = |[count, places, sum, square]: &[f64; 4]| {
        let mean = sum / count;
        (*count > 0.0).then(|| [back(places / count), mean, (square / count - mean * mean).max(0.0).sqrt()])
    };
    sums.iter().filter_map(effect).collect()
}

fn position(column: &Coordinate, value: f64) -> f64 {
    if column.is_log { value.ln() } else { value }
}

/// The least and the greatest position of a column; apart, even if all are the same.
fn bounds(column: &Coordinate) -> (f64, f64) {
    let positions = || column.values.iter().map(|value| position(column, *value));
    let (low, high) = (positions().fold(f64::INFINITY, f64::min), positions().fold(f64::NEG_INFINITY, f64::max));
    if low < high { (low, high) } else { (low, low + 1.0) }
}

/// The place of a run's value between the column's least and greatest, 0 to 1.
fn part(column: &Coordinate, row: usize) -> f64 {
    let (low, high) = bounds(column);
    (position(column, column.values[row]) - low) / (high - low)
}

/// Rows in quarters by their values, the smallest first. Quarters differ by at most one row.
fn by_size(values: &[f64], mut rows: Vec<usize>) -> [Vec<usize>; QUARTERS.len()] {
    rows.sort_by(|one, other| values[*one].total_cmp(&values[*other]));
    let mut quarters: [Vec<usize>; QUARTERS.len()] = std::array::from_fn(|_| Vec::new());
    let (count, last) = (rows.len(), QUARTERS.len() - 1);
    for (rank, row) in rows.into_iter().enumerate() {
        // Fewer rows than quarters: the greatest is still in the highest.
        let quarter = if (2..=last).contains(&count) { last * rank / (count - 1) } else { QUARTERS.len() * rank / count };
        quarters[quarter].push(row);
    }
    quarters
}

#[cfg(test)]
mod tests {
    use super::super::lettering::text_width;
    use super::super::output::Picture as _;
    use super::super::style::sheet;
    use super::*;

    fn coordinate(name: &str, values: Vec<f64>, is_log: bool) -> Coordinate {
        Coordinate { name: name.to_owned(), values, is_log, words: Vec::new() }
    }

    #[test]
    fn val_a_marginal_effect_is_the_mean_over_an_interval() {
        let key = coordinate("a", (0..1600).map(|n| f64::from(n) / 1599.0).collect(), false);
        let values: Vec<f64> = key.values.iter().map(|x| 3.0 * x).collect();
        let effect = marginal(&key, &values);
        assert_eq!(effect.len(), INTERVALS);
        assert!(
            effect
                .iter()
                .all(|[x, mean, deviation]| (mean - 3.0 * x).abs() < 5e-3
                    && (deviation - 3.0 / 16.0 / 12.0_f64.sqrt()).abs() < 1e-2)
        );
        let listed = Coordinate { words: vec!["x".to_owned(), "y".to_owned()], values: vec![0.0, 1.0, 1.0], ..key };
        assert_eq!(marginal(&listed, &[5.0, 1.0, 3.0]), [[0.0, 5.0, 0.0], [1.0, 2.0, 1.0]]);
    }

    #[test]
    fn regress_the_mean_of_a_grid_stands_at_its_values() {
        let key = coordinate("a", vec![4.0, 5.0, 8.0, 4.0, 5.0, 8.0], false);
        assert_eq!(marginal(&key, &[1.0, 2.0, 7.0, 3.0, 2.0, 9.0]), [[4.0, 2.0, 1.0], [5.0, 2.0, 0.0], [8.0, 8.0, 1.0]]);
    }

    #[test]
    fn prop_every_run_is_a_line_with_a_gap_after_it() {
        let keys = vec![coordinate("a", (0..40).map(f64::from).collect(), false), coordinate("b", vec![2.0; 40], true)];
        let scalars = vec![coordinate("y", (0..40).rev().map(f64::from).collect(), false)];
        let points = Points { keys, scalars, ..Points::default() };
        let figure = parallel(&points, 0);
        let series = &figure.panels[0].series;
        assert_eq!(series.iter().map(|series| series.xs.len()).collect::<Vec<_>>(), [40; 4]);
        assert!(series[0].ys[..3] == [1.0, 0.0, 0.0] && series[0].ys[3].is_nan() && figure.x.names == ["a", "b", "scalar"]);
    }

    #[test]
    fn regress_quarters_differ_by_at_most_one_run_and_the_greatest_is_in_the_highest() {
        for (count, sizes) in [
            (0, [0, 0, 0, 0]),
            (1, [1, 0, 0, 0]),
            (2, [1, 0, 0, 1]),
            (3, [1, 1, 0, 1]),
            (4, [1, 1, 1, 1]),
            (5, [2, 1, 1, 1]),
            (6, [2, 1, 2, 1]),
            (14, [4, 3, 4, 3]),
        ] {
            let values: Vec<f64> = (0..count).map(f64::from).collect();
            let quarters = by_size(&values, places(values.len(), MOST_LINES));
            assert_eq!(quarters.each_ref().map(Vec::len), sizes, "{count} runs");
            assert!(quarters.concat().is_sorted(), "{count} runs: {quarters:?}");
            let points = Points { keys: Vec::new(), scalars: vec![coordinate("y", values, false)], ..Points::default() };
            let figure = parallel(&points, 0);
            let greatest = figure.panels[0].series.last().map(|series| series.label.as_str());
            assert!(count < 2 || greatest == Some("highest quarter"), "{count} runs: {greatest:?}");
        }
    }

    /// Left and right ends of the names under a figure's frame, px, from the left.
    fn ends_of_names(figure: &Figure) -> Vec<[f64; 2]> {
        let svg = figure.to_svg();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let ends = document.descendants().filter(|node| node.has_tag_name("text")).filter_map(|node| {
            let name = figure.x.names.iter().find(|name| node.text() == Some(name.as_str()))?;
            let number = |attribute: &str| node.attribute(attribute).unwrap().parse::<f64>().unwrap();
            let (x, half) = (number("x"), text_width(name, number("font-size")) / 2.0);
            Some([x - half, x + half])
        });
        ends.collect()
    }

    #[test]
    fn regress_long_names_lie_on_the_sheet_and_clear_of_one_another() {
        let (common, long, longest) = ("rod.section.height_m", "slider.friction_n_s_per_m", "a name for a sentence ".repeat(9));
        let values: Vec<f64> = (0..8).map(|row| f64::from(row % 2)).collect();
        let key = |name: &str| coordinate(name, values.clone(), false);
        for (names, shown) in [
            (vec![common], 2),
            (vec![common; 3], 4),
            (vec![long; 2], 3),
            (vec![long; 3], 4),
            (vec![long; 12], 4),
            (vec![longest.trim(); 2], 1),
        ] {
            let keys = names.iter().map(|name| key(name)).collect();
            let places = Points { keys, scalars: vec![key("y")], ..Points::default() };
            let words = names.iter().map(|name| (*name).to_owned()).collect();
            let rows: Vec<f64> = (0_u32..).take(names.len()).map(f64::from).collect();
            let listed = Coordinate { words, ..coordinate("key", rows.clone(), false) };
            let listed = Points { keys: vec![listed], scalars: vec![coordinate("y", rows, false)], ..Points::default() };
            let drawn = ends_of_names(&parallel(&places, 0));
            assert_eq!(drawn.len(), shown, "{names:?}");
            for ends in [drawn, ends_of_names(&over_key(&listed, 0, 0))] {
                assert!(ends.iter().all(|[left, right]| *left >= 0.0 && *right <= sheet::WIDTH), "{names:?}: {ends:?}");
                assert!(ends.windows(2).all(|pair| pair[0][1] < pair[1][0]), "{names:?}: {ends:?}");
            }
        }
    }
}
