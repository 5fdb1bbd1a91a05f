//! The trajectory of a reference: the positions of three points over time.

use crate::mechanics::{LinkObservation, Observation};

/// x and y of crank pin, middle of the rod and slider pin, m.
pub(super) type Points = [f64; 6];

/// Positions at equal intervals of time from t = 0.
#[derive(Debug, Default)]
pub(super) struct Trajectory {
    pub interval_s: f64,
    pub points: Vec<Points>,
}

impl Trajectory {
    /// Cubic through four samples, two on each side where they are; linear where there are fewer. `None` beyond the last. A line cuts the
    /// corner of a way that begins from rest: by 6 % of it, where it takes two samples.
    pub(super) fn at(&self, t_s: f64) -> Option<Points> {
        let place = t_s / self.interval_s;
        let (index, part) = (place as usize, place.fract());
        let before = self.points.get(index)?;
        let after = self.points.get(index + 1).or_else(|| (part < 1e-6).then_some(before))?;
        let first = index.saturating_sub(1).min(self.points.len().saturating_sub(4));
        let Some(near) = self.points.get(first..first + 4) else {
            return Some(std::array::from_fn(|k| before[k] + part * (after[k] - before[k])));
        };
        let x = place - first as f64;
        let weights = [
            -(x - 1.0) * (x - 2.0) * (x - 3.0) / 6.0,
            x * (x - 2.0) * (x - 3.0) / 2.0,
            -x * (x - 1.0) * (x - 3.0) / 2.0,
            x * (x - 1.0) * (x - 2.0) / 6.0,
        ];
        Some(std::array::from_fn(|k| near.iter().zip(weights).map(|(point, weight)| weight * point[k]).sum()))
    }
}

/// Positions of crank pin, middle of the rod (from the published nodes) and slider pin.
pub(super) fn points(seen: &Observation) -> Option<Points> {
    let [crank, rod] = seen.links.as_slice() else { return None };
    let (a, m, e) = (crank.nodes.last()?.position_m, middle(rod)?, rod.nodes.last()?.position_m);
    Some([a[0], a[1], m[0], m[1], e[0], e[1]])
}

fn middle(link: &LinkObservation) -> Option<[f64; 2]> {
    let intervals = link.nodes.len().checked_sub(1)?;
    let (low, high) = (link.nodes.get(intervals / 2)?.position_m, link.nodes.get(intervals.div_ceil(2))?.position_m);
    Some([0, 1].map(|k| 0.5 * (low[k] + high[k])))
}

/// Largest distance between the same points of two sets, m.
pub(super) fn distance_m(one: &Points, other: &Points) -> f64 {
    (0..3).map(|k| (one[2 * k] - other[2 * k]).hypot(one[2 * k + 1] - other[2 * k + 1])).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line between samples is off by 6 % of a way from rest that takes two of them.
    #[test]
    fn regress_between_samples_a_way_from_rest_is_a_parabola() {
        let way = |t_s: f64| [3.0 * t_s * t_s; 6];
        let trajectory = Trajectory { interval_s: 0.1, points: (0..6).map(|n| way(0.1 * f64::from(n))).collect() };
        for t_s in [0.0, 0.04, 0.1, 0.13, 0.38, 0.44, 0.5] {
            assert!(trajectory.at(t_s).is_some_and(|at| (at[0] - way(t_s)[0]).abs() < 1e-14), "{t_s}");
        }
        assert!(trajectory.at(0.56).is_none());
        let short = Trajectory { interval_s: 0.1, points: vec![way(0.0), way(0.1)] };
        assert!(short.at(0.05).is_some_and(|at| (at[0] - 0.015).abs() < 1e-14));
    }
}
