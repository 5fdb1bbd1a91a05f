//! The bent line of a link, from the published state of its nodes.

use std::f64::consts::{PI, TAU};

use super::NodeState;

/// Number of pieces drawn between two nodes with known tangents.
const PIECES: u32 = 8;
/// Tangents steeper than this against the chord are not drawn as a curve, rad.
const STEEPEST_RAD: f64 = 1.3;

/// Groups nodes by link, from the pivot outwards.
pub fn by_link(nodes: &[NodeState]) -> impl Iterator<Item = &[NodeState]> {
    nodes.chunk_by(|one, next| one.link == next.link)
}

/// Returns a link's line from its first node to its last, with its offsets from the chord magnified.
///
/// Between nodes with known rotations the line is the cubic with their tangents; otherwise it is straight.
pub fn bent_line(nodes: &[NodeState], magnification: f64) -> Vec<[f64; 2]> {
    let Some(chord) = Chord::of(nodes) else {
        return nodes.iter().map(|node| [node.x_m, node.y_m]).collect();
    };
    chord.line(nodes).into_iter().map(|[along, off]| chord.place(along, magnification * off)).collect()
}

/// A link's largest offset from its chord, relative to its length; 0 without a chord.
pub fn bending(nodes: &[NodeState]) -> f64 {
    let Some(chord) = Chord::of(nodes) else { return 0.0 };
    chord.line(nodes).iter().fold(0.0, |most: f64, [_, off]| most.max(off.abs())) / chord.length_m
}

/// The straight line from a link's first node to its last.
struct Chord {
    start_m: [f64; 2],
    direction: [f64; 2],
    length_m: f64,
}

impl Chord {
    fn of(nodes: &[NodeState]) -> Option<Self> {
        let (first, last) = (nodes.first()?, nodes.last()?);
        let (x, y) = (last.x_m - first.x_m, last.y_m - first.y_m);
        let length_m = x.hypot(y);
        let usable = length_m.is_finite() && length_m > 0.0;
        usable.then(|| Chord { start_m: [first.x_m, first.y_m], direction: [x / length_m, y / length_m], length_m })
    }

    fn place(&self, along: f64, off: f64) -> [f64; 2] {
        let ([x, y], [c, s]) = (self.start_m, self.direction);
        [x + c * along - s * off, y + s * along + c * off]
    }

    /// Returns distance along the chord, offset from it, and slope against it.
    fn local(&self, node: &NodeState) -> (f64, f64, Option<f64>) {
        let ([c, s], [x, y]) = (self.direction, [node.x_m - self.start_m[0], node.y_m - self.start_m[1]]);
        let turned = node.rotation_rad.map(|angle| (angle - s.atan2(c) + PI).rem_euclid(TAU) - PI);
        (c * x + s * y, c * y - s * x, turned.filter(|angle| angle.abs() < STEEPEST_RAD).map(f64::tan))
    }

    /// Returns distances along the chord and offsets from it.
    fn line(&self, nodes: &[NodeState]) -> Vec<[f64; 2]> {
        let mut line: Vec<[f64; 2]> = Vec::with_capacity(nodes.len() * PIECES as usize);
        let mut before: Option<(f64, f64, Option<f64>)> = None;
        for node in nodes {
            let (along, off, slope) = self.local(node);
            if let (Some((along_before, off_before, Some(from))), Some(to)) = (before, slope) {
                let length = along - along_before;
                for piece in 1..PIECES {
                    let s = f64::from(piece) / f64::from(PIECES);
                    line.push([along_before + s * length, cubic(s, [off_before, length * from], [off, length * to])]);
                }
            }
            line.push([along, off]);
            before = Some((along, off, slope));
        }
        line
    }
}

/// The cubic over 0 to 1 with these values and slopes at its ends (Hermite).
fn cubic(s: f64, [v0, t0]: [f64; 2], [v1, t1]: [f64; 2]) -> f64 {
    let (rest, square) = (1.0 - s, s * s);
    v0 * rest * rest * (1.0 + 2.0 * s) + t0 * s * rest * rest + v1 * square * (3.0 - 2.0 * s) - t1 * square * rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(x_m: f64, y_m: f64, rotation_rad: Option<f64>) -> NodeState {
        NodeState { link: "beam".to_owned(), x_m, y_m, rotation_rad, ..NodeState::default() }
    }

    /// A shallow parabola over a chord of length 2 at an angle, whose cubic is exact: offset = sag (1 − (s − 1)²).
    fn parabola(angle: f64, sag: f64) -> Vec<NodeState> {
        let (s, c) = angle.sin_cos();
        let at = |along: f64| {
            let (off, slope) = (sag * (1.0 - (along - 1.0).powi(2)), -2.0 * sag * (along - 1.0));
            node(c * along - s * off, s * along + c * off, Some(angle + slope.atan()))
        };
        vec![at(0.0), at(2.0)]
    }

    #[test]
    fn val_two_nodes_and_their_tangents_give_the_parabola_between_them() {
        for angle in [0.0, 0.7, 3.1, -2.0, 40.0] {
            let nodes = parabola(angle, 0.05);
            assert!((bending(&nodes) - 0.025).abs() < 1e-12, "{}", bending(&nodes));
            let middle = bent_line(&nodes, 10.0)[PIECES as usize / 2];
            let (s, c) = angle.sin_cos();
            let expected = [c - 0.5 * s, s + 0.5 * c];
            assert!((0..2).all(|k| (middle[k] - expected[k]).abs() < 1e-12), "{middle:?}");
        }
    }

    #[test]
    fn prop_ends_stay_where_they_are_and_rigid_links_straight() {
        let nodes = parabola(1.0, 0.1);
        let line = bent_line(&nodes, 1e3);
        for (node, place) in [(&nodes[0], line[0]), (&nodes[1], line[line.len() - 1])] {
            assert!((node.x_m - place[0]).hypot(node.y_m - place[1]) < 1e-12);
        }
        assert_eq!(bent_line(&[node(0.0, 0.0, None), node(3.0, 4.0, None)], 1e3).len(), 2);
        assert!(bending(&[node(0.0, 0.0, Some(0.5)), node(0.0, 0.0, Some(0.5))]) == 0.0, "no chord");
        assert!(bent_line(&[], 1.0).is_empty());
    }

    #[test]
    fn prop_nodes_are_grouped_by_link() {
        let mut nodes = parabola(0.0, 0.1);
        nodes.push(NodeState { link: "rod".to_owned(), ..NodeState::default() });
        assert_eq!(by_link(&nodes).map(<[NodeState]>::len).collect::<Vec<_>>(), [2, 1]);
    }
}
