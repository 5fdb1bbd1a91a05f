//! Services seen from ROS 2: as nodes on the bus, by the conventions of `rmw_zenoh`, without ROS installed.

mod cdr;
mod commands;
mod keys;
mod markers;
mod messages;
mod node;
mod publishers;
mod queue;
mod type_hash;
mod types;

pub use cdr::{CdrError, Value};
pub use commands::TORQUE_HOLD_S;
pub use keys::{LARGEST_DOMAIN, node_name};
pub use messages::{Converter, RosMessage};
pub use node::{Node, NodeOptions};
pub use types::{Count, Field, Kind, RosType};
