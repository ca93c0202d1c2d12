//! Operators as sparse matrices: weights of the nodes near each query.
//!
//! In the tangent plane at a query the metric of a surface is the identity up to second order. So the surface
//! gradient is the gradient over tangential coordinates t, and the Laplace–Beltrami operator the Laplacian.
//! Weights for both come from the nearest nodes by smoothed polyharmonic splines r⁵ with polynomials up to
//! degree 4 (radial.rs). They are exact for these polynomials, have no length scale, and are of third order
//! in the spacing for second derivatives.
//!
//! STABILITY
//!
//! A matrix of the Laplace–Beltrami operator over its own nodes is stepped in time, so none of its
//! eigenvalues may have a positive real part. Such eigenvalues come from rows whose diagonal is positive, or
//! small beside the other weights. Smoothing makes the diagonal dominate wherever nodes surround the query.
//! Two kinds of rows are left:
//!
//! - All of the nearest nodes lie on one side, at a jump of the density. The row takes nodes from farther
//!   away, sparser with the distance (disc.rs, `graded`).
//! - No nodes lie on the other side, at a rim. The row has positive weights (positive.rs), which are not
//!   consistent there, and is flagged.
//!
//! No theorem says that rows with a dominant diagonal have such a spectrum together: the bound is measured
//! (docs/numerics.md, examples/stability_sweep.rs).

mod assembly;
mod disc;
mod least_norm;
mod positive;
mod radial;
mod row;
mod sparse;

use super::Operator;
use crate::error::Result;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbours;
use crate::surface::flags::Resolution;
use crate::surface::geometry::Geometry;
use assembly::{Assembly, Rows};
pub use row::RowKind;
pub use sparse::SparseMatrix;

/// Weights at all queries, with their origin and how far they can be trusted.
#[derive(Debug)]
pub struct Stencils {
    pub matrix: SparseMatrix,
    /// Resolution of the surface by the nodes around each query, `[m]`.
    pub resolutions: Vec<Resolution>,
    /// Origin of the weights of each row, `[m]`.
    pub kinds: Vec<RowKind>,
}

impl Stencils {
    /// Number of rows of a kind.
    pub fn n_rows(&self, kind: RowKind) -> usize {
        self.kinds.iter().filter(|&&found| found == kind).count()
    }
}

impl Operator {
    /// Computes the operator at the queries of the geometry as a sum over nodes.
    ///
    /// The result is `[m, n]`, unit 1/L², or `[d, m, n]`, unit 1/L. Over the nodes themselves, no eigenvalue
    /// of the Laplace–Beltrami operator has a positive real part beyond rounding. Its rows at a rim are those
    /// of a no-flux boundary, and are flagged. Rows are empty for null queries that are not nodes, and in a
    /// cloud of one position.
    ///
    /// # Errors
    /// `NumericsError::DimensionMismatch`, `NumericsError::Overflow`, `NumericsError::Cancelled`.
    pub fn stencils(
        self,
        geometry: &Geometry,
        nodes: &Cloud,
        neighbours: &Neighbours,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Stencils> {
        let rows = match self {
            Self::LaplaceBeltrami => Rows::Stable,
            Self::SurfaceGradient => Rows::Pointwise,
        };
        Assembly { geometry, nodes, neighbours, queries, operator: self, rows }.stencils(observer)
    }
}

#[cfg(test)]
mod stability_tests;
#[cfg(test)]
mod tests;
