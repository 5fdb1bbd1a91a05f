//! Markers: the mechanism as shapes for RViz, the same as those of scene updates.

use super::cdr::{Value, message};
use crate::wire::foxglove::{Color, Point3, Pose, Vector3};
use crate::wire::{Displacements, scene_update};

/// Numbers of shapes in `visualization_msgs/Marker`.
const CUBE: i32 = 1;
const SPHERE: i32 = 2;
const LINE_STRIP: i32 = 4;
/// Width of a line, relative to a pin.
const LINE: f64 = 0.4;
/// Width of a line without pins, m.
const LINE_ALONE_M: f64 = 0.01;

/// A `visualization_msgs/MarkerArray` of the mechanism. Every message replaces the one before.
pub(super) fn markers(state: &Displacements, has_slider: bool, header: &Value) -> Value {
    let mut shapes = Vec::new();
    for entity in scene_update(state, has_slider, 0).entities {
        let pin = entity.spheres.first().and_then(|pin| pin.size);
        let width = pin.map_or(LINE_ALONE_M, |size| LINE * size.x);
        for line in entity.lines {
            let size = Vector3 { x: width, y: 0.0, z: 0.0 };
            shapes.push(Shape { kind: LINE_STRIP, pose: line.pose, size: Some(size), color: line.color, points: line.points });
        }
        for sphere in entity.spheres {
            let (pose, size, color) = (sphere.pose, sphere.size, sphere.color);
            shapes.push(Shape { kind: SPHERE, pose, size, color, points: Vec::new() });
        }
        for cube in entity.cubes {
            let (pose, size, color) = (cube.pose, cube.size, cube.color);
            shapes.push(Shape { kind: CUBE, pose, size, color, points: Vec::new() });
        }
    }
    let all: Value = (0..).zip(shapes).map(|(id, shape)| shape.marker(id, header)).collect();
    message![all]
}

/// A shape of the mechanism.
struct Shape {
    kind: i32,
    pose: Option<Pose>,
    size: Option<Vector3>,
    color: Option<Color>,
    points: Vec<Point3>,
}

impl Shape {
    fn marker(self, id: i32, header: &Value) -> Value {
        let position = self.pose.and_then(|pose| pose.position).unwrap_or_default();
        let pose = message![vector([position.x, position.y]), message![0.0, 0.0, 0.0, 1.0]];
        let size = self.size.unwrap_or_default();
        let color = self.color.unwrap_or_default();
        let color = Value::Message([color.r, color.g, color.b, color.a].map(|part| Value::F32(part as f32)).to_vec());
        let points: Value = self.points.iter().map(|point| vector([point.x, point.y])).collect();
        let nothing = || Value::List(Vec::new());
        let texture = message![message![message![0, 0_u32], ""], "", nothing()];
        message![
            header.clone(),
            "mechanism",
            id,
            self.kind,
            // Adds the marker, or replaces the one with its id.
            0,
            pose,
            message![size.x, size.y, size.z],
            color,
            // It stays until the next.
            message![0, 0_u32],
            false,
            points,
            nothing(),
            "",
            texture,
            nothing(),
            "",
            "",
            message!["", nothing()],
            false,
        ]
    }
}

/// A point or vector in the plane of the mechanism.
pub(super) fn vector([x, y]: [f64; 2]) -> Value {
    message![x, y, 0.0]
}
