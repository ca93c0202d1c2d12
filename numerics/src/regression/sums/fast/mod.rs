//! Products `Kλ` in about n log n time, by interpolation between well-separated clusters (a fast multipole
//! method).
//!
//! The points are halved to a tree of clusters. Two clusters are well separated if their distance exceeds
//! their size. Between them the kernel is smooth, and `k(x, y)` is interpolated at nodes in the boxes around
//! them: weights of points become weights of nodes, kernels are evaluated between nodes, and values at nodes
//! are interpolated at points. Clusters that are near each other are halved further. Pairs of points in the
//! smallest ones that are near are evaluated as they are.
//!
//! Sources: Greengard and Rokhlin 1987; Fong and Darve 2009 for any kernel.

mod clusters;
mod grid;
mod lists;
mod plan;
#[cfg(test)]
mod tests;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::heap::vec_bytes;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use clusters::Clusters;
pub(crate) use plan::Plan;

/// Points in clusters.
pub(crate) struct FastSums {
    clusters: Clusters,
    /// The kernel in the coordinates of the clusters.
    kernel: Kernel,
}

impl FastSums {
    /// Dimensions up to which there are sums: a box has nodes along each axis.
    pub(crate) const MAX_DIMENSION: usize = grid::MAX_DIMENSION;

    /// Finds the clusters of a cloud, of at most [`Self::MAX_DIMENSION`] dimensions.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(crate) fn of(cloud: &Cloud, kernel: &Kernel, observer: &dyn Observer) -> Result<Self> {
        // Near the origin, nodes are as exact as points.
        let origin = cloud.point(0);
        let shifted = cloud.points().flat_map(|x| x.iter().zip(origin).map(|(x, o)| x - o)).collect();
        let shifted = Cloud::new(shifted, cloud.dimension())?;
        let stretched = kernel.stretched_cloud(&shifted).unwrap_or(shifted);
        Ok(Self { clusters: Clusters::of(&stretched, observer)?, kernel: kernel.unstretched() })
    }

    /// Plans products in which kernels are interpolated to about this part of their size, below 1.
    pub(crate) fn plan(&self, accuracy: f64) -> Plan<'_> {
        Plan::of(self, accuracy)
    }

    /// Bytes held on the heap.
    pub(crate) fn n_bytes(&self) -> usize {
        self.clusters.points.n_bytes() + vec_bytes(&self.clusters.order)
    }
}
