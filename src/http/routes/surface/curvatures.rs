//! `POST /v1/curvatures`: curvatures of the surface that a cloud samples.

use super::common::{GeometryWork, geometry_request, plan_geometry};
use crate::http::fields::{
    Diagnostics, Flag, GeometryAttribute, OrientationChoice, SurfaceModelChoice, SurfaceModelUsed, request,
};
use crate::http::problem::Problem;
use crate::http::routes::operation::operation;
use crate::http::serve::answers::place::shape_of_points;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::planner::Planner;
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::negotiation::Format;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::model::Shape;
use gramian_numerics::kernel::defaults::Purpose;

request! {
    /// A cloud that samples a hypersurface, and queries at which to compute its curvatures.
    pub struct CurvaturesRequest taking hyperparameters {
        /// The points to compute at, one row of coordinates each. Default: the points of the cloud.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The function whose level set is the surface. Default: `auto`.
        pub surface_model: Option<SurfaceModelChoice>,
        /// The direction of normals, which determines the sign of curvatures. Default: `outward`.
        pub orientation: Option<OrientationChoice>,
        /// Optional parts of the answer. Default: none.
        pub include: Option<Vec<GeometryAttribute>>,
    }
}

answer! {
    /// Curvatures of the surface at the queries.
    pub struct CurvaturesResponse {
        /// The d − 1 principal curvatures at each query, ascending, 1/length. Null where there is none.
        principal_curvatures: Array as Vec<Option<Vec<f64>>>,
        /// A unit direction for each principal curvature, its largest component positive.
        ///
        /// Where curvatures coincide, their directions are an arbitrary basis.
        principal_directions: Array as Vec<Option<Vec<Vec<f64>>>>,
        /// The average of the principal curvatures at each query, 1/length. Null where there are none.
        mean_curvatures: Array as Vec<Option<f64>>,
        /// The product of the principal curvatures at each query, 1/length to the d − 1. Null where there are
        /// none.
        gaussian_curvatures: Array as Vec<Option<f64>>,
        /// The normal at each query, of length 1. Null where there is none.
        normals: Array as Vec<Option<Vec<f64>>>,
        /// |∇u| at each query for the function in `surface_models`: unit 1/length for `signature`, about 1
        /// for `offset`.
        gradient_norms: Array as Vec<f64>,
        /// The signature function at each query: 1 on the surface, usually more inside a closed one.
        levels: Array as Vec<f64>,
        /// The function whose level surface was used at each query. It is `signature` where there is no
        /// answer.
        surface_models: Vec<SurfaceModelUsed>,
        /// Standard deviation of the angle of the normal at each query, radians.
        ///
        /// 95 % of the angles lie within 1.96 standard deviations. Null where there is no answer or the
        /// deviation is not known.
        normal_std: Option<Array> as Option<Vec<Option<f64>>>,
        /// Standard deviations of the principal curvatures at each query, in their order, 1/length.
        principal_curvature_std: Option<Array> as Option<Vec<Option<Vec<f64>>>>,
        /// Standard deviations of the mean curvatures, 1/length.
        mean_curvature_std: Option<Array> as Option<Vec<Option<f64>>>,
        /// Standard deviations of the Gaussian curvatures, 1/length to the d − 1.
        gaussian_curvature_std: Option<Array> as Option<Vec<Option<f64>>>,
        /// The normals of the two sheets that meet at each query, if it is at a sharp edge. Null elsewhere.
        edge_normals: Option<Array> as Option<Vec<Option<Vec<Vec<f64>>>>>,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        flags: Vec<Flag>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
        /// The queries, for model/ply.
        #[schema(ignore)]
        shape: Shape,
    }
}

operation! {
/// Compute curvatures
///
/// Returns principal curvatures with their directions, mean curvatures and Gaussian curvatures. Principal
/// curvatures are eigenvalues of the shape operator S = σPD²uP/|∇u| of the level surface of the signature
/// function u, where P projects onto the tangent space and σ = ±1 is such that σ∇u points along the normal. A
/// sphere of radius r has curvatures +1/r with outward normals. Where ∇u vanishes or is too small to be
/// trusted, the nearest points and copies shifted by ±δ along their normals are interpolated instead (the
/// offset model). An entry that disagrees with the points around its query is listed in `flags`.
pub async fn compute_curvatures(CurvaturesRequest) -> CurvaturesResponse;
path: "/v1/curvatures", tag: "geometry", answer: "Curvatures at the queries"
}

impl Operation for CurvaturesRequest {
    type Work = GeometryWork;
    const FORMATS: &[Format] = &[Format::Json, Format::Safetensors, Format::Ply];

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<GeometryWork>, Problem> {
        let fit = self.take_fit();
        let request = geometry_request(self.surface_model, self.orientation, true, self.include.as_deref());
        plan_geometry(planner, fit, self.queries, request, Purpose::Curvatures, |d| d * d + 2 * d + 5)
    }

    fn compute(
        work: GeometryWork,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<CurvaturesResponse, Problem> {
        let surface = fits.geometry(&work.queries, &work.request, observer)?;
        let geometry = &surface.geometry;
        let (m, d) = (geometry.n_queries(), geometry.dimension());
        let curvatures = geometry.curvatures(observer).map_err(|error| fits.surface().refused(error))?;
        let (normal, principal, mean, gaussian) = match surface.deviations() {
            None => (None, None, None, None),
            Some(found) => {
                (Some(found.normal), Some(found.principal), Some(found.mean), Some(found.gaussian))
            }
        };
        Ok(CurvaturesResponse {
            principal_curvatures: surface.per_query(curvatures.principal, &[m, d - 1]),
            principal_directions: surface.per_query(curvatures.directions, &[m, d - 1, d]),
            mean_curvatures: surface.per_query(curvatures.mean, &[m]),
            gaussian_curvatures: surface.per_query(curvatures.gaussian, &[m]),
            normals: surface.per_query(geometry.normals().to_vec(), &[m, d]),
            gradient_norms: Array::new(geometry.gradient_norms().to_vec(), &[m]),
            levels: Array::new(geometry.levels().to_vec(), &[m]),
            surface_models: surface.surface_models(),
            edge_normals: surface.edge_normals(),
            flags: surface.flags(),
            normal_std: normal,
            principal_curvature_std: principal,
            mean_curvature_std: mean,
            gaussian_curvature_std: gaussian,
            diagnostics: surface.diagnostics(fits),
            shape: shape_of_points(work.queries),
        })
    }
}
