//! The lattice that follows a surface: its nodes, the roots on its edges, and the polygons cut from its
//! cells.

pub(super) mod cut;
pub(super) mod follow;
pub(super) mod nodes;
pub(super) mod roots;
