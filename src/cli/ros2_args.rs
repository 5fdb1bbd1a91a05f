//! The option `--ros2`: services as ROS 2 nodes.

use std::collections::BTreeSet;

use super::failure::{CommandResult, Failure};
use crate::bus::{BusError, Name, Session};
use crate::ros2::{LARGEST_DOMAIN, Node, NodeOptions, node_name};

/// Environment variable with the domain of all ROS programs.
const DOMAIN_VARIABLE: &str = "ROS_DOMAIN_ID";

#[derive(Debug, clap::Args)]
pub(super) struct Ros2Args {
    /// Also be a ROS 2 node for programs that use rmw_zenoh, in this domain (default: ROS_DOMAIN_ID, or 0). --connect
    /// tcp/localhost:7447 reaches their router. Guide: ros2.
    #[arg(long, value_name = "DOMAIN", num_args = 0..=1, require_equals = true, value_parser = domain)]
    pub ros2: Option<Option<u8>>,
}

/// A ROS domain.
fn domain(text: &str) -> Result<u8, String> {
    let domain = text.parse().ok().filter(|domain| *domain <= LARGEST_DOMAIN);
    domain.ok_or_else(|| format!("a whole number from 0 to {LARGEST_DOMAIN}"))
}

impl Ros2Args {
    /// The domain, if the option is given.
    pub(super) fn domain(&self) -> CommandResult<Option<u8>> {
        match (self.ros2, std::env::var(DOMAIN_VARIABLE)) {
            (None, _) => Ok(None),
            (Some(Some(domain)), _) => Ok(Some(domain)),
            (Some(None), Ok(text)) if !text.trim().is_empty() => {
                let bad = |wanted| Failure::Usage(format!("{DOMAIN_VARIABLE}={text}: must be {wanted}"));
                domain(text.trim()).map(Some).map_err(bad)
            }
            (Some(None), _) => Ok(Some(0)),
        }
    }
}

/// The nodes of a process.
#[derive(Default)]
pub(super) struct Nodes(Vec<Node>);

impl Nodes {
    /// Refuses services that would be the same node.
    pub(super) fn check<'a>(mut names: impl Iterator<Item = &'a Name>, domain: Option<u8>) -> CommandResult<()> {
        let mut taken = BTreeSet::new();
        match names.find(|name| domain.is_some() && !taken.insert(node_name(name))) {
            Some(name) => {
                let node = node_name(name);
                Err(Failure::Usage(format!("--ros2: two services would be the node {node}, {name} is one: rename it")))
            }
            None => Ok(()),
        }
    }

    /// The first service as ROS has it.
    pub(super) fn place(name: &Name, domain: Option<u8>) -> Option<String> {
        domain.map(|domain| format!("ROS 2 node {} in domain {domain}", node_name(name)))
    }

    /// Starts a node for each service; none without a domain.
    pub(super) fn start<'a>(
        session: &Session,
        names: impl Iterator<Item = &'a Name>,
        domain: Option<u8>,
        takes_torque: bool,
    ) -> Result<Self, BusError> {
        let Some(domain) = domain else { return Ok(Nodes::default()) };
        let start = |(number, name)| Node::start(session, name, NodeOptions { domain, number, takes_torque });
        Ok(Nodes(names.enumerate().map(start).collect::<Result<_, _>>()?))
    }

    /// Ends the nodes, and warns of what they dropped.
    pub(super) fn close(self) -> CommandResult<()> {
        for node in self.0 {
            let dropped = node.close()?;
            if dropped > 0 {
                say!("warning: --ros2 was too slow for {dropped} messages, which ROS did not get; bus and recording have them");
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_domain_is_a_number_that_ros_permits() {
        assert_eq!((domain("0"), domain("232")), (Ok(0), Ok(232)));
        for text in ["233", "-1", "1.5", "", "x"] {
            assert_eq!(domain(text), Err("a whole number from 0 to 232".to_owned()), "{text}");
        }
    }
}
