//! What is asked of the geometry of a surface.

/// Which way normals point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// Out of closed surfaces: ν = −∇u/|∇u| (errata.md, 2), with signs repaired where neighbours contradict it.
    Outward,
    /// ν = +∇u/|∇u|, whatever its sign.
    Gradient,
}

/// Which function's level surface is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceModel {
    /// The signature function, and the offset model where its gradient vanishes.
    Auto,
    Signature,
    Offset,
    /// Local regressions.
    Local,
}

/// What is asked of a geometry.
#[derive(Debug, Clone, Copy)]
pub struct GeometryRequest {
    pub orientation: Orientation,
    pub model: SurfaceModel,
    /// Whether second derivatives are served: they are checked against the neighbours and the cusp of the kernel.
    pub checks_curvatures: bool,
    /// Queries at which the offset model may be asked where the signature function has no answer; beyond them the answer is
    /// null. With more queries than that it confirms no curvatures either.
    pub max_offsets: usize,
    /// Whether standard deviations are asked for.
    pub has_deviations: bool,
}

impl GeometryRequest {
    /// Everything on: outward curvatures, checked, with all the work that they take.
    pub const CURVATURES: Self = Self {
        orientation: Orientation::Outward,
        model: SurfaceModel::Auto,
        checks_curvatures: true,
        max_offsets: usize::MAX,
        has_deviations: false,
    };
}
