//! The Pareto front: what nothing else beats in both cost and error.

/// Marks the Pareto front: `(cost, error)` points that no other point equals in both and beats in one. Points that are not finite
/// are never on it.
pub fn front(points: &[[f64; 2]]) -> Vec<bool> {
    let beaten = |[cost, error]: &[f64; 2]| points.iter().any(|[c, e]| c <= cost && e <= error && (c < cost || e < error));
    points.iter().map(|point| point.iter().all(|x| x.is_finite()) && !beaten(point)).collect()
}

#[cfg(test)]
mod tests {
    use super::front;

    #[test]
    fn val_front_is_what_nothing_beats() {
        let points = [[1.0, 1.0], [2.0, 0.5], [2.0, 0.7], [3.0, 0.5], [4.0, 0.1], [0.5, f64::INFINITY]];
        assert_eq!(front(&points), [true, true, false, false, true, false]);
    }
}
