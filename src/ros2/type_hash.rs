//! Hashes of types (RIHS01): SHA-256 of the type description as JSON, as REP 2016 and `rosidl` define it.

use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

use super::types::{Count, Field, RosType};

impl RosType {
    /// The hash in key expressions: `RIHS01_` and 64 hexadecimal digits.
    pub fn hash(self) -> String {
        let referenced: Vec<String> = self.referenced().into_iter().map(description).collect();
        let json = format!(
            r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
            description(self),
            referenced.join(", ")
        );
        let mut hash = "RIHS01_".to_owned();
        for byte in Sha256::digest(json.as_bytes()) {
            // Writing to a string cannot fail.
            let _ = write!(hash, "{byte:02x}");
        }
        hash
    }
}

fn description(of: RosType) -> String {
    let fields: Vec<String> = of.fields().iter().map(field).collect();
    format!(r#"{{"type_name": "{}", "fields": [{}]}}"#, of.name(), fields.join(", "))
}

fn field(Field { name, kind, count }: &Field) -> String {
    let (list, capacity) = match count {
        Count::One => (0, 0),
        Count::Array(length) => (48, *length),
        Count::AtMost(most) => (96, *most),
        Count::Any => (144, 0),
    };
    let nested = kind.nested().map_or("", RosType::name);
    format!(
        r#"{{"name": "{name}", "type": {{"type_id": {}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{nested}"}}}}"#,
        kind.id() + list
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Messages as `rosbags` computes them; services as programs of ROS 2 Jazzy have them.
    #[test]
    fn val_hashes_are_those_of_ros_2() {
        for (it, hash) in [
            (RosType::JOINT_STATE, "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"),
            (RosType::MARKER_ARRAY, "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"),
            (RosType::DIAGNOSTIC_ARRAY, "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"),
            (RosType::FLOAT64, "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a"),
            (RosType::SET_BOOL, "RIHS01_abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a"),
            (RosType::SET_BOOL_RESPONSE, "RIHS01_d0814e7f7b4880ab77e9c57426c7aa1562ab69f11eef8e2e968812f9cbd0b059"),
            (RosType::TRIGGER, "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"),
        ] {
            assert_eq!(it.hash(), hash, "{}", it.name());
        }
    }
}
