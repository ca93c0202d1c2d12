//! Rows of the geometry of patches: turned to a side, at feet of points, and in the order of the points.

use std::ops::Range;

use super::tree_order::TreeOrder;
use crate::machine::heap::vec_bytes;
use crate::patches::{CurvatureDeviations, PatchGeometry};
use crate::points::cloud::Cloud;

impl PatchGeometry {
    /// Flips the normals whose `sign` is negative, with everything that changes sign with them.
    pub(super) fn turn(&mut self, mut sign: impl FnMut(usize, &[f64]) -> f64) {
        let m = self.is_known.len();
        let d = self.normals.len() / m.max(1);
        for query in 0..m {
            if !self.is_known[query] || sign(query, &self.normals[query * d..][..d]) > 0.0 {
                continue;
            }
            self.normals[query * d..][..d].iter_mut().for_each(|c| *c = -*c);
            self.shapes[query * d * d..][..d * d].iter_mut().for_each(|c| *c = -*c);
            self.heights[query] = -self.heights[query];
            if let Some(curvatures) = &mut self.curvatures {
                curvatures.principal[query * (d - 1)..][..d - 1].reverse();
            }
        }
    }

    /// The feet `x − hν` of some points of the cloud that this is the geometry at, `[m, d]`. Points without a
    /// regression stay where they are.
    pub(crate) fn feet(&self, cloud: &Cloud, points: Range<usize>) -> Vec<f64> {
        let d = cloud.dimension();
        let foot = |point: usize| {
            let (normal, height) = (&self.normals[point * d..][..d], self.heights[point]);
            cloud.point(point).iter().zip(normal).map(move |(x, c)| x - height * c)
        };
        points.flat_map(foot).collect()
    }

    /// Returns the geometry at ordered points in the order in which these were given.
    pub(super) fn given(&self, ordered: &TreeOrder) -> Self {
        let d = ordered.cloud.dimension();
        let curvatures = self.curvatures.as_ref().map(|own| CurvatureDeviations {
            principal: ordered.given_rows(&own.principal, d - 1),
            mean: ordered.given_rows(&own.mean, 1),
            gaussian: ordered.given_rows(&own.gaussian, 1),
            is_bent: ordered.given_rows(&own.is_bent, 1),
            radii: ordered.given_rows(&own.radii, 1),
        });
        Self {
            is_known: ordered.given_rows(&self.is_known, 1),
            normals: ordered.given_rows(&self.normals, d),
            shapes: ordered.given_rows(&self.shapes, d * d),
            is_at_rim: ordered.given_rows(&self.is_at_rim, 1),
            heights: ordered.given_rows(&self.heights, 1),
            height_std: ordered.given_rows(&self.height_std, 1),
            normal_std: ordered.given_rows(&self.normal_std, 1),
            curvatures,
        }
    }

    /// Bytes held on the heap.
    pub(super) fn n_bytes(&self) -> usize {
        let vectors = [&self.normals, &self.shapes];
        let numbers = [&self.heights, &self.height_std, &self.normal_std];
        let of_curvatures = |c: &CurvatureDeviations| {
            vec_bytes(&c.principal)
                + vec_bytes(&c.mean)
                + vec_bytes(&c.gaussian)
                + vec_bytes(&c.is_bent)
                + vec_bytes(&c.radii)
        };
        vectors.into_iter().chain(numbers).map(vec_bytes).sum::<usize>()
            + vec_bytes(&self.is_known)
            + vec_bytes(&self.is_at_rim)
            + self.curvatures.as_ref().map_or(0, of_curvatures)
    }
}
