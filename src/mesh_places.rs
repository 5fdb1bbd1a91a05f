//! Places along a link that the nodes of two meshes share.

/// The node of a mesh of `others` elements at the place of a node in a mesh of `own`: node i of n elements lies where node j of m does
/// if i·m = j·n. `None` if there is none.
pub(crate) fn node_at_same_place(node: u64, own: u64, others: u64) -> Option<u64> {
    let scaled = node * others;
    scaled.checked_div(own).filter(|other| other * own == scaled)
}
