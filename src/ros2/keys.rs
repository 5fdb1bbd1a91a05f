//! Names of nodes, key expressions, liveliness tokens and attachments, as `rmw_zenoh` defines them.

use sha2::{Digest as _, Sha256};

use super::types::RosType;
use crate::bus::Name;

/// Largest domain that ROS 2 permits.
pub const LARGEST_DOMAIN: u8 = 232;

/// A service's name as ROS permits it: letters, digits and underscores, not beginning with a digit.
pub fn node_name(name: &Name) -> String {
    let plain: String = name.to_string().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if plain.starts_with(|c: char| c.is_ascii_digit()) { format!("service_{plain}") } else { plain }
}

/// Key of a topic or service: `0/crank/joint_states/sensor_msgs::msg::dds_::JointState_/RIHS01_…`.
pub(super) fn topic_key(domain: u8, topic: &str, of: RosType) -> String {
    format!("{domain}/{}/{}/{}", topic.trim_start_matches('/'), of.dds_name(), of.hash())
}

/// Kinds of the things that a node declares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Endpoint {
    Publisher,
    Subscription,
    Service,
}

impl Endpoint {
    fn code(self) -> &'static str {
        match self {
            Endpoint::Publisher => "MP",
            Endpoint::Subscription => "MS",
            Endpoint::Service => "SS",
        }
    }
}

/// The node in the ROS graph, from which the keys of its liveliness tokens follow.
#[derive(Debug, Clone)]
pub(super) struct NodeKeys {
    pub domain: u8,
    /// Id of the zenoh session.
    pub session: String,
    /// Number of the node in the session.
    pub number: usize,
    /// Name of the node; its namespace is `/`.
    pub name: String,
}

impl NodeKeys {
    /// Key of the node's token. `%` stands for `/`: the default enclave and namespace.
    pub(super) fn node(&self) -> String {
        let NodeKeys { domain, session, number, name } = self;
        format!("@ros2_lv/{domain}/{session}/{number}/{number}/NN/%/%/{name}")
    }

    /// Key of the token of a publisher, subscription or service: reliable, volatile, keep last `depth`. Defaults are left out.
    pub(super) fn endpoint(&self, kind: Endpoint, id: usize, (topic, of): (&str, RosType), depth: usize) -> String {
        let NodeKeys { domain, session, number, name } = self;
        let (kind, topic) = (kind.code(), topic.replace('/', "%"));
        let (dds_name, hash) = (of.dds_name(), of.hash());
        format!("@ros2_lv/{domain}/{session}/{number}/{id}/{kind}/%/%/{name}/{topic}/{dds_name}/{hash}/::,{depth}:,:,:,,")
    }
}

/// Identifies a publisher or client: 16 bytes.
pub(super) type Gid = [u8; 16];

/// The identity of an endpoint, from the key of its token.
pub(super) fn gid(token_key: &str) -> Gid {
    let hash = Sha256::digest(token_key.as_bytes());
    let mut gid = Gid::default();
    gid.iter_mut().zip(hash).for_each(|(byte, of_hash)| *byte = of_hash);
    gid
}

/// Goes with every message: its number, its time, and the publisher.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Attachment {
    pub sequence: i64,
    /// Wall clock, ns since 1970.
    pub time_ns: i64,
    pub gid: Gid,
}

impl Attachment {
    /// Length in bytes.
    const LENGTH: usize = 33;

    pub(super) fn encode(&self) -> Vec<u8> {
        let gid_length = u8::try_from(self.gid.len()).unwrap_or(0);
        [&self.sequence.to_le_bytes()[..], &self.time_ns.to_le_bytes(), &[gid_length], &self.gid].concat()
    }

    /// Decodes an attachment; `None` if it is not one.
    pub(super) fn decode(bytes: &[u8]) -> Option<Self> {
        let number = |from: usize| bytes.get(from..)?.first_chunk().copied().map(i64::from_le_bytes);
        let gid: Gid = *bytes.get(17..)?.first_chunk()?;
        let fits = bytes.len() == Attachment::LENGTH && usize::from(bytes[16]) == gid.len();
        fits.then_some(Attachment { sequence: number(0)?, time_ns: number(8)?, gid })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_keys_are_those_of_rmw_zenoh() {
        let keys = NodeKeys { domain: 2, session: "aac3178e146ba6f1".to_owned(), number: 0, name: "talker".to_owned() };
        assert_eq!(keys.node(), "@ros2_lv/2/aac3178e146ba6f1/0/0/NN/%/%/talker");
        let token = keys.endpoint(Endpoint::Publisher, 10, ("/a/chatter", RosType::FLOAT64), 7);
        let start = "@ros2_lv/2/aac3178e146ba6f1/0/10/MP/%/%/talker/%a%chatter/std_msgs::msg::dds_::Float64_/RIHS01_";
        assert!(token.starts_with(start) && token.ends_with("/::,7:,:,:,,"), "{token}");
        assert!(
            topic_key(2, "/a/chatter", RosType::FLOAT64).starts_with("2/a/chatter/std_msgs::msg::dds_::Float64_/RIHS01_705b")
        );
    }

    #[test]
    fn prop_attachments_have_33_bytes_and_nothing_else_is_one() {
        let attachment = Attachment { sequence: 7, time_ns: -1, gid: gid("x") };
        let bytes = attachment.encode();
        assert_eq!((bytes.len(), Attachment::decode(&bytes)), (33, Some(attachment)));
        assert!((0..33).all(|length| Attachment::decode(&bytes[..length]).is_none()));
        assert_eq!(Attachment::decode(&[bytes.as_slice(), &[0]].concat()), None);
    }

    #[test]
    fn prop_node_names_are_permitted_by_ros() -> Result<(), crate::bus::BadName> {
        for (name, node) in [("crank", "crank"), ("crank-2", "crank_2"), ("7", "service_7"), ("größe", "gr__e")] {
            assert_eq!(node_name(&name.parse()?), node);
        }
        Ok(())
    }
}
