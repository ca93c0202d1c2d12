//! Requests for the geometry of a surface.

/// The direction in which normals point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// Out of closed surfaces: ν = −∇u/|∇u| (errata.md, 2), with signs repaired where neighbours contradict
    /// them.
    Outward,
    /// ν = +∇u/|∇u|, whatever its sign.
    Gradient,
}

/// The function whose level surface is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceModel {
    /// The signature function, and the offset model where its gradient vanishes.
    Auto,
    Signature,
    Offset,
    /// Local regressions.
    Regression,
}

/// Options of a request for geometry.
#[derive(Debug, Clone, Copy)]
pub struct GeometryRequest {
    pub orientation: Orientation,
    pub model: SurfaceModel,
    /// True if second derivatives are served. They are then checked against the neighbours and the cusp of
    /// the kernel.
    pub checks_curvatures: bool,
    /// Most queries at which the offset model may be asked where the signature function has no answer.
    /// Queries beyond them are null. If there are more queries than this in all, the offset model confirms no
    /// curvatures either.
    pub max_offsets: usize,
    /// True if standard deviations are requested.
    pub has_deviations: bool,
    /// True if the normals of both sheets at sharp edges are requested, which only regressions find.
    pub has_edge_normals: bool,
}

impl GeometryRequest {
    /// Outward curvatures, checked, with all the work that they take.
    pub const CURVATURES: Self = Self {
        orientation: Orientation::Outward,
        model: SurfaceModel::Auto,
        checks_curvatures: true,
        max_offsets: usize::MAX,
        has_deviations: false,
        has_edge_normals: false,
    };
}
