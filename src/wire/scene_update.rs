//! Scene updates: the mechanism as 3D shapes, for viewers that support `foxglove.SceneUpdate`.

use super::foxglove::{
    Color, CubePrimitive, LinePrimitive, Point3, Pose, Quaternion, SceneEntity, SceneUpdate, SpherePrimitive, Vector3,
    line_primitive,
};
use super::{Displacements, NodeState, bent_line, by_link};

/// Coordinate frame of all shapes: the origin is the pivot, the mechanism moves in the x-y plane.
const FRAME: &str = "flexcrank";
/// Colours of the links, from the pivot outwards.
const LINKS: [[f64; 3]; 3] = [[0.10, 0.55, 0.85], [0.95, 0.60, 0.10], [0.25, 0.70, 0.35]];
const GREY: [f64; 3] = [0.6, 0.6, 0.6];
/// Thickness of a link, pixels.
const THICKNESS: f64 = 4.0;
/// Diameter of a pin, relative to the longest link.
const PIN: f64 = 0.03;
/// Nanoseconds per second.
const NANOSECONDS: u64 = 1_000_000_000;

/// Draws links as bent lines, true to scale, and pins, slider and masses as small shapes. `time_ns` is the viewer's playback
/// time, since 1970.
pub fn scene_update(state: &Displacements, has_slider: bool, time_ns: u64) -> SceneUpdate {
    let seconds = i64::try_from(time_ns / NANOSECONDS).unwrap_or(i64::MAX);
    let nanos = i32::try_from(time_ns % NANOSECONDS).unwrap_or(0);
    let mut entity = SceneEntity {
        timestamp: Some(prost_types::Timestamp { seconds, nanos }),
        frame_id: FRAME.to_owned(),
        id: "mechanism".to_owned(),
        ..SceneEntity::default()
    };
    let size = PIN * longest(&state.nodes);
    if state.nodes.first().is_some_and(|node| node.link == "mass") {
        entity.cubes = state.nodes.iter().zip(LINKS.into_iter().cycle()).map(|(node, rgb)| cube(node, size, rgb)).collect();
    } else {
        entity.lines = by_link(&state.nodes).zip(LINKS.into_iter().cycle()).map(|(link, rgb)| line(link, rgb)).collect();
        let pins = by_link(&state.nodes).filter_map(<[NodeState]>::first);
        entity.spheres = pins.map(|pin| sphere(pin, size)).collect();
        entity.cubes = state.nodes.last().filter(|_| has_slider).map(|end| cube(end, 2.0 * size, GREY)).into_iter().collect();
    }
    SceneUpdate { deletions: Vec::new(), entities: vec![entity] }
}

/// Length of the longest link, or for masses their distance from the origin.
fn longest(nodes: &[NodeState]) -> f64 {
    let length = |link: &[NodeState]| match link {
        [first, .., last] if first.link != "mass" => (last.x_m - first.x_m).hypot(last.y_m - first.y_m),
        all => all.iter().map(|node| node.x_m.abs()).fold(0.0, f64::max),
    };
    by_link(nodes).map(length).fold(0.0, f64::max)
}

fn line(link: &[NodeState], rgb: [f64; 3]) -> LinePrimitive {
    LinePrimitive {
        r#type: line_primitive::Type::LineStrip.into(),
        pose: pose([0.0, 0.0]),
        thickness: THICKNESS,
        scale_invariant: true,
        points: bent_line(link, 1.0).into_iter().map(|[x, y]| Point3 { x, y, z: 0.0 }).collect(),
        color: color(rgb),
        colors: Vec::new(),
        indices: Vec::new(),
    }
}

fn sphere(at: &NodeState, size: f64) -> SpherePrimitive {
    SpherePrimitive { pose: pose([at.x_m, at.y_m]), size: cubic(size), color: color(GREY) }
}

fn cube(at: &NodeState, size: f64, rgb: [f64; 3]) -> CubePrimitive {
    CubePrimitive { pose: pose([at.x_m, at.y_m]), size: cubic(size), color: color(rgb) }
}

fn pose([x, y]: [f64; 2]) -> Option<Pose> {
    let orientation = Some(Quaternion { w: 1.0, ..Quaternion::default() });
    Some(Pose { position: Some(Vector3 { x, y, z: 0.0 }), orientation })
}

fn cubic(size: f64) -> Option<Vector3> {
    Some(Vector3 { x: size, y: size, z: size })
}

fn color([r, g, b]: [f64; 3]) -> Option<Color> {
    Some(Color { r, g, b, a: 1.0 })
}
