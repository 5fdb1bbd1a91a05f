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
    /// Linear between samples; `None` beyond the last.
    pub(super) fn at(&self, t_s: f64) -> Option<Points> {
        let place = t_s / self.interval_s;
        let (index, part) = (place as usize, place.fract());
        let before = self.points.get(index)?;
        let after = self.points.get(index + 1).or_else(|| (part < 1e-6).then_some(before))?;
        Some(std::array::from_fn(|k| before[k] + part * (after[k] - before[k])))
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
