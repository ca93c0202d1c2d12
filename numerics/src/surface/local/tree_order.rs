//! A cloud in the order of its tree.

use std::sync::Arc;

use crate::error::Result;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;

/// A cloud in the order of its tree: points near each other in space mostly lie near each other in memory.
///
/// Work that looks at the nearest points of one point after another takes two thirds of the time so, at a
/// million points in random order.
pub(crate) struct TreeOrder {
    pub cloud: Arc<Cloud>,
    pub sampling: Arc<Sampling>,
    /// The sampling of the cloud as it was given.
    given: Arc<Sampling>,
}

impl TreeOrder {
    /// Orders a cloud whose sampling is known.
    ///
    /// # Errors
    /// None: points stay what they are. The type of a cloud checks them again.
    pub fn of(cloud: &Cloud, given: Arc<Sampling>) -> Result<Self> {
        let d = cloud.dimension();
        let coordinates = given.neighbours().rows_in_order(cloud.coordinates(), d);
        Ok(Self {
            cloud: Arc::new(Cloud::new(coordinates, d)?),
            sampling: Arc::new(given.in_tree_order()),
            given,
        })
    }

    /// Rows of the given points, `[n, width]`, in this order.
    pub fn own_rows<T: Copy>(&self, given: &[T], width: usize) -> Vec<T> {
        self.given.neighbours().rows_in_order(given, width)
    }

    /// Rows of the points in this order, `[n, width]`, in the given one.
    pub fn given_rows<T: Copy + Default>(&self, own: &[T], width: usize) -> Vec<T> {
        let mut rows = vec![T::default(); own.len()];
        for (&point, row) in self.given.neighbours().order().iter().zip(own.chunks_exact(width)) {
            rows[point as usize * width..][..width].copy_from_slice(row);
        }
        rows
    }

    /// Bytes held on the heap, without what was given.
    pub fn n_bytes(&self) -> usize {
        self.cloud.n_bytes() + self.sampling.n_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn the_order_is_that_of_the_tree_and_back_again_and_repeated_points_stay() {
        let mut coordinates = fibonacci_sphere(100).coordinates().to_vec();
        coordinates.extend_from_within(..30);
        let cloud = Cloud::new(coordinates, 3).unwrap();
        let given = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
        let ordered = TreeOrder::of(&cloud, given.clone()).unwrap();
        assert_eq!(ordered.own_rows(cloud.coordinates(), 3), ordered.cloud.coordinates());
        assert_eq!(ordered.given_rows(ordered.cloud.coordinates(), 3), cloud.coordinates());
        assert_eq!(ordered.given_rows(ordered.sampling.spacings(), 1), given.spacings());
        // The same tree, whose points are named in its own order.
        let near = ordered.sampling.neighbours();
        assert_eq!(near.order(), (0..110).collect::<Vec<u32>>());
        for (own, x) in ordered.cloud.points().enumerate() {
            let nearest = near.nearest(x, 2);
            assert!(nearest.iter().any(|found| found.point == own) || nearest[1].squared_distance == 0.0);
        }
    }
}
