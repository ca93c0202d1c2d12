//! Geometry served at queries, whichever model it comes from.

use super::flags::FlagReason;

/// The model that serves a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ServedBy {
    Signature,
    Offset,
    Regression,
}

/// Standard deviations at m queries, in flat arrays, in the order of the quantities they belong to. Zero at
/// null queries.
#[derive(Debug, Clone)]
pub struct Deviations {
    /// True where a query has deviations, `[m]`.
    pub is_known: Vec<bool>,
    /// Deviations of the surface along its normal, `[m]`, L.
    pub height: Vec<f64>,
    /// Deviations of the angle of the normal, `[m]`, radians.
    pub normal: Vec<f64>,
    /// Deviations of the principal curvatures, `[m, d−1]`, 1/L.
    pub principal: Vec<f64>,
    /// Deviations of the mean curvature, `[m]`, 1/L.
    pub mean: Vec<f64>,
    /// Deviations of the Gaussian curvature, `[m]`, 1/L^{d−1}.
    pub gaussian: Vec<f64>,
}

/// An edge at a query.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    pub query: usize,
    /// Unit normals of the two sheets, `[2, d]`, first that of the own sheet of the query, if it has one.
    pub normals: Vec<f64>,
}

/// Geometry of the surface at m queries, in flat arrays.
pub(crate) struct GeometryArrays {
    pub(super) dimension: usize,
    /// Gradient of the function that serves each query, `[m, d]`.
    pub(super) gradients: Vec<f64>,
    /// Hessian of the function that serves each query, `[m, d, d]`.
    pub(super) hessians: Vec<f64>,
    pub(super) verdicts: Vec<Verdict>,
    /// Values of u, `[m]`.
    pub(super) levels: Vec<f64>,
    pub(super) deviations: Option<Deviations>,
    /// Queries at sharp edges, ascending, where regressions serve them.
    pub(super) edges: Vec<Edge>,
}

/// Sign, model and flag of a query.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Verdict {
    /// Sign of ν against ∇u: +1 or −1.
    pub sign: f64,
    pub by: ServedBy,
    pub reason: Option<FlagReason>,
}

impl Verdict {
    pub(crate) fn is_null(self) -> bool {
        self.reason.is_some_and(FlagReason::is_null)
    }
}

impl GeometryArrays {
    pub(crate) fn gradient(&self, query: usize) -> &[f64] {
        &self.gradients[query * self.dimension..][..self.dimension]
    }

    /// Returns the Hessian at a query, symmetric `[d, d]`.
    pub(crate) fn hessian(&self, query: usize) -> &[f64] {
        let n_entries = self.dimension * self.dimension;
        &self.hessians[query * n_entries..][..n_entries]
    }

    pub(crate) fn verdict(&self, query: usize) -> Verdict {
        self.verdicts[query]
    }
}
