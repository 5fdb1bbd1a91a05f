//! ROS 2 message types: one table, from which the CDR layout, the `ros2msg` schema and the type hash follow.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// Full names, and fields as in `.msg` files without comments, constants and default values. The types of services are those that
/// ROS derives from a `.srv` file.
const DEFINITIONS: &[(&str, &str)] = &[
    ("builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec\n"),
    ("builtin_interfaces/msg/Duration", "int32 sec\nuint32 nanosec\n"),
    ("std_msgs/msg/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
    ("std_msgs/msg/Float64", "float64 data\n"),
    ("std_msgs/msg/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"),
    ("rosgraph_msgs/msg/Clock", "builtin_interfaces/Time clock\n"),
    ("geometry_msgs/msg/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/msg/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"),
    ("geometry_msgs/msg/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"),
    ("geometry_msgs/msg/Wrench", "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"),
    ("geometry_msgs/msg/WrenchStamped", "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n"),
    ("geometry_msgs/msg/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
    ("geometry_msgs/msg/TransformStamped", "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"),
    ("tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"),
    (
        "sensor_msgs/msg/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    ),
    ("sensor_msgs/msg/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"),
    ("diagnostic_msgs/msg/KeyValue", "string key\nstring value\n"),
    (
        "diagnostic_msgs/msg/DiagnosticStatus",
        "byte level\nstring name\nstring message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n",
    ),
    ("diagnostic_msgs/msg/DiagnosticArray", "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"),
    ("visualization_msgs/msg/UVCoordinate", "float32 u\nfloat32 v\n"),
    ("visualization_msgs/msg/MeshFile", "string filename\nuint8[] data\n"),
    (
        "visualization_msgs/msg/Marker",
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n\
         geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\nbool frame_locked\n\
         geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n\
         sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n\
         string mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n",
    ),
    ("visualization_msgs/msg/MarkerArray", "visualization_msgs/Marker[] markers\n"),
    (
        "service_msgs/msg/ServiceEventInfo",
        "uint8 event_type\nbuiltin_interfaces/Time stamp\nchar[16] client_gid\nint64 sequence_number\n",
    ),
    // A message without fields gets this one on the wire.
    ("std_srvs/srv/Trigger_Request", "uint8 structure_needs_at_least_one_member\n"),
    ("std_srvs/srv/Trigger_Response", "bool success\nstring message\n"),
    (
        "std_srvs/srv/Trigger_Event",
        "service_msgs/ServiceEventInfo info\nstd_srvs/srv/Trigger_Request[<=1] request\n\
         std_srvs/srv/Trigger_Response[<=1] response\n",
    ),
    (
        "std_srvs/srv/Trigger",
        "std_srvs/srv/Trigger_Request request_message\nstd_srvs/srv/Trigger_Response response_message\n\
         std_srvs/srv/Trigger_Event event_message\n",
    ),
    ("std_srvs/srv/SetBool_Request", "bool data\n"),
    ("std_srvs/srv/SetBool_Response", "bool success\nstring message\n"),
    (
        "std_srvs/srv/SetBool_Event",
        "service_msgs/ServiceEventInfo info\nstd_srvs/srv/SetBool_Request[<=1] request\n\
         std_srvs/srv/SetBool_Response[<=1] response\n",
    ),
    (
        "std_srvs/srv/SetBool",
        "std_srvs/srv/SetBool_Request request_message\nstd_srvs/srv/SetBool_Response response_message\n\
         std_srvs/srv/SetBool_Event event_message\n",
    ),
];

/// A type of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RosType(&'static str);

impl RosType {
    /// Positions, velocities and efforts of joints.
    pub const JOINT_STATE: RosType = RosType("sensor_msgs/msg/JointState");
    /// A force and a torque.
    pub const WRENCH_STAMPED: RosType = RosType("geometry_msgs/msg/WrenchStamped");
    /// Simulated time.
    pub const CLOCK: RosType = RosType("rosgraph_msgs/msg/Clock");
    /// State of a device, for monitors.
    pub const DIAGNOSTIC_ARRAY: RosType = RosType("diagnostic_msgs/msg/DiagnosticArray");
    /// Poses of coordinate frames.
    pub const TF_MESSAGE: RosType = RosType("tf2_msgs/msg/TFMessage");
    /// Shapes for RViz.
    pub const MARKER_ARRAY: RosType = RosType("visualization_msgs/msg/MarkerArray");
    /// A number.
    pub const FLOAT64: RosType = RosType("std_msgs/msg/Float64");
    /// A service without argument.
    pub const TRIGGER: RosType = RosType("std_srvs/srv/Trigger");
    /// The request of `Trigger`.
    pub const TRIGGER_REQUEST: RosType = RosType("std_srvs/srv/Trigger_Request");
    /// The response of `Trigger`.
    pub const TRIGGER_RESPONSE: RosType = RosType("std_srvs/srv/Trigger_Response");
    /// A service that switches something on or off.
    pub const SET_BOOL: RosType = RosType("std_srvs/srv/SetBool");
    /// The request of `SetBool`.
    pub const SET_BOOL_REQUEST: RosType = RosType("std_srvs/srv/SetBool_Request");
    /// The response of `SetBool`.
    pub const SET_BOOL_RESPONSE: RosType = RosType("std_srvs/srv/SetBool_Response");

    /// All types of the table.
    pub fn all() -> impl Iterator<Item = RosType> {
        DEFINITIONS.iter().map(|(name, _)| RosType(name))
    }

    /// The type of this full name.
    pub fn named(name: &str) -> Option<RosType> {
        LAYOUTS.get_key_value(name).map(|(name, _)| RosType(name))
    }

    /// Full name: `sensor_msgs/msg/JointState`.
    pub fn name(self) -> &'static str {
        self.0
    }

    /// Name in key expressions: `sensor_msgs::msg::dds_::JointState_`.
    pub fn dds_name(self) -> String {
        let (package, name) = self.0.rsplit_once('/').unwrap_or(("", self.0));
        format!("{}::dds_::{name}_", package.replace('/', "::"))
    }

    /// Fields in their order.
    pub fn fields(self) -> &'static [Field] {
        LAYOUTS.get(self.0).map_or(&[], Vec::as_slice)
    }

    /// Types of the fields, and of their fields, sorted by name.
    pub fn referenced(self) -> BTreeSet<RosType> {
        let mut found = BTreeSet::new();
        let mut open = vec![self];
        while let Some(next) = open.pop() {
            let nested = next.fields().iter().filter_map(|field| field.kind.nested());
            open.extend(nested.filter(|nested| found.insert(*nested)));
        }
        found
    }

    /// The schema of MCAP files, `ros2msg`: the definition, followed by those of the referenced types.
    pub fn schema(self) -> String {
        let definition = |wanted: RosType| DEFINITIONS.iter().find(|(name, _)| *name == wanted.0).map_or("", |(_, text)| text);
        let mut text = definition(self).to_owned();
        for referenced in self.referenced() {
            let (line, short) = ("=".repeat(80), referenced.0.replace("/msg/", "/"));
            text.push_str(&format!("{line}\nMSG: {short}\n{}", definition(referenced)));
        }
        text
    }
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Type of the field or of its elements.
    pub kind: Kind,
    /// Number of elements.
    pub count: Count,
}

/// Type of a field or element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `bool`.
    Bool,
    /// `byte`, `char` or `uint8`.
    U8 {
        /// The number of the type in type descriptions: 16 for `byte`, 3 for the others.
        id: u8,
    },
    /// `int32`.
    I32,
    /// `uint32`.
    U32,
    /// `int64`.
    I64,
    /// `float32`.
    F32,
    /// `float64`.
    F64,
    /// `string`.
    Text,
    /// Another type of the table.
    Nested(RosType),
}

impl Kind {
    fn of(word: &'static str) -> Option<Kind> {
        Some(match word {
            "bool" => Kind::Bool,
            "byte" => Kind::U8 { id: 16 },
            "uint8" | "char" => Kind::U8 { id: 3 },
            "int32" => Kind::I32,
            "uint32" => Kind::U32,
            "int64" => Kind::I64,
            "float32" => Kind::F32,
            "float64" => Kind::F64,
            "string" => Kind::Text,
            nested => {
                let is_it = |name: &str| name == nested || name.replace("/msg/", "/") == nested;
                Kind::Nested(DEFINITIONS.iter().find(|(name, _)| is_it(name)).map(|(name, _)| RosType(name))?)
            }
        })
    }

    /// Number of the type in type descriptions (REP 2016).
    pub(super) fn id(self) -> u8 {
        match self {
            Kind::Nested(_) => 1,
            Kind::U8 { id } => id,
            Kind::I32 => 6,
            Kind::U32 => 7,
            Kind::I64 => 8,
            Kind::F32 => 10,
            Kind::F64 => 11,
            Kind::Bool => 15,
            Kind::Text => 17,
        }
    }

    /// The nested type, if it is one.
    pub(super) fn nested(self) -> Option<RosType> {
        match self {
            Kind::Nested(nested) => Some(nested),
            _ => None,
        }
    }
}

/// Number of elements of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// A single value.
    One,
    /// An array of this length.
    Array(usize),
    /// A sequence of at most this length.
    AtMost(usize),
    /// A sequence of any length.
    Any,
}

impl Count {
    fn of(brackets: &str) -> Option<Count> {
        let inner = brackets.strip_suffix(']')?;
        Some(match inner.strip_prefix("<=") {
            Some(most) => Count::AtMost(most.parse().ok()?),
            None if inner.is_empty() => Count::Any,
            None => Count::Array(inner.parse().ok()?),
        })
    }
}

/// The fields of every type, by full name.
static LAYOUTS: LazyLock<BTreeMap<&'static str, Vec<Field>>> = LazyLock::new(|| {
    let fields = |text: &'static str| text.lines().filter_map(field).collect();
    DEFINITIONS.iter().map(|(name, text)| (*name, fields(text))).collect()
});

/// Reads a line of the table; `None` if it is not a field.
fn field(line: &'static str) -> Option<Field> {
    let (kind, name) = line.split_once(' ')?;
    let (kind, count) = match kind.split_once('[') {
        Some((kind, brackets)) => (kind, Count::of(brackets)?),
        None => (kind, Count::One),
    };
    Some(Field { name, kind: Kind::of(kind)?, count })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_line_of_the_table_is_a_field() {
        for (name, text) in DEFINITIONS {
            let fields = RosType::named(name).map_or(0, |it| it.fields().len());
            assert_eq!(fields, text.lines().count(), "{name}");
        }
    }

    #[test]
    fn val_names_are_those_of_ros() {
        assert_eq!(RosType::JOINT_STATE.dds_name(), "sensor_msgs::msg::dds_::JointState_");
        assert_eq!(RosType::TRIGGER.dds_name(), "std_srvs::srv::dds_::Trigger_");
        let line = "=".repeat(80);
        assert_eq!(
            RosType::CLOCK.schema(),
            format!("builtin_interfaces/Time clock\n{line}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n")
        );
    }
}
