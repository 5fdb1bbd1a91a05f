//! Levels among measured settings: from the best to the cheapest, each worth its switch, evenly spread in the logarithm of cost.

use super::front::front;
use crate::simulation::StepGrid;

/// A setting that may become a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub cost: f64,
    pub error: f64,
    pub step_s: f64,
}

/// Largest cost of a level over that of the level before, and largest error of a level over that of the next: a smaller gain is not
/// worth a switch.
const WORTH: f64 = 0.7;

/// Places of at most `count` points, the best first. It has the smallest error, and the last is the cheapest that a run can switch to.
///
/// A run changes its step only by whole factors, so the steps of all levels divide one another. Of the settings with such steps, all
/// levels are on the front. More levels are better, then a cheaper last one, then an even spread.
pub(super) fn pick_levels(points: &[Point], count: usize) -> Vec<usize> {
    let by_error = |a: &Point, b: &Point| a.error.total_cmp(&b.error).then(a.cost.total_cmp(&b.cost));
    let Some((first, best)) = points.iter().enumerate().min_by(|a, b| by_error(a.1, b.1)) else { return Vec::new() };
    let mut steps_s: Vec<f64> = points.iter().map(|point| point.step_s).filter(|step_s| fit(*step_s, best.step_s)).collect();
    steps_s.sort_by(|a, b| b.total_cmp(a));
    steps_s.dedup();
    let mut search = Search { points, count, best: vec![first] };
    for chain in chains(&steps_s, None) {
        let levels = descending(points, &chain, best.cost);
        search.extend(&mut vec![first], &levels);
    }
    search.best
}

/// The front of the settings with these steps that are worth a switch from the first, the dearest first.
fn descending(points: &[Point], steps_s: &[f64], first_cost: f64) -> Vec<usize> {
    let worth = |point: &Point| point.cost <= WORTH * first_cost && steps_s.contains(&point.step_s);
    let places: Vec<usize> = (0..points.len()).filter(|place| worth(&points[*place])).collect();
    let on_front = front(&places.iter().map(|place| [points[*place].cost, points[*place].error]).collect::<Vec<_>>());
    let mut levels: Vec<usize> =
        places.into_iter().zip(on_front).filter(|(_, on_front)| *on_front).map(|(place, _)| place).collect();
    levels.sort_by(|a, b| points[*b].cost.total_cmp(&points[*a].cost));
    levels
}

/// Whether a run can switch between two steps: one is a whole multiple of the other.
fn fit(one_s: f64, other_s: f64) -> bool {
    StepGrid::new(one_s).steps_to_common(0, other_s).is_some()
}

/// Longest lists of steps, descending, each a part of the one before; all of them below `last`.
fn chains(steps_s: &[f64], last: Option<f64>) -> Vec<Vec<f64>> {
    let is_below = |step_s: &f64, above: f64| *step_s < above && fit(*step_s, above);
    let below: Vec<f64> = steps_s.iter().copied().filter(|step_s| last.is_none_or(|last| is_below(step_s, last))).collect();
    if below.is_empty() {
        return vec![Vec::new()];
    }
    let next = below.iter().filter(|step_s| !below.iter().any(|between| is_below(step_s, *between)));
    next.flat_map(|next| chains(steps_s, Some(*next)).into_iter().map(|rest| [vec![*next], rest].concat())).collect()
}

/// The best levels so far, among all that end with the cheapest level.
struct Search<'a> {
    points: &'a [Point],
    count: usize,
    best: Vec<usize>,
}

impl Search<'_> {
    /// Tries every list that begins with `ladder` and goes on with some of `levels`, up to the last of them.
    fn extend(&mut self, ladder: &mut Vec<usize>, levels: &[usize]) {
        let Some((cheapest, between)) = levels.split_last() else { return };
        if self.is_worth(ladder, *cheapest) {
            ladder.push(*cheapest);
            if self.is_better(ladder) {
                self.best.clone_from(ladder);
            }
            ladder.pop();
        }
        if ladder.len() + 1 < self.count {
            for (place, next) in between.iter().enumerate() {
                if self.is_worth(ladder, *next) {
                    ladder.push(*next);
                    self.extend(ladder, &levels[place + 1..]);
                    ladder.pop();
                }
            }
        }
    }

    fn is_worth(&self, ladder: &[usize], next: usize) -> bool {
        let next = &self.points[next];
        ladder
            .last()
            .map(|last| &self.points[*last])
            .is_some_and(|last| next.cost <= WORTH * last.cost && last.error <= WORTH * next.error)
    }

    fn is_better(&self, ladder: &[usize]) -> bool {
        let last = |ladder: &[usize]| ladder.last().map_or(f64::INFINITY, |last| self.points[*last].cost);
        let longer = ladder.len().cmp(&self.best.len());
        let cheaper = last(&self.best).total_cmp(&last(ladder));
        let more_even = self.unevenness(&self.best).total_cmp(&self.unevenness(ladder));
        longer.then(cheaper).then(more_even).is_gt()
    }

    /// Sum of the squares of `ln(cost/next cost)`: between given ends it is least where all are equal.
    fn unevenness(&self, ladder: &[usize]) -> f64 {
        ladder.windows(2).map(|pair| (self.points[pair[0]].cost / self.points[pair[1]].cost).ln().powi(2)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of `[cost, error, step in ms]`.
    fn levels(points: &[[f64; 3]], count: usize) -> Vec<usize> {
        let point = |[cost, error, step_ms]: &[f64; 3]| Point { cost: *cost, error: *error, step_s: 1e-3 * step_ms };
        pick_levels(&points.iter().map(point).collect::<Vec<_>>(), count)
    }

    #[test]
    fn prop_levels_spread_evenly_from_the_best_to_the_cheapest() {
        let costs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
        let points = costs.map(|cost| [cost, 1.0 / cost, 1.0]);
        assert_eq!(levels(&points, 2), [6, 0]);
        assert_eq!(levels(&points, 3), [6, 3, 0]);
        assert_eq!(levels(&points, 4), [6, 4, 2, 0]);
        assert_eq!(levels(&points, 7), [6, 5, 4, 3, 2, 1, 0]);
    }

    #[test]
    fn prop_levels_are_fewer_where_others_are_not_worth_it() {
        assert_eq!(levels(&[], 4), [0; 0]);
        assert_eq!(levels(&[[1.0, 1.0, 1.0]], 4), [0]);
        assert_eq!(levels(&[[1.0, 0.1, 1.0], [0.71, 1.0, 1.0]], 4), [0], "a gain of less than 0.3");
        assert_eq!(levels(&[[1.0, 0.1, 1.0], [0.8, 0.2, 1.0], [0.5, 0.3, 1.0], [0.4, 0.4, 1.0]], 4), [0, 3]);
        assert_eq!(levels(&[[8.0, 0.1, 1.0], [4.0, 0.5, 1.0], [3.0, 0.4, 1.0], [1.0, 1.0, 1.0]], 4), [0, 2, 3], "off the front");
    }

    #[test]
    fn regress_a_level_hardly_better_than_a_much_cheaper_one_is_left_out() {
        assert_eq!(levels(&[[64.0, 0.01, 1.0], [24.0, 0.14, 1.0], [4.0, 0.15, 1.0], [1.0, 1.0, 1.0]], 4), [0, 2, 3]);
    }

    #[test]
    fn prop_steps_of_levels_divide_one_another() {
        let points = [[64.0, 0.01, 1.0], [16.0, 0.1, 2.0], [8.0, 0.2, 5.0], [4.0, 0.3, 2.0], [1.0, 1.0, 10.0]];
        assert_eq!(levels(&points, 4), [0, 1, 3, 4], "5 ms is no multiple of 2 ms");
        let points = [[64.0, 0.01, 2.0], [16.0, 0.1, 4.0], [1.0, 1.0, 5.0]];
        assert_eq!(levels(&points, 4), [0, 1], "the cheapest cannot be reached from the best");
        // Beaten by a setting whose step does not fit.
        let points = [[64.0, 0.01, 1.0], [8.0, 0.1, 5.0], [9.0, 0.2, 2.0], [4.0, 0.3, 4.0], [1.0, 1.0, 8.0]];
        assert_eq!(levels(&points, 4), [0, 2, 3, 4]);
    }

    #[test]
    fn val_chains_of_steps() {
        assert_eq!(chains(&[10.0, 5.0, 2.0, 1.0], None), [vec![10.0, 5.0, 1.0], vec![10.0, 2.0, 1.0]]);
        assert_eq!(chains(&[3.0, 2.0], None), [vec![3.0], vec![2.0]]);
    }
}
