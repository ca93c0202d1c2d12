//! The lattice that follows a surface, and what its simplices have of it: nodes, roots on edges, and cuts.

pub(super) mod cut;
pub(super) mod follow;
pub(super) mod nodes;
pub(super) mod roots;
