//! `POST /v1/level-set`: a mesh of the surface that a cloud samples, or of a level of a function through
//! values.

mod answer;
mod plan;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::fields::{Diagnostics, MeanChoice, OrientationChoice, SurfaceModelChoice, request};
use crate::http::problem::Problem;
use crate::http::routes::operation::operation;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::planner::{Planner, ValuesUse};
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::negotiation::Format;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::integers::Integers;
use gramian_host::wire::write::model::Shape;
use plan::{LevelSetWork, Subject};

/// Shape of the triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshQuality {
    /// Nearly equilateral triangles. Short edges are collapsed, others flipped, and vertices spread along the
    /// surface. The topology stays as it is.
    #[default]
    Regular,
    /// Triangles as the lattice cuts them, with many slivers. Segments of curves are always raw.
    Raw,
}

/// Optional parts of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshAttribute {
    /// Principal and mean curvatures at the vertices.
    Curvatures,
    /// Standard deviations of the positions of the vertices, and of their normals and curvatures.
    Std,
}

/// A box that a surface is followed in.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshBounds {
    /// The least coordinate along each axis.
    pub min: Vec<f64>,
    /// The greatest coordinate along each axis.
    pub max: Vec<f64>,
}

request! {
    /// A cloud in the plane or in space whose surface is to be meshed, or values whose level is.
    pub struct LevelSetRequest taking hyperparameters {
        /// A number for each point of the cloud. If given, a level of the function through them is meshed.
        ///
        /// Default: the surface that the cloud samples is meshed.
        #[serde(default, deserialize_with = "present_unless_empty")]
        pub values: Option<Vec<f64>>,
        /// The mean of the function through `values`. Default: a constant without `kernel`, zero with one.
        pub mean: Option<MeanChoice>,
        /// The level of the function through `values`. Default: the median of the values.
        pub level: Option<f64>,
        /// The function whose level set is the surface. Default: `auto`.
        pub surface_model: Option<SurfaceModelChoice>,
        /// The direction of normals, and so the order of the vertices of a cell. Default: `outward`.
        pub orientation: Option<OrientationChoice>,
        /// The longest edge of the lattice that follows the surface. Default: the median spacing of the
        /// points.
        #[schema(exclusive_minimum = 0.0)]
        pub step: Option<f64>,
        /// The box that the surface is followed in. Default: where the cloud is, and a fifth of its
        /// radius around.
        pub bounds: Option<MeshBounds>,
        /// The shape of the triangles. Default: `regular`.
        pub quality: Option<MeshQuality>,
        /// True if the surface ends where its points end. Default: false. A closed mesh bridges holes.
        pub open: Option<bool>,
        /// Optional parts of the answer. Default: none.
        pub include: Option<Vec<MeshAttribute>>,
    }
}

/// Support of a vertex by the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum VertexSupport {
    /// There are points within two spacings.
    Observed,
    /// The cloud has a hole here, with points around it.
    Bridged,
    /// The surface goes on beyond the points, or more than eight spacings from them.
    Extrapolated,
}

impl VertexSupport {
    /// The number that stands for it in files of models.
    pub fn code(self) -> u8 {
        self as u8
    }
}

/// A connected part of a mesh.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct MeshPart {
    /// Number of its vertices.
    pub n_vertices: usize,
    /// Number of its segments or triangles.
    pub n_cells: usize,
    /// Vertices − segments, or vertices − edges + triangles: 0 for a closed curve, 2 for a sphere, 0 for
    /// a torus.
    pub euler_characteristic: i64,
    /// Number of edges (in the plane: ends) that belong to a single cell. 0 if the part is closed.
    pub n_boundary_edges: usize,
    /// The area in the square of the unit of the points, or the length of a curve.
    pub area: f64,
    /// Number of its vertices that are farther than three spacings from all points.
    pub n_far_vertices: usize,
}

answer! {
    /// A mesh of segments (in the plane) or triangles (in space).
    pub struct LevelSetResponse {
        /// The vertices, one row of coordinates each.
        vertices: Array as Vec<Vec<f64>>,
        /// The vertices of each segment or triangle, by index from 0.
        ///
        /// Seen from the side that normals point to, triangles run counter-clockwise. Segments run
        /// counter-clockwise around the inside.
        cells: Integers as Vec<Vec<usize>>,
        /// The normal at each vertex, of length 1.
        normals: Array as Vec<Vec<f64>>,
        /// Support of each vertex by the points.
        support: Vec<VertexSupport>,
        /// The distance of each vertex from the level, to first order, in the unit of the points.
        ///
        /// Null where the function is flat.
        residuals: Array as Vec<Option<f64>>,
        /// The d − 1 principal curvatures at each vertex, ascending, 1/length.
        principal_curvatures: Option<Array> as Option<Vec<Option<Vec<f64>>>>,
        /// The average of the principal curvatures at each vertex, 1/length.
        mean_curvatures: Option<Array> as Option<Vec<Option<f64>>>,
        /// The standard deviation of each vertex along its normal, in the unit of the points.
        ///
        /// Null where it is not known.
        position_std: Option<Array> as Option<Vec<Option<f64>>>,
        /// The standard deviation of the angle of the normal at each vertex, radians.
        normal_std: Option<Array> as Option<Vec<Option<f64>>>,
        /// Standard deviations of the principal curvatures at each vertex, 1/length.
        principal_curvature_std: Option<Array> as Option<Vec<Option<Vec<f64>>>>,
        /// Standard deviations of the mean curvatures, 1/length.
        mean_curvature_std: Option<Array> as Option<Vec<Option<f64>>>,
        /// The connected parts of the mesh, largest first.
        parts: Vec<MeshPart>,
        /// Parts that were left out: no point is near them, they have too few points of their own, or they
        /// are too small to mean anything.
        dropped_parts: Vec<MeshPart>,
        /// The share of the points with the inside on one side and the outside on the other, by winding
        /// numbers.
        ///
        /// Absent for a level of values.
        closedness: Option<f64>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
        /// The mesh for the formats of models.
        #[schema(ignore)]
        shape: Shape,
    }
}

operation! {
/// Mesh a surface
///
/// Returns the level set of a function as closed polylines (in the plane) or as a triangle mesh (in
/// space), followed from the points of the cloud on a lattice with edges of `step`. The mesh is a
/// manifold, and closed wherever `bounds` does not cut it. Without `values` it is the surface that the
/// cloud samples: the level of its signature function, or for large clouds that of local regressions,
/// closed by winding numbers where the cloud has holes. The `support` of a vertex is `observed`, `bridged`
/// or `extrapolated`. With `include`, vertices have curvatures and error bars.
pub async fn compute_level_set(LevelSetRequest) -> LevelSetResponse;
path: "/v1/level-set", tag: "geometry", answer: "The mesh"
}

impl Operation for LevelSetRequest {
    type Work = LevelSetWork;
    const FORMATS: &[Format] = &[Format::Json, Format::Safetensors, Format::Ply, Format::Gltf, Format::Obj];

    fn values_use(&self) -> ValuesUse {
        if self.values.is_some() { ValuesUse::Alone } else { ValuesUse::Nothing }
    }

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<LevelSetWork>, Problem> {
        match self.values.take() {
            Some(values) => self.plan_values(planner, values),
            None => self.plan_surface(planner),
        }
    }

    fn compute(work: LevelSetWork, fits: &Fits, observer: &JobObserver) -> Result<LevelSetResponse, Problem> {
        match &work.of {
            Subject::Surface => answer::of_surface(&work, fits, observer),
            Subject::Level(of) => answer::of_values(&work, of, fits, observer),
        }
    }
}
