//! The points of a cloud as positions in a file.

use std::sync::Arc;

use gramian_host::wire::write::model::{Positions, Shape};
use gramian_numerics::points::cloud::Cloud;

/// A cloud whose points are the vertices of a file.
pub struct Vertices(pub Arc<Cloud>);

impl Positions for Vertices {
    fn coordinates(&self) -> &[f64] {
        self.0.coordinates()
    }

    fn dimension(&self) -> usize {
        self.0.dimension()
    }
}

/// The points of a cloud, without cells.
pub fn shape_of_points(points: Arc<Cloud>) -> Shape {
    Shape::of_points(Arc::new(Vertices(points)))
}
